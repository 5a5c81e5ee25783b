"""Room for the palm: between the walls of a basin, within the rim of a pan."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_safemanip.expert.motions.grasping import across
from pytest_safemanip.expert.places.basin import PALM_ROOM, palm_room, roomy
from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.robot.hand import Grasp, hand_corners
from pytest_safemanip.expert.world.hand_room import room_on_way
from pytest_safemanip.expert.world.rims import overhung, rim_shift
from pytest_safemanip.expert.world.standing import rearmost
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.trace.elements import Body, Box, Surface
from tests import toy

NONE = (0.0, 0.0, 0.0)
LEMON = (0.028, 0.036, 0.028)
SQUASH = (0.032, 0.072, 0.032)
LEFT = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
BOTTLE, WINE = (0.032, 0.032, 0.102), (0.033, 0.033, 0.132)
FACING_LEFT = (0.3, 0.0, 1.2, *LEFT)
"""The fingers travel sideways, the robot faces forward (x)."""


def _in_basin(half, behind):
    """An object in a basin of 40 by 64 by 20 cm: so far behind its middle."""
    fruit = Body("mug", half, NONE, NONE, 0.1)
    basin = (Box("cabinet", "basin", "interior", (0.2, 0.32, 0.1)),)
    scene = dataclasses.replace(toy.SCENE, bodies=(fruit, toy.SCENE.bodies[1]), boxes=basin)
    step = toy.at_rest(
        object_pose=((0.5 + behind, 0.0, 0.8 + half[2], *toy.UPRIGHT), (2, 0, 1, *toy.UPRIGHT)),
        box_pose=((0.5, 0.0, 0.9, *toy.UPRIGHT),),
        eef_pose=FACING_LEFT,
    )
    arm = Arm(scene, step)
    return arm, Thing(arm, "obj"), Furniture(arm, "cab")


def test_where_the_palm_has_room_the_narrow_side_is_held():
    arm, lemon, sink = _in_basin(LEMON, 0.0)
    chosen = roomy(arm, lemon, sink, 10.0)
    np.testing.assert_allclose(chosen.hand, across(arm, lemon, 10.0).hand)
    assert abs(chosen.hand[0, 0]) > 0.9


def test_before_the_wall_the_fingers_turn():
    arm, lemon, sink = _in_basin(LEMON, 0.13)
    assert palm_room(across(arm, lemon, 20.0), sink.interior()) < 0.0
    chosen = roomy(arm, lemon, sink, 20.0)
    assert palm_room(chosen, sink.interior()) >= PALM_ROOM
    assert abs(chosen.hand[0, 0]) < 0.9


def test_what_lies_along_the_wall_is_left_there():
    arm, squash, sink = _in_basin(SQUASH, 0.15)
    with pytest.raises(SkillFailed, match="no room"):
        roomy(arm, squash, sink, 20.0)


@pytest.mark.parametrize("pitch", [-4.0, -2.0])
def test_a_hand_that_leans_back_holds_a_thing_too(pitch):
    arm, lemon, _ = _in_basin(LEMON, -0.04)
    assert across(arm, lemon, pitch).hand[:, 2] @ (0.0, 0.0, -1.0) > 0.99


def test_a_turned_hand_comes_in_on_the_side_where_nothing_taller_stands():
    low, tall = Body("mug", BOTTLE, NONE, NONE, 0.1), Body("apple", WINE, NONE, NONE, 0.1)
    scene = dataclasses.replace(toy.SCENE, bodies=(low, tall))
    poses = ((0.6, 0.0, BOTTLE[2], *toy.UPRIGHT), (0.6, -0.09, WINE[2], *toy.UPRIGHT))
    arm = Arm(scene, toy.at_rest(object_pose=poses, eef_pose=FACING_LEFT))
    bottle = Thing(arm, "mug")
    neck = bottle.top - (0.0, 0.0, 0.025)

    def room(yaw):
        return room_on_way(arm, Grasp(neck, arm.hand(35.0, yaw=yaw), 1.0), bottle, 0.12)

    assert room(45.0) < -0.02
    assert room(-45.0) > 0.01


def _over_pan(pitch, radius=0.12, height=0.05, thick=0.05):
    """The shift and the palm's corners from the middle of the pan, where the thing stands."""
    bodies = (
        Body("mug", (thick / 2,) * 3, NONE, NONE, 0.1),
        Body("apple", (radius, radius, height / 2), NONE, NONE, 0.5),
    )
    scene = dataclasses.replace(toy.SCENE, bodies=bodies)
    held, pan = (0.3, 0.0, 1.2, *toy.UPRIGHT), (0.8, 0.0, 1.0, *toy.UPRIGHT)
    arm = Arm(scene, toy.at_rest(object_pose=(held, pan), eef_pose=FACING_LEFT))
    half = math.radians(180.0 - pitch) / 2.0
    tipped = (0.3, 0.0, 1.2, *_times(math.cos(half), math.sin(half)))
    arm.step = toy.at_rest(object_pose=(held, pan), eef_pose=tipped)
    shift = rim_shift(arm, Thing(arm, "mug"), Thing(arm, "apple"))
    palm = np.add(hand_corners(arm.rotation), (0.0, 0.0, thick / 2))
    return shift, palm[palm[:, 2] < height]


