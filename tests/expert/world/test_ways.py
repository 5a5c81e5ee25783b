"""Ways are asked for as they are gone."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.rotations import quaternion
from pytest_safemanip.expert.world.ways import Leg, foresee, held
from pytest_safemanip.sim.clearance import Clearance, Touch
from pytest_safemanip.trace.geometry import matrix
from tests import toy

UP = (0.0, 0.0, 1.0)
HERE = np.array((0.4, 0.0, 1.1))
TOUCH = Touch("palm", "cab", "door", (0.5, 0.0, 1.0), 0.02)


def _answer(waypoint, touch):
    return Clearance(waypoint, touch, 0.0, 0.0, 0.04, np.zeros(7), np.zeros(7))


class Foretold:
    """Answers one after the other, and what was asked."""

    def __init__(self, *answers):
        self.answers, self.asked = list(answers), []

    def __call__(self, paths):
        self.asked += paths
        return [self.answers.pop(0)]


def _arm(*answers, step=None):
    foretold = Foretold(*answers)
    return Arm(toy.SCENE, step or toy.at_rest(), "", foretold), foretold


def test_a_way_of_base_and_hand_is_asked_for_as_it_is_gone():
    arm, foretold = _arm(_answer(1, None))
    turned = np.array(((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    foresee(arm, [Leg(arm.base + 0.2), Leg(HERE, turned, 0.02, 0.5)], (("finger", "cab"),))
    (path,) = foretold.asked
    assert path.base[0, :2] == pytest.approx(arm.base + 0.2)
    assert np.isnan(path.base[1]).all()
    assert np.isnan(path.hand[0]).all()
    assert path.hand[1, :3] == pytest.approx(HERE)
    assert matrix(path.hand[1, 3:]) == pytest.approx(turned)
    assert path.speed.tolist() == [1.0, 0.5]
    assert (path.permits, path.since) == ((("finger", "cab"),), 1)


def test_held_is_what_all_fingers_press_on_and_what_lies_in_it_alone():
    pinch = [(0, f"robot/finger_{side}", "mug/body", 3.0, UP) for side in ("left", "right")]
    lies_in = (0, "apple/body", "mug/body", 1.0, UP)
    stands = (0, "counter/body", "apple/body", 1.0, UP)
    found = []
    for rows in ((), pinch[:1], pinch, [*pinch, lies_in], [*pinch, lies_in, stands]):
        arm, _ = _arm(step=dataclasses.replace(toy.at_rest(), contacts=toy.contacts(*rows)))
        found.append(held(arm))
    assert found == [(), (), ("mug",), ("apple", "mug"), ("mug",)]


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.6, 0.0, 0.8)])
def test_quaternions_of_half_turns_are_right(axis):
    about = 2.0 * np.outer(axis, axis) - np.eye(3)
    assert matrix(quaternion(about)) == pytest.approx(about)
