from __future__ import annotations

import dataclasses
import math

import pytest

from pytest_safemanip.policies.scripted.arm import Arm
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.policies.scripted.twisting import (
    BAR,
    FINGER,
    PITCH,
    before_end,
    push_grasp,
    to_finger,
)
from pytest_safemanip.trace.elements import Body
from tests import toy

NONE = (0.0, 0.0, 0.0)
FACING_Y = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))


def _cup(out):
    """A cup in a cabinet before a robot that faces +y; its handle points past the middle."""
    half = (0.055, 0.035, 0.045) if out[0] else (0.035, 0.055, 0.045)
    cup = Body("mug", half, (0.02 * out[0], 0.02 * out[1], 0.0), NONE, 0.3)
    scene = dataclasses.replace(toy.SCENE, bodies=(cup, toy.SCENE.bodies[1]))
    poses = ((-0.12 * out[0], 0.5, 1.4, *toy.UPRIGHT), (0.9, 0.0, 1.0, *toy.UPRIGHT))
    arm = Arm(scene, toy.at_rest(object_pose=poses, base_pose=(0.0, -1.0, 0.0, *FACING_Y)))
    return arm, Thing(arm, "mug")


@pytest.mark.parametrize("side", [-1.0, 1.0], ids=["to the left", "to the right"])
def test_a_handle_is_pushed_near_its_end_from_the_robots_side(side):
    arm, cup = _cup((side, 0.0))
    assert before_end(arm, cup, 0.03) == pytest.approx((side * (-0.045 - BAR), 0.47, 1.4), abs=1e-6)


@pytest.mark.parametrize(
    ("out", "pushed"),
    [((1.0, 0.0), True), ((-1.0, 0.0), True), ((0.0, -1.0), False), ((0.0, 1.0), False)],
    ids=["to the right", "to the left", "to the robot", "away from it"],
)
def test_only_a_handle_that_points_aside_is_pushed(out, pushed):
    arm, cup = _cup(out)
    assert bool(push_grasp(arm, Furniture(arm, "cab"), cup)) == pushed


@pytest.mark.parametrize("yaw", [-60.0, 60.0])
def test_the_farther_finger_of_an_open_hand_pushes(yaw):
    arm, _ = _cup((1.0, 0.0))
    assert arm.ahead(to_finger(arm, arm.hand(PITCH, yaw=yaw))) > 0.7 * FINGER
