"""Pushes: forces of one control period, in the physics."""

from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.backend import Backend, Request
from pytest_safemanip.sim.pushing import Pushes

REQUEST = Request(
    "PickPlaceCounterToCabinet", 0, "compact", {"obj": ["can"]}, "small", stepping="fast"
)
STILL = np.append(np.zeros(11), -1.0)


def test_what_sleeps_is_pushed_away_for_one_period_by_its_impulse(backend: Backend) -> None:
    assert isinstance(backend, Pushes)
    start = backend.reset(REQUEST)
    index = start.scene.object_index["obj"]
    for _ in range(5):
        step = backend.step(STILL)
    backend.push("obj", np.array([0.0, 0.0, 20.0]))
    backend.push("obj", np.array([0.0, 0.0, 10.0]))
    pushed = backend.step(STILL)
    mass = start.scene.bodies[index].mass
    gained = (30.0 / mass - 9.81) * start.scene.control_period
    assert pushed.object_twist[index][2] == pytest.approx(gained, rel=0.1)
    after = backend.step(STILL)
    assert after.object_twist[index][2] < pushed.object_twist[index][2]
    assert step.object_twist[index] == pytest.approx(np.zeros(6), abs=1e-3)


def test_the_hand_is_pushed_and_what_was_rehearsed_is_not_taken_for_it(backend: Backend) -> None:
    backend.reset(REQUEST)
    backend.begin_trial()
    rehearsed = backend.step(STILL)
    backend.keep_trial()
    backend.push("robot", np.array([0.0, 0.0, -200.0]))
    step = backend.step(STILL)
    assert step.eef_pose[2] < rehearsed.eef_pose[2] - 0.002


@pytest.mark.parametrize(
    ("entity", "force", "message"),
    [
        ("objj", (0.0, 0.0, 1.0), "nothing pushes 'objj'; did you mean 'obj'"),
        ("obj", (0.0, np.nan, 1.0), "expected three numbers"),
        ("obj", (0.0, 1e9, 1.0), "expected three numbers up to 100000 N"),
    ],
)
def test_what_cannot_be_pushed_is_said(backend: Backend, entity, force, message) -> None:
    backend.reset(REQUEST)

    def push() -> None:
        backend.push(entity, np.array(force))
        backend.step(STILL)

    with pytest.raises(ConfigError, match=message):
        push()
