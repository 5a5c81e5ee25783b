from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.expert.places.fridge.compartment import Compartment, off_box, off_rod
from pytest_safemanip.expert.places.fridge.hand_turns import turns
from pytest_safemanip.expert.places.fridge.shelf_grasps import best_shelf_grasp
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import Body
from tests import toy

NONE = (0.0, 0.0, 0.0)
STEAK = Body("mug", (0.03, 0.055, 0.014), NONE, NONE, 0.2)
BALL = Body("apple", (0.033, 0.033, 0.033), NONE, NONE, 0.15)
SHELF = 1.08
SPACE = Compartment(front=0.85, left=0.24, right=-0.22, floor=SHELF, ceiling=1.44, door=-0.24)


def arm_at(beside: float = 0.0) -> Arm:
    """Before a shelf with a steak across the way in, and a ball so far to the left of it."""
    poses = (
        (1.0, 0.0, SHELF + 0.014, *toy.UPRIGHT),
        (1.0, beside, SHELF + 0.033, *toy.UPRIGHT),
    )
    scene = dataclasses.replace(toy.SCENE, bodies=(STEAK, BALL))
    return Arm(scene, toy.at_rest(object_pose=poses))


def test_a_point_in_a_box_is_as_deep_as_its_nearest_side():
    box = np.array((-1.0, -1.0, -1.0)), np.array((1.0, 1.0, 1.0))
    assert off_box(np.array([[1.3, 0.0, 0.0], [5.0, 5.0, 5.0]]), *box) == pytest.approx(0.3)
    assert off_box(np.array([[0.98, 0.0, 0.0]]), *box) == pytest.approx(-0.02)


def test_a_rod_ends_where_it_ends():
    rod = np.zeros(3), np.array((1.0, 0.0, 0.0))
    assert off_rod(np.array([[0.5, 0.2, 0.0]]), *rod, 0.05) == pytest.approx(0.15)
    assert off_rod(np.array([[1.3, 0.4, 0.0]]), *rod, 0.05) == pytest.approx(0.45)


def test_a_hand_grips_what_is_long_across_and_what_is_round_at_any_bearing():
    arm = arm_at(0.2)
    bearings = [
        {(turn.yaw, turn.roll) for turn in turns(arm, Thing(arm, name)) if turn.rolled}
        for name in ("mug", "apple")
    ]
    assert [len(found) for found in bearings] == [1, 6]


def test_there_is_room_between_shelves_that_are_far_apart():
    arm = arm_at(0.2)
    reach = best_shelf_grasp(arm, Thing(arm, "mug"), SPACE, (0.0,))
    assert reach is not None
    assert reach.grasp.point[:2] == pytest.approx((1.0, 0.0), abs=0.005)
    low = dataclasses.replace(SPACE, ceiling=SHELF + 0.27)
    assert best_shelf_grasp(arm, Thing(arm, "mug"), low, (0.0,)) is None


def test_a_thing_is_gripped_beside_its_middle_where_something_stands_close():
    arm = arm_at(0.06)
    reach = best_shelf_grasp(arm, Thing(arm, "mug"), SPACE, (0.0,))
    assert reach is not None
    assert -0.03 < reach.grasp.point[1] < -0.005


def test_there_is_no_room_for_fingers_where_something_higher_stands_closer():
    near = arm_at(0.03)
    assert best_shelf_grasp(near, Thing(near, "mug"), SPACE, (0.0,)) is None
