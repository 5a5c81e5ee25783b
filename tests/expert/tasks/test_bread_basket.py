"""A basket: what is let into it, and where it goes on a table."""

from __future__ import annotations

import dataclasses
import math

import pytest

from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.tasks.bread_basket import (
    APART_ON_TABLE,
    PALM_BEHIND,
    between_walls,
    free_edge,
)
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.trace.elements import Body
from tests import toy

NONE = (0.0, 0.0, 0.0)
TOP = 0.9
"""Height of the toy's counter, which reaches from -1 to 1 m ahead and 0.5 m to either side."""
FACING_X = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
BASKET = Body("mug", (0.14, 0.124, 0.055), (0.0, 0.014, 0.0), NONE, 0.3)
"""Its lug, at one of its long sides, is within its box."""


def _table(other, half=0.05):
    """A basket in the hand in front of the counter, its lug to the robot, and what stands there."""
    bodies = (BASKET, Body("apple", (half, half, 0.05), NONE, NONE, 0.1))
    step = toy.at_rest(
        object_pose=((-1.3, 0.1, 1.15, *FACING_X), (*other, TOP + 0.05, *toy.UPRIGHT)),
        base_pose=(-1.8, 0.1, 0.0, *toy.UPRIGHT),
    )
    arm = Arm(dataclasses.replace(toy.SCENE, bodies=bodies), step)
    return arm, Thing(arm, "obj"), Furniture(arm, "counter")


@pytest.mark.parametrize("other", [(0.5, 0.1), (-0.8, 0.35)], ids=["far behind", "beside"])
def test_where_nothing_stands_a_basket_goes_straight_ahead_onto_the_edge(other):
    spot = free_edge(*_table(other))
    assert spot[2] == pytest.approx(TOP)
    assert -1.0 + 0.124 < spot[0] < -0.8
    assert spot[1] == pytest.approx(0.1, abs=0.02)


def test_beside_what_stands_there_it_keeps_off_it():
    spot = free_edge(*_table((-0.8, 0.1)))
    assert abs(spot[1] - 0.1) >= 0.05 + 0.14 + APART_ON_TABLE


def test_on_a_full_table_it_is_not_put():
    with pytest.raises(SkillFailed, match="no room"):
        free_edge(*_table((-0.8, 0.0), half=0.4))


def test_bread_and_palm_have_as_much_room_between_the_walls():
    bodies = (
        Body("mug", (0.031, 0.055, 0.0275), NONE, NONE, 0.1),
        Body("apple", (0.11, 0.14, 0.055), NONE, NONE, 0.3),
    )
    bread, basket = (0.34, 0.02, 1.2, *FACING_X), (0.6, 0.0, 0.955, *toy.UPRIGHT)
    scene = dataclasses.replace(toy.SCENE, bodies=bodies)
    arm = Arm(
        scene, toy.at_rest(object_pose=(bread, basket), eef_pose=(0.3, 0.0, 1.21, 0, 1, 0, 0))
    )
    held = Thing(arm, "mug")
    there = between_walls(arm, held, Thing(arm, "apple"), 0.95)()
    way = there - arm.position
    assert held.bottom + way[2] == pytest.approx(0.95)
    assert there[1] == pytest.approx(0.0)
    far = held.corners[:, 0].max() + way[0]
    assert far - 0.6 == pytest.approx(0.6 - (there[0] - PALM_BEHIND), abs=1e-6)
