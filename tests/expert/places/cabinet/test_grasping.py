from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_safemanip.expert.places.cabinet.grasping import (
    ASKEW,
    BAR,
    END_MOST_YAW,
    OUTER_FINGER,
    PUSH_PITCH,
    before_end,
    end_grasp,
    from_an_end,
    push_grasp,
    to_finger,
)
from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.robot.hand import PALM
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.trace.elements import Body, Box
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
    assert arm.ahead(to_finger(arm, arm.hand(PUSH_PITCH, yaw=yaw))) > 0.7 * OUTER_FINGER


LOAF = (0.055, 0.031, 0.0275)
FACING_LEFT = (0.3, 0.0, 1.2, math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
"""The fingers travel sideways, the robot faces forward (x)."""


def _on_shelf(bearing, beside=0.0, deep=0.2, half=LOAF):
    """A loaf on a shelf of 90 cm by 34 cm, at an angle to the robot's forward direction."""
    angle = math.radians(bearing) / 2.0
    pose = (0.63 + deep, beside, 1.48 + half[2], math.cos(angle), 0.0, 0.0, math.sin(angle))
    turned = (0.8, 0.0, 1.65, math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
    scene = dataclasses.replace(
        toy.SCENE,
        bodies=(Body("mug", half, NONE, NONE, 0.1), toy.SCENE.bodies[1]),
        boxes=(Box("cabinet", "shelf", "interior", (0.45, 0.17, 0.17)),),
    )
    step = toy.at_rest(
        object_pose=(pose, (3.0, 0.0, 1.0, *toy.UPRIGHT)),
        box_pose=(turned,),
        eef_pose=FACING_LEFT,
    )
    arm = Arm(scene, step)
    return arm, Thing(arm, "obj"), Furniture(arm, "cab")


@pytest.mark.parametrize("bearing", [50.0, 90.0, -85.0])
def test_the_fingers_are_level_and_close_across_it_off_the_palm(bearing):
    arm, loaf, cabinet = _on_shelf(bearing)
    grasp = from_an_end(arm, loaf, cabinet)
    assert abs(grasp.hand[2, 0]) < 1e-6
    assert abs(arm.bearing(grasp.hand[:, 2])) <= END_MOST_YAW + 1e-6
    across = loaf.sides()[0][0]
    assert abs(grasp.hand[:, 0] @ across) > math.cos(math.radians(90.0 - END_MOST_YAW + 1.0))
    assert ((loaf.corners - grasp.point) @ grasp.hand[:, 2]).min() > -PALM
    assert loaf.bottom + 0.02 < grasp.point[2] < loaf.highest


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_beside_a_wall_the_hand_comes_from_the_other_side(side):
    arm, loaf, cabinet = _on_shelf(90.0, beside=side * 0.25)
    approach = from_an_end(arm, loaf, cabinet).hand[:, 2]
    assert np.sign(arm.aside(approach)) == side


def test_where_there_is_just_no_room_the_hand_is_a_little_askew():
    arm, loaf, cabinet = _on_shelf(62.0, beside=-0.13)
    straight = end_grasp(arm, loaf, loaf.sides()[1][0], 0.0)
    chosen = from_an_end(arm, loaf, cabinet)
    less = arm.bearing(straight.hand[:, 2]) - arm.bearing(chosen.hand[:, 2])
    assert 0.0 < less <= ASKEW[-1] + 1e-6


@pytest.mark.parametrize(
    "where", [{"bearing": 85.0, "deep": 0.27}, {"bearing": 60.0, "beside": -0.30}], ids=str
)
def test_where_a_palm_or_a_wrist_has_no_room_it_is_left(where):
    with pytest.raises(SkillFailed, match="no room"):
        from_an_end(*_on_shelf(**where))


def test_what_is_too_wide_is_left():
    with pytest.raises(SkillFailed, match="no room"):
        from_an_end(*_on_shelf(70.0, half=(0.055, 0.04, 0.0275)))
