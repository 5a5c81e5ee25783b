"""Fingers in a glass and in a bowl: how deep they go, and beside what they have room."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.expert.places.bowl import ways
from pytest_safemanip.expert.places.glass import (
    FINGER_FLARE,
    FINGERTIP_THICK,
    HAND_OFF_RIM,
    depth,
    palm_is_free,
)
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import Body, Surface
from tests import toy

NONE = (0.0, 0.0, 0.0)
FACING_LEFT = (0.3, 0.0, 1.2, 0.5**0.5, 0.0, 0.0, 0.5**0.5)
"""The fingers travel sideways, the robot faces forward (x)."""
LOADED = 0.0145
"""From the grip point to fingers that are open around something 27 mm wide, m."""


def _arm(thing, vessel, beside=0.0, walls=()):
    """Something so far to the left of the middle of a vessel of these half sizes."""
    bodies = (Body("mug", thing, NONE, NONE, 0.1), Body("apple", vessel, NONE, NONE, 0.3))
    scene = dataclasses.replace(toy.SCENE, bodies=bodies, surfaces=walls)
    poses = ((0.6, beside, 0.93, *toy.UPRIGHT), (0.6, 0.0, 0.92 + vessel[2], *toy.UPRIGHT))
    arm = Arm(scene, toy.at_rest(object_pose=poses, eef_pose=FACING_LEFT))
    return arm, Thing(arm, "mug"), Thing(arm, "apple")


def _deep(radius, off):
    arm, _, glass = _arm((0.014,) * 3, (radius, radius, 0.041))
    return depth(glass, arm.hand(), LOADED, np.array((*off, 0.0)))


def test_fingers_go_deeper_into_a_wider_glass():
    wide, narrow = _deep(0.047, (0.0, 0.0)), _deep(0.044, (0.0, 0.0))
    assert 0.0 < narrow < wide
    # At the rim, the fingers are inside of the wall.
    assert LOADED + FINGERTIP_THICK + FINGER_FLARE * wide < 0.047 - 0.004


def test_off_the_middle_they_go_less_deep_and_least_along_their_travel():
    middle, ahead, aside = (_deep(0.047, off) for off in ((0, 0), (0.015, 0), (0, 0.015)))
    assert middle > ahead > 0.0
    assert aside == -HAND_OFF_RIM  # they stay above the rim


@pytest.mark.parametrize("beside", [0.0, 0.05])
def test_fingers_have_room_in_a_bowl_but_not_across_beside_its_wall(beside):
    arm, cube, bowl = _arm((0.013, 0.013, 0.013), (0.09, 0.09, 0.025), beside)
    rooms = {abs(round(float(g.hand[1, 0]))): room for room, g in ways(arm, cube, cube, bowl)}
    assert rooms[0] > 0.0  # the fingers travel ahead and back, along the wall
    assert (rooms[1] > 0.0) == (beside == 0.0)


def test_a_palm_has_no_room_across_beside_a_fridge_but_turned_it_has():
    fridge = Surface("cabinet", "", (0.4, 0.51, 0.9), (0.6, 0.6, 1.0, *toy.UPRIGHT))
    arm, _, glass = _arm((0.014,) * 3, (0.047, 0.047, 0.041), 0.0, (fridge,))
    rim = np.array((0.6, 0.0, 1.002))
    assert not palm_is_free(arm, rim, arm.hand(), glass)
    assert palm_is_free(arm, rim, arm.hand(0.0, 90.0), glass)
