from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_safemanip.expert.motions import operating
from pytest_safemanip.expert.places.cabinet.placing import BELONGS_WITHIN, FINGER_END, spot_on_shelf
from pytest_safemanip.expert.places.fridge.front import BEYOND_MIDDLE, deep_in
from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.robot.hand import TIPPED_FINGERTIP
from pytest_safemanip.expert.world.free_spots import OFF_MIDDLE, free_spot
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.trace.elements import Body, Box
from tests import toy

NONE = (0.0, 0.0, 0.0)
FACING_Y = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
FLOOR = 1.2
"""Height of the toy cabinet's floor, which begins at y = 0.4."""
BOTTLE = Body("mug", (0.03, 0.03, 0.08), NONE, NONE, 0.4)
ALIKE = dataclasses.replace(BOTTLE, entity="apple")


def shelf(half):
    """A held bottle, and another one on a shelf that is so wide to either side."""
    scene = dataclasses.replace(
        toy.SCENE,
        bodies=(BOTTLE, ALIKE),
        boxes=(Box("cabinet", "shelf", "interior", (half, 0.2, 0.3)),),
    )
    poses = ((0.0, 0.0, 1.5, *toy.UPRIGHT), (0.0, 0.48, FLOOR + 0.08, *toy.UPRIGHT))
    step = toy.at_rest(object_pose=poses, base_pose=(0.0, -1.0, 0.0, *FACING_Y))
    arm = Arm(scene, step)
    return arm, (Thing(arm, "mug"), Furniture(arm, "cab"), Thing(arm, "apple"))


def test_a_bottle_goes_close_to_its_counterpart_but_off_the_fingers():
    arm, things = shelf(0.4)
    spot = spot_on_shelf(arm, *things)
    y = 0.4 + spot.depth + 0.03
    assert math.hypot(spot.aside, y - 0.48) < BELONGS_WITHIN
    assert abs(spot.aside) >= FINGER_END + 0.03


def test_where_a_cabinet_is_too_narrow_there_is_no_room_beside():
    arm, things = shelf(0.2)
    with pytest.raises(SkillFailed, match="no room close to apple"):
        spot_on_shelf(arm, *things)


@pytest.mark.parametrize("radius", [0.010, 0.016, 0.030])
def test_the_fingers_close_beyond_the_middle_of_what_is_small_and_above_the_shelf(radius):
    ball = Body("mug", (radius,) * 3, NONE, NONE, 0.02)
    scene = dataclasses.replace(toy.SCENE, bodies=(ball, ALIKE))
    arm = Arm(scene, toy.at_rest())
    thing, hand = Thing(arm, "mug"), arm.hand(55.0)
    point = deep_in(thing, hand)
    assert (point - thing.centre) @ hand[:, 2] == pytest.approx(BEYOND_MIDDLE)
    assert point[2] >= thing.bottom + TIPPED_FINGERTIP - 1e-9


@pytest.mark.parametrize(
    ("place", "shift"), [((0.5, 0.0, 0.905), 0.0), ((0.5, 0.0, 0.96), OFF_MIDDLE[3])]
)
def test_the_plate_below_a_pancake_does_not_take_its_middle(place, shift):
    pancake = Body("mug", (0.06, 0.06, 0.007), NONE, NONE, 0.05)
    other = Body("apple", (0.1, 0.1, 0.01), NONE, NONE, 0.3)
    berry = Body("berry", (0.015,) * 3, NONE, NONE, 0.02)
    entity = dataclasses.replace(toy.SCENE.entities[-1], name="berry", category="strawberry")
    scene = dataclasses.replace(
        toy.SCENE, entities=(*toy.SCENE.entities, entity), bodies=(pancake, other, berry)
    )
    places = ((0.5, 0.0, 0.918), place, (0.0, 0.0, 1.5))
    poses = [(*each, *toy.UPRIGHT) for each in places]
    arm = Arm(scene, toy.at_rest(object_pose=poses, object_twist=np.zeros((3, 6))))
    target = Thing(arm, "mug")
    away = np.linalg.norm((free_spot(arm, "berry", target) - target.middle)[:2])
    assert away == pytest.approx(shift * 0.12)


@pytest.mark.parametrize(("aside", "opens"), [(0.1, True), (0.5, False)])
def test_only_the_door_before_an_object_is_opened(aside, opens, monkeypatch):
    moved = []
    monkeypatch.setattr(operating, "move_joint", lambda *args: moved.append(args[2].name) or ())
    poses = ((aside, 0.6, 1.5, *toy.UPRIGHT), (0.4, 0.0, 0.94, *toy.UPRIGHT))
    scene = dataclasses.replace(toy.SCENE, boxes=(Box("cabinet", "hinge", "handle", (0.01,) * 3),))
    step = toy.at_rest(object_pose=poses, base_pose=(0.0, -1.0, 0.0, *FACING_Y))
    assert not list(operating.open_before(Arm(scene, step), "cab", "mug"))
    assert moved == (["hinge"] if opens else [])
