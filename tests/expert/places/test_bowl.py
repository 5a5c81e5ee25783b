from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_safemanip.expert.motions.grasping import across
from pytest_safemanip.expert.places.bowl import (
    ENDS,
    WALL_ROOM,
    best_bowl_grasp,
    inwards,
    leaning,
    off_middle,
)
from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.robot.hand import PALM
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import Body, Entity
from tests import toy

NONE = (0.0, 0.0, 0.0)
RADIUS = 0.075
FACING_LEFT = (0.3, 0.0, 1.2, math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
"""The fingers travel sideways, the robot faces forward (x)."""


@pytest.mark.parametrize(("width", "length"), [(0.05, 0.054), (0.055, 0.11), (0.062, 0.07)])
def test_what_fits_beside_the_middle_keeps_off_the_wall_with_side_and_ends(width, length):
    side = off_middle(RADIUS, width, length, ENDS) + width / 2.0
    assert side <= RADIUS - WALL_ROOM
    assert math.hypot(side, length / 2.0) <= RADIUS - ENDS + 1e-9


def test_what_is_round_has_no_ends():
    assert off_middle(RADIUS, 0.068, 0.068, ENDS) == pytest.approx(RADIUS - WALL_ROOM - 0.034)


def test_what_leaves_no_room_beside_it_goes_to_the_middle():
    assert off_middle(RADIUS, 0.06, 0.14) == 0.0


@pytest.mark.parametrize(("width", "length"), [(0.04, 0.151), (0.048, 0.152)])
def test_what_is_too_long_has_one_end_inside_and_its_middle_too(width, length):
    off, along = leaning(RADIUS, width, length)
    wall = math.sqrt(RADIUS**2 - (off + width / 2.0) ** 2)
    assert length / 2.0 - along == pytest.approx(wall - WALL_ROOM)
    assert 0.0 < along < wall / 2.0


@pytest.mark.parametrize(("long", "level"), [(0.033, True), (0.035, False)])
def test_the_longer_side_is_held_for_level_fingers_if_it_is_hardly_longer(long, level):
    body = Body("mug", (0.031, long, 0.036), NONE, NONE, 0.1)
    scene = dataclasses.replace(toy.SCENE, bodies=(body, toy.SCENE.bodies[1]))
    poses = ((0.9, 0.0, 0.936, *toy.UPRIGHT), (2.0, 0.0, 1.0, *toy.UPRIGHT))
    arm = Arm(scene, toy.at_rest(object_pose=poses, eef_pose=FACING_LEFT))
    fingers = across(arm, Thing(arm, "obj"), 35.0).hand[:, 0]
    assert (abs(fingers[2]) < 0.01) == level


@pytest.mark.parametrize(("away", "kept"), [(0.053, 0.0349), (0.020, 0.020), (0.0, 0.0)])
def test_fingers_that_go_down_into_a_bowl_keep_off_its_wall(away, kept):
    bodies = (
        Body("mug", (0.014, 0.03, 0.0125), NONE, NONE, 0.015),
        Body("apple", (0.0825, 0.0965, 0.0325), NONE, NONE, 0.3),
    )
    scene = dataclasses.replace(toy.SCENE, bodies=bodies)
    arm = Arm(scene, toy.at_rest(eef_pose=FACING_LEFT))
    thing, vessel = Thing(arm, "mug"), Thing(arm, "apple")
    spot = inwards(thing, vessel.middle + np.array((away, 0.0, 0.0)), vessel)
    assert spot - vessel.middle == pytest.approx((kept, 0.0, 0.0), abs=2e-3)


SAUSAGE, BUN, BOWL = (0.052, 0.015, 0.015), (0.057, 0.022, 0.021), (0.124, 0.124, 0.0325)
FLOOR, BOTTOM = 0.936, 0.92
SLOPING = (math.cos(math.radians(10.0)), 0.0, -math.sin(math.radians(10.0)), 0.0)


def _bowl(sausage, bun, turn=toy.UPRIGHT):
    """An arm before a bowl with a sausage and a bun, both along x, at so much from its middle."""
    bodies = [Body(*each, NONE, NONE, 0.1) for each in (("mug", SAUSAGE), ("apple", BUN))]
    scene = dataclasses.replace(
        toy.SCENE,
        entities=(*toy.SCENE.entities, Entity("bowl", "object", "bowl")),
        bodies=(*bodies, Body("bowl", BOWL, NONE, NONE, 0.3)),
        roles={**toy.SCENE.roles, "sausage": "mug", "bun": "apple", "bowl": "bowl"},
    )
    poses = (
        (0.6 + sausage[0], sausage[1], FLOOR + SAUSAGE[2], *toy.UPRIGHT),
        (0.6 + bun[0], bun[1], FLOOR + BUN[2] + (bun[2] if len(bun) > 2 else 0.0), *turn),
        (0.6, 0.0, BOTTOM + BOWL[2], *toy.UPRIGHT),
    )
    step = toy.at_rest(object_pose=poses, object_twist=np.zeros((3, 6)), eef_pose=FACING_LEFT)
    arm = Arm(scene, step)
    return arm, Thing(arm, "bowl")


def test_with_room_on_both_sides_it_is_pinched_at_its_middle_the_palm_over_the_rim():
    arm, bowl = _bowl((0.0, 0.0), (0.0, 0.08))
    way = best_bowl_grasp(arm, bowl, ["sausage"])
    np.testing.assert_allclose(way.grasp.point[:2], (0.6, 0.0), atol=1e-6)
    assert abs(way.grasp.hand[1, 0]) == pytest.approx(1.0)
    assert way.grasp.point[2] + PALM > bowl.highest


def test_beside_half_of_another_it_is_pinched_at_its_other_half():
    arm, bowl = _bowl((0.0, 0.0), (0.06, 0.040))
    way = best_bowl_grasp(arm, bowl, ["sausage"])
    assert way.grasp.point[0] < 0.59
    assert way.room > 0.0


def test_close_to_the_wall_there_is_no_room():
    arm, bowl = _bowl((0.0, 0.095), (0.0, -0.05))
    assert best_bowl_grasp(arm, bowl, ["sausage"]).room < 0.0
    assert best_bowl_grasp(arm, bowl, ["sausage", "bun"]).role == "bun"


def test_what_lies_on_another_comes_first():
    arm, bowl = _bowl((0.0, 0.0), (0.03, 0.02, 0.02), SLOPING)
    assert best_bowl_grasp(arm, bowl, ["sausage", "bun"]).role == "bun"


def test_what_there_is_no_way_to_is_left():
    arm, bowl = _bowl((0.0, 0.0), (0.0, 0.08))
    assert best_bowl_grasp(arm, bowl, ["sausage", "bun"], {"sausage"}).role == "bun"
    with pytest.raises(SkillFailed, match="no room"):
        best_bowl_grasp(arm, bowl, ["sausage"], {"sausage"})
