"""RoboCasa's own environment, as its gym wrapper has it, watched while it is stepped."""

from __future__ import annotations

import dataclasses

import gymnasium
import numpy as np
import pytest

from pytest_safemanip import SafetyMonitor
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.robocasa.robot import SPEC
from pytest_safemanip.trace.steps import ARRAYS

TASK = "OpenDrawer"
STEPS = 25


class Wrapper(gymnasium.Env):
    """What RoboCasa's wrapper does, without drawing: actions by name, and ``env``."""

    observation_space = gymnasium.spaces.Dict()
    action_space = gymnasium.spaces.Dict()

    def __init__(self, env):
        self.env = env

    def reset(self, *, seed=None, options=None):
        return {}, {}

    def step(self, action):
        _, reward, done, info = self.env.step(np.concatenate(list(action.values())))
        return {}, reward, done, False, info


def actions():
    """The arm falls onto what is below it, and its gripper closes."""
    random = np.random.default_rng(1)
    for step in range(STEPS):
        action = random.uniform(-0.3, 0.3, SPEC.robot.actions.size)
        action[2], action[6], action[11] = -1.0, 1.0 if step % 2 else -1.0, -1.0
        yield {"arm": action[:7], "base": action[7:]}


def told(env):
    """What is told of each step, and the state of the simulation after it."""
    env.reset(seed=0)
    sim = env.unwrapped.env.sim
    infos, states = [], []
    for action in actions():
        infos.append(env.step(action)[-1])
        states.append(sim.get_state().flatten().copy())
    return infos, np.array(states)


@pytest.fixture(scope="module")
def watched(make_kitchen):
    """The episode, watched; with the steps that were read."""
    env = SafetyMonitor(Wrapper(make_kitchen(TASK)), TASK)
    read, judge_step = [], []

    def keep(step, *rest):
        read.append(step)
        return judge_step[0](step, *rest)

    env.reset(seed=0)
    judge_step.append(env._judge.step)
    env._judge.step = keep
    infos, states = [], []
    sim = env.unwrapped.env.sim
    for action in actions():
        infos.append(env.step(action)[-1])
        states.append(sim.get_state().flatten().copy())
    env._source.leave()
    return infos, np.array(states), read


def test_no_bit_of_an_episode_changes_because_it_is_watched(make_kitchen, watched):
    _, states = told(Wrapper(make_kitchen(TASK)))
    assert np.array_equal(states.view(np.uint64), watched[1].view(np.uint64))


def test_what_is_read_is_what_the_backend_records(backend, object_groups, watched):
    *_, read = watched
    backend.reset(Request(TASK, 0, "compact", object_groups(TASK)))
    for action, step in zip(actions(), read, strict=True):
        wanted = backend.step(np.concatenate(list(action.values())))
        for name in ARRAYS:
            assert np.array_equal(getattr(step, name), getattr(wanted, name)), name
        for column in dataclasses.fields(wanted.contacts):
            one, other = (getattr(s.contacts, column.name) for s in (step, wanted))
            assert np.array_equal(one, other), column.name


def test_every_step_says_what_is_violated(watched):
    infos, *_ = watched
    for info in infos:
        assert set(info["safety"]) == {"collision_contact", "action_onset", "mechanism_recovery"}
        unsafe = any(state.unsafe for state in info["safety"].values())
        assert (info["cost"] > 0.0) == unsafe
