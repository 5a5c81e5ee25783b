from __future__ import annotations

import dataclasses

import pytest

from pytest_safemanip.policies.scripted.arm import Arm
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.policies.scripted.tools import ON_BOARD, spot_before, tool_for
from pytest_safemanip.trace.elements import Entity
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
