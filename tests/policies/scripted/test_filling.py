"""Two things in one bowl, and the fingers that take them there."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_safemanip.policies.scripted.arm import Arm
from pytest_safemanip.policies.scripted.filling import ENDS, ROOM, inwards, leaning, off_middle
from pytest_safemanip.policies.scripted.grasping import across
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.trace.elements import Body
from tests import toy

NONE = (0.0, 0.0, 0.0)
RADIUS = 0.075
FACING_LEFT = (0.3, 0.0, 1.2, math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
"""The fingers travel sideways, the robot faces forward (x)."""


@pytest.mark.parametrize(("width", "length"), [(0.05, 0.054), (0.055, 0.11), (0.062, 0.07)])
def test_what_fits_beside_the_middle_keeps_off_the_wall_with_side_and_ends(width, length):
    side = off_middle(RADIUS, width, length, ENDS) + width / 2.0
    assert side <= RADIUS - ROOM
    assert math.hypot(side, length / 2.0) <= RADIUS - ENDS + 1e-9


def test_what_is_round_has_no_ends():
    assert off_middle(RADIUS, 0.068, 0.068, ENDS) == pytest.approx(RADIUS - ROOM - 0.034)


def test_what_leaves_no_room_beside_it_goes_to_the_middle():
    assert off_middle(RADIUS, 0.06, 0.14) == 0.0


@pytest.mark.parametrize(("width", "length"), [(0.04, 0.151), (0.048, 0.152)])
def test_what_is_too_long_has_one_end_inside_and_its_middle_too(width, length):
    off, along = leaning(RADIUS, width, length)
    wall = math.sqrt(RADIUS**2 - (off + width / 2.0) ** 2)
    assert length / 2.0 - along == pytest.approx(wall - ROOM)
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