def _times(c, s):
    """The hand turned left, then tipped about its fingers' direction: a quaternion."""
    root = math.sqrt(0.5)
    return (root * c, root * s, root * s, root * c)


def test_a_tipped_hand_goes_down_off_the_middle_of_a_pan():
    shift, palm = _over_pan(35.0)
    assert shift[0] > 0.0
    assert shift[1:] == pytest.approx((0.0, 0.0), abs=1e-6)
    before, after = (np.linalg.norm((palm + k)[:, :2], axis=1).max() for k in (0.0 * shift, shift))
    assert after < before
    assert after < 0.12 - 0.006 - 0.008


@pytest.mark.parametrize(
    "changed",
    [{"pitch": 0.0}, {"radius": 0.08}, {"height": 0.022}, {"thick": 0.09}],
    ids=["upright", "a small bowl", "a plate", "a tall thing"],
)
def test_elsewhere_the_middle_is_the_place(changed):
    shift, _ = _over_pan(**{"pitch": 35.0, **changed})
    assert shift == pytest.approx((0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("front", "bottom", "over"),
    [(0.6, 1.33, True), (0.6, 1.50, False), (0.6, 0.96, False), (1.0, 1.33, False)],
    ids=["a microwave", "a hood, high up", "a pan beside it", "behind the spot"],
)
def test_what_hangs_over_a_spot(front, bottom, over):
    pose = (front + 0.2, 0.1, bottom + 0.17, *toy.UPRIGHT)
    hung = Surface("cabinet", "", (0.2, 0.3, 0.17), pose)
    scene = dataclasses.replace(toy.SCENE, surfaces=(hung,))
    arm = Arm(scene, toy.at_rest(eef_pose=FACING_LEFT))
    assert overhung(arm, np.array((0.8, 0.0, 0.95))) == over


@pytest.mark.parametrize(
    ("where", "back"),
    [((-1.0, 0.0), -0.23), ((-1.0, 0.7), -math.inf), ((1.0, 0.0), -math.inf)],
    ids=["an island behind it", "beside that", "a counter in front"],
)
def test_how_far_back_the_base_may_be(where, back):
    stands = Surface("counter", "", (0.2, 0.3, 0.45), (*where, 0.45, *toy.UPRIGHT))
    scene = dataclasses.replace(toy.SCENE, surfaces=(stands,))
    arm = Arm(scene, toy.at_rest(eef_pose=FACING_LEFT))
    assert rearmost(arm, -0.1, 0.1) == pytest.approx(back)
