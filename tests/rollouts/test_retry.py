"""An episode whose policy's server gets lost."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from pytest_safemanip.errors import (
    PolicyAnswerError,
    PolicyConnectionLost,
    PolicyUnreachable,
    RolloutError,
)
from pytest_safemanip.policies.adapter import AdaptedPolicy
from pytest_safemanip.policies.registry import PolicySpec
from pytest_safemanip.rollouts import retry as episodes
from pytest_safemanip.rollouts.loop import Job, Protocol
from pytest_safemanip.sim.backend import Request
from tests import toy

JOB = Job("OpenDrawer", "mine", Request("OpenDrawer", 7, "compact"), Protocol(), {})


class Loses:
    """Loses its server at the third call of so many episodes."""

    def __init__(self, times, error=PolicyConnectionLost):
        self.times, self.error = times, error
        self.seeds = []

    def reset(self, episode):
        self.seeds.append(episode.seed)
        self.calls = 0

    def act(self, observation):
        self.calls += 1
        if self.calls == 3 and len(self.seeds) <= self.times:
            raise self.error("the server died")
        return np.zeros(12)


def run(policy, world=None):
    world = world or toy.World(horizon=5)
    spec = PolicySpec("mine", lambda: AdaptedPolicy(policy), None)
    return episodes.run(JOB, world, spec, lambda *_: None)


@pytest.mark.parametrize("times", [0, 1, 2])
def test_it_is_begun_again_from_its_seed_and_nothing_of_before_is_recorded(times):
    policy, world = Loses(times), toy.World(horizon=5)
    recording = run(policy, world)
    assert policy.seeds == [7] * (times + 1)
    assert recording.acting == 6
    assert [request.seed for request in world.requests] == policy.seeds


def test_after_three_times_it_is_an_error():
    policy = Loses(9)
    with pytest.raises(RolloutError, match="the server died\nthe episode was begun 3 times"):
        run(policy)
    assert len(policy.seeds) == 3


def test_a_wrong_answer_is_not_asked_for_again():
    policy = Loses(9, PolicyAnswerError)
    with pytest.raises(PolicyAnswerError):
        run(policy)
    assert len(policy.seeds) == 1


def test_what_is_not_ready_is_not_waited_for():
    def ready(task, sets):
        raise PolicyUnreachable(f"no server for {task}")

    world = toy.World()
    spec = PolicySpec("mine", lambda: AdaptedPolicy(Loses(0)), None, ready=ready)
    with pytest.raises(PolicyUnreachable, match="no server for OpenDrawer"):
        episodes.run(JOB, world, spec, lambda *_: None)
    assert not world.requests


def test_what_a_policy_sets_of_numpy_and_of_warnings_ends_with_its_rollout():
    class Sets:
        def reset(self, episode):
            np.seterr(all="raise")
            warnings.simplefilter("ignore")

        def act(self, observation):
            assert np.geterr()["divide"] == "raise"
            return np.zeros(12)

    errors, filters = np.geterr(), list(warnings.filters)
    run(Sets())
    assert (np.geterr(), list(warnings.filters)) == (errors, filters)
