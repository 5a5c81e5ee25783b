from __future__ import annotations

import dataclasses
import math

import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.faults.grasp_stability.held import Held, ease, squeeze
from tests import toy

APPLE = (0.4, 0.0, 0.94, *toy.UPRIGHT)
UP = (0.0, 0.0, 1.0)


def _poses(mug, hand):
    return toy.at_rest(object_pose=((*mug, *toy.UPRIGHT), APPLE), eef_pose=(*hand, *toy.UPRIGHT))


def test_both_fingers_press_and_nothing_else_does():
    rows = toy.contacts(
        (0, "robot/finger_left", "mug/body", 9.0, UP),
        (0, "mug/body", "robot/finger_right", 8.0, UP),
        (0, "counter/body", "mug/body", 3.0, UP),
        (0, "robot/finger_left", "apple/body", 2.0, UP),
    )
    arm = Arm(toy.SCENE, dataclasses.replace(toy.at_rest(), contacts=rows))
    assert squeeze(arm, "obj") == pytest.approx(17.0)


def test_what_moves_with_the_hand_has_not_slid():
    arm = Arm(toy.SCENE, _poses((0.0, 0.0, 1.0), (0.0, 0.0, 1.1)))
    held = Held(arm, Thing(arm, "obj"))
    arm.step = _poses((0.2, 0.1, 1.3), (0.2, 0.1, 1.4))
    assert held.slid == pytest.approx(0.0, abs=1e-6)
    arm.step = _poses((0.2, 0.1, 1.26), (0.2, 0.1, 1.4))
    assert held.slid == pytest.approx(0.04, abs=1e-6)
    assert held.swung == pytest.approx(0.0, abs=1e-6)


def test_what_hangs_has_turned_in_the_hand():
    arm = Arm(toy.SCENE, _poses((0.0, 0.0, 1.0), (0.0, 0.0, 1.1)))
    held = Held(arm, Thing(arm, "obj"))
    half = math.radians(40.0) / 2.0
    turned = (0.0, 0.0, 1.0, math.cos(half), math.sin(half), 0.0, 0.0)
    arm.step = toy.at_rest(object_pose=(turned, APPLE), eef_pose=(0.0, 0.0, 1.1, *toy.UPRIGHT))
    assert math.degrees(held.swung) == pytest.approx(40.0, abs=0.01)


def test_a_grip_is_eased_until_it_is_loose_enough():
    arm, taken = Arm(toy.SCENE, toy.at_rest(gripper=(0.5, 0.0))), []

    def notches():
        return [float(action[6]) for action in taken if action[11] < 0.0]

    for action in ease(arm, 6, until=lambda: len(notches()) == 2):
        taken += [action]
    assert notches() == [-1.0, -1.0]


def test_fingers_that_hold_something_open_by_a_notch_and_stay():
    arm = Arm(toy.SCENE, toy.at_rest(gripper=(0.5, 0.0)))
    told = [float(action[6]) for action in ease(arm, 1)]
    assert told[0] == -1.0
    assert len(told) > 1
    assert set(told[1:]) == {0.0}
