from __future__ import annotations

import dataclasses
import math

import pytest

from pytest_safemanip.policies.scripted.arm import Arm
from pytest_safemanip.policies.scripted.grasping import around
from pytest_safemanip.policies.scripted.putting import END, free_end
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.trace.elements import Body
from tests import toy

NONE = (0.0, 0.0, 0.0)
BOARD = Body("mug", (0.15, 0.1, 0.01), NONE, NONE, 0.5)
JAR = Body("apple", (0.03, 0.03, 0.05), NONE, NONE, 0.3)
WITH_BOARD = dataclasses.replace(toy.SCENE, bodies=(BOARD, JAR))
NEAR, FAR = 0.5 - END * 0.3, 0.5 + END * 0.3


@pytest.mark.parametrize(
    ("jar", "ahead"),
    [
        ((0.55, 0.0, 1.60), FAR),
        ((0.95, 0.0, 1.00), FAR),
        ((FAR, 0.0, 1.00), NEAR),
        ((NEAR, 0.0, 1.00), FAR),
    ],
    ids=["on a shelf above", "behind the board", "on the far end", "on the near end"],
)
def test_the_first_of_two_goes_to_the_far_end_and_the_second_to_the_other(jar, ahead):
    poses = ((0.5, 0.0, 0.94, *toy.UPRIGHT), (*jar, *toy.UPRIGHT))
    arm = Arm(WITH_BOARD, toy.at_rest(object_pose=poses))
    spot = free_end(arm, Thing(arm, "mug"), Thing(arm, "apple"))
    assert spot[:2] == pytest.approx((ahead, 0.0))


@pytest.mark.parametrize("least", [90.0, 45.0])
def test_the_fingers_stay_off_a_cups_handle(least):
    # Its box reaches 4 cm out to the robot's left, along the line on which the fingers travel.
    cup = Body("mug", (0.035, 0.055, 0.045), (0.0, 0.02, 0.0), NONE, 0.3)
    scene = dataclasses.replace(toy.SCENE, bodies=(cup, JAR))
    poses = ((0.5, 0.0, 1.0, *toy.UPRIGHT), (0.9, 0.0, 1.0, *toy.UPRIGHT))
    across = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
    arm = Arm(scene, toy.at_rest(object_pose=poses, eef_pose=(0.3, 0.0, 1.2, *across)))
    fingers = around(arm, Thing(arm, "mug"), 50.0, handle=least).hand[:, 0]
    assert abs(fingers[1]) == pytest.approx(math.cos(math.radians(least)), abs=1e-6)


@pytest.mark.parametrize("side", [-1.0, 1.0], ids=["to the right", "to the left"])
def test_a_finger_beside_a_cups_handle_is_not_between_it_and_the_palm(side):
    cup = Body("mug", (0.035, 0.055, 0.045), (0.0, 0.02 * side, 0.0), NONE, 0.3)
    scene = dataclasses.replace(toy.SCENE, bodies=(cup, JAR))
    poses = ((0.5, 0.0, 1.0, *toy.UPRIGHT), (0.9, 0.0, 1.0, *toy.UPRIGHT))
    across = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
    arm = Arm(scene, toy.at_rest(object_pose=poses, eef_pose=(0.3, 0.0, 1.2, *across)))
    approach = around(arm, Thing(arm, "mug"), 50.0, handle=45.0).hand[:, 2]
    assert approach[1] * side == pytest.approx(math.sin(math.radians(50.0)) * math.sqrt(0.5))
