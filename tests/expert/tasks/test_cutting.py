from __future__ import annotations

import dataclasses
import math

import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.tasks.cutting import ON_BOARD, across_board, spot_before, tool_for
from pytest_safemanip.expert.world.hand_room import free_of_others
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import Body, Entity
from tests import toy


def arm_with(category="mug", pose=(0.5, 0.0, 1.0)):
    entities = [
        Entity(e.name, e.kind, category) if e.name == toy.SCENE.roles["obj"] else e
        for e in toy.SCENE.entities
    ]
    scene = dataclasses.replace(toy.SCENE, entities=tuple(entities))
    poses = ((*pose, *toy.UPRIGHT), (3.0, 3.0, 1.0, *toy.UPRIGHT))
    return Arm(scene, toy.at_rest(object_pose=poses))


@pytest.mark.parametrize(("food", "tool"), [("carrot", "peeler"), ("garlic", "knife")])
def test_what_has_a_skin_is_peeled_and_the_rest_is_cut(food, tool):
    assert tool_for(arm_with(food), "peeler", "knife", "obj") == tool


@pytest.mark.parametrize(
    ("before", "short"),
    [(0.2, 0.0), (-0.2, ON_BOARD)],
    ids=["food lies behind the middle", "food lies before it"],
)
def test_a_tool_goes_on_this_side_of_the_food_and_stays_on_the_board(before, short):
    arm = arm_with(pose=(0.5 + before, 0.0, 1.0))
    middle = arm.point(0.5, 0.1, 0.95)
    spot = spot_before(arm, middle, Thing(arm, "obj"))
    assert arm.ahead(middle) - arm.ahead(spot) == pytest.approx(short)
    assert arm.aside(spot) == pytest.approx(arm.aside(middle))


LYING = Body("mug", (0.12, 0.015, 0.013), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.1)
NEIGHBOUR = Body("apple", (0.02, 0.08, 0.013), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.1)


def along_beside(ahead, aside):
    """How far from a lying thing's middle the fingers take it, with another one so far away."""
    scene = dataclasses.replace(toy.SCENE, bodies=(LYING, NEIGHBOUR))
    poses = ((0.5, 0.0, 1.0, *toy.UPRIGHT), (0.5 + ahead, aside, 1.0, *toy.UPRIGHT))
    arm = Arm(scene, toy.at_rest(object_pose=poses))
    return float(free_of_others(arm, Thing(arm, "mug"), 0.06)[0])


@pytest.mark.parametrize(
    ("neighbour", "along"),
    [((0.0, 0.20), 0.0), ((0.02, 0.10), -0.015), ((-0.02, 0.10), 0.015)],
    ids=["far off", "beside it, to the one side", "beside it, to the other"],
)
def test_fingers_keep_off_what_lies_beside(neighbour, along):
    assert along_beside(*neighbour) == pytest.approx(along)


def test_where_boxes_leave_no_room_the_middle_is_tried():
    board = Body("mug", (0.12, 0.1, 0.01), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.1)
    poses = ((0.65, 0.0, 1.0, *toy.UPRIGHT), (0.5, 0.0, 1.0, *toy.UPRIGHT))
    scene = dataclasses.replace(toy.SCENE, bodies=(board, NEIGHBOUR))
    arm = Arm(scene, toy.at_rest(object_pose=poses))
    assert not free_of_others(arm, Thing(arm, "apple"), 0.07).any()


@pytest.mark.parametrize(
    ("turned", "way"), [(0.0, 0.0), (40.0, 40.0), (180.0, 0.0), (-130.0, 50.0)]
)
def test_the_way_across_a_board_leads_away_from_the_robot(turned, way):
    board = Body("mug", (0.15, 0.1, 0.01), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.1)
    half = math.radians(turned + 90.0) / 2.0
    pose = (0.5, 0.0, 1.0, math.cos(half), 0.0, 0.0, math.sin(half))
    poses = (pose, (3.0, 0.0, 1.0, *toy.UPRIGHT))
    scene = dataclasses.replace(toy.SCENE, bodies=(board, NEIGHBOUR))
    arm = Arm(scene, toy.at_rest(object_pose=poses))
    beyond = across_board(arm, Thing(arm, "mug"))
    assert arm.ahead(beyond) > 0.7
    aside = abs(math.degrees(math.atan2(arm.aside(beyond), arm.ahead(beyond))))
    assert aside == pytest.approx(min(way, 90.0 - way), abs=0.01)
