from __future__ import annotations

import dataclasses
import math

import mujoco
import numpy as np
import pytest

from pytest_safemanip.expert.motions.cup_grasps import around, yaws_around
from pytest_safemanip.expert.places.cabinet.doorway import (
    ASIDE,
    lean,
    off_door,
    room_beside,
    room_between,
    turned,
)
from pytest_safemanip.expert.places.tray import BOARD_END, free_end
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.hand import Grasp, reach_at
from pytest_safemanip.expert.world.standing import (
    ELBOW_LEAN,
    STRAIGHT_PITCH,
    WRIST_BEND,
    duck,
    elbow_room,
    offsets_bent,
    wrist_room,
)
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.trace.elements import Body, Surface
from tests import toy

NONE = (0.0, 0.0, 0.0)
BOARD = Body("mug", (0.15, 0.1, 0.01), NONE, NONE, 0.5)
JAR = Body("apple", (0.03, 0.03, 0.05), NONE, NONE, 0.3)
WITH_BOARD = dataclasses.replace(toy.SCENE, bodies=(BOARD, JAR))
FACING_Y = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
NEAR, FAR = 0.5 - BOARD_END * 0.3, 0.5 + BOARD_END * 0.3


@pytest.mark.parametrize(
    ("jar", "ahead"),
    [
        ((0.55, 0.0, 1.60), FAR),
        ((0.95, 0.0, 1.00), FAR),
        ((FAR, 0.0, 1.00), NEAR),
        ((NEAR, 0.0, 1.00), FAR),
    ],
    ids=["on a shelf above", "behind the board", "on the far end", "on the near end"],
)
def test_the_first_of_two_goes_to_the_far_end_and_the_second_to_the_other(jar, ahead):
    poses = ((0.5, 0.0, 0.94, *toy.UPRIGHT), (*jar, *toy.UPRIGHT))
    arm = Arm(WITH_BOARD, toy.at_rest(object_pose=poses))
    spot = free_end(arm, Thing(arm, "mug"), Thing(arm, "apple"))
    assert spot[:2] == pytest.approx((ahead, 0.0))


@pytest.mark.parametrize("least", [90.0, 45.0])
def test_the_fingers_stay_off_a_cups_handle(least):
    # Its box reaches 4 cm out to the robot's left, along the line on which the fingers travel.
    cup = Body("mug", (0.035, 0.055, 0.045), (0.0, 0.02, 0.0), NONE, 0.3)
    scene = dataclasses.replace(toy.SCENE, bodies=(cup, JAR))
    poses = ((0.5, 0.0, 1.0, *toy.UPRIGHT), (0.9, 0.0, 1.0, *toy.UPRIGHT))
    arm = Arm(scene, toy.at_rest(object_pose=poses, eef_pose=(0.3, 0.0, 1.2, *FACING_Y)))
    fingers = around(arm, Thing(arm, "mug"), 50.0, handle=least).hand[:, 0]
    assert abs(fingers[1]) == pytest.approx(math.cos(math.radians(least)), abs=1e-6)


@pytest.mark.parametrize("side", [-1.0, 1.0], ids=["to the right", "to the left"])
def test_a_finger_beside_a_cups_handle_is_not_between_it_and_the_palm(side):
    cup = Body("mug", (0.035, 0.055, 0.045), (0.0, 0.02 * side, 0.0), NONE, 0.3)
    scene = dataclasses.replace(toy.SCENE, bodies=(cup, JAR))
    poses = ((0.5, 0.0, 1.0, *toy.UPRIGHT), (0.9, 0.0, 1.0, *toy.UPRIGHT))
    across = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
    arm = Arm(scene, toy.at_rest(object_pose=poses, eef_pose=(0.3, 0.0, 1.2, *across)))
    approach = around(arm, Thing(arm, "mug"), 50.0, handle=45.0).hand[:, 2]
    assert approach[1] * side == pytest.approx(math.sin(math.radians(50.0)) * math.sqrt(0.5))


def test_a_cup_awry_can_be_gripped_with_the_wrist_on_either_side():
    # Its handle reaches out to the robot's right, and a little away from it.
    awry = math.radians(-10.0)
    cup = Body("mug", (0.055, 0.035, 0.045), (0.02, 0.0, 0.0), NONE, 0.3)
    scene = dataclasses.replace(toy.SCENE, bodies=(cup, JAR))
    turned_by = (math.cos(awry / 2.0), 0.0, 0.0, math.sin(awry / 2.0))
    poses = ((0.5, 0.0, 1.0, *turned_by), (0.9, 0.0, 1.0, *toy.UPRIGHT))
    arm = Arm(scene, toy.at_rest(object_pose=poses, eef_pose=(0.3, 0.0, 1.2, *FACING_Y)))
    yaws = yaws_around(arm, Thing(arm, "mug"), 45.0, 45.0)
    assert yaws == sorted(yaws, key=abs)
    assert min(yaws) < 0.0 < max(yaws)


@pytest.mark.parametrize(("aside", "room"), [(0.0, 0.20), (0.15, 0.05), (-0.25, -0.05)])
def test_a_hand_is_ten_centimetres_wide_to_either_side(aside, room):
    arm = Arm(toy.SCENE, toy.at_rest(base_pose=(0.0, -1.0, 0.0, *FACING_Y)))
    grasp = Grasp(arm.point(0.5, aside, 1.5), arm.hand(50.0), 1.0)
    assert room_beside(arm, Furniture(arm, "cab"), grasp) == pytest.approx(room, abs=1e-6)


@pytest.mark.parametrize(("aside", "left"), [(0.0, 0.0), (0.05, -0.05), (-0.05, 0.05), (0.2, -0.1)])
def test_the_base_stands_away_from_the_nearer_door(aside, left):
    arm = Arm(toy.SCENE, toy.at_rest(base_pose=(0.0, -1.0, 0.0, *FACING_Y)))
    assert lean(arm, Furniture(arm, "cab"), aside) == pytest.approx(left, abs=1e-6)


@pytest.mark.parametrize(
    ("wrist", "left"), [(0.05, 0.0), (0.12, -0.02), (-0.12, 0.02), (0.3, -ASIDE)]
)
def test_the_wrist_passes_off_the_nearer_door(wrist, left):
    arm = Arm(toy.SCENE, toy.at_rest(base_pose=(0.0, -1.0, 0.0, *FACING_Y)))
    assert off_door(arm, Furniture(arm, "cab"), wrist) == pytest.approx(left, abs=1e-6)


@pytest.mark.parametrize(
    ("neighbour", "free"),
    [((0.70, 0.0), True), ((0.62, -0.02), False), ((0.5, 0.12), True)],
    ids=["aside", "under the palm", "beyond"],
)
def test_there_is_no_room_where_the_palm_would_meet_what_stands_beside(neighbour, free):
    poses = ((0.5, 0.0, 1.0, *toy.UPRIGHT), (*neighbour, 1.03, *toy.UPRIGHT))
    arm = Arm(toy.SCENE, toy.at_rest(object_pose=poses, base_pose=(0.5, -1.0, 0.0, *FACING_Y)))
    thing = Thing(arm, "mug")
    grasp = Grasp(thing.centre, arm.hand(50.0), 1.0)
    assert (room_between(arm, thing, grasp) > 0.0) == free


@pytest.mark.parametrize("yaw", [0.0, 30.0, -75.0])
def test_a_hand_is_turned_by_its_yaw(yaw):
    arm = Arm(toy.SCENE, toy.at_rest(base_pose=(0.0, -1.0, 0.0, *FACING_Y)))
    assert turned(arm, arm.hand(50.0, yaw=yaw)) == pytest.approx(abs(yaw))


def _machine(aside, height=0.2):
    pose = (0.5, aside, 0.9 + height, *toy.UPRIGHT)
    return Surface("cabinet", "", (0.1, 0.1, height), pose)


@pytest.mark.parametrize(
    ("machines", "shift"),
    [
        ([], 0.0),
        ([_machine(0.25)], -ELBOW_LEAN),
        ([_machine(-0.25)], ELBOW_LEAN),
        ([_machine(0.25), _machine(-0.25)], 0.0),
        ([_machine(0.50)], 0.0),
        ([_machine(0.25, height=0.05)], 0.0),
        ([_machine(0.05)], 0.0),
    ],
    ids=["nothing", "on the left", "on the right", "on both sides", "far off", "low", "over it"],
)
def test_the_base_stands_away_from_a_tall_machine_beside_the_spot(machines, shift):
    scene = dataclasses.replace(toy.SCENE, surfaces=(*toy.SCENE.surfaces, *machines))
    assert elbow_room(Arm(scene, toy.at_rest()), (0.6, 0.0, 0.93)) == pytest.approx(shift)


@pytest.mark.parametrize(
    ("aside", "openness", "ducks"),
    [(0.0, 1.0, True), (-0.5, 1.0, False), (0.0, 0.0, False)],
    ids=["an open door on the way", "an open door beyond", "a shut door"],
)
def test_the_hand_ducks_before_an_open_door_on_the_way(aside, openness, ducks):
    # A door whose hinge is at its middle: opened, it spans the way from 0.3 to 0.9 m either way.
    door = Surface("cabinet", "cabinet/hinge", (0.3, 0.3, 0.3), (0.6, 0.2, 1.7, *toy.UPRIGHT))
    hinge = dataclasses.replace(toy.SCENE.joints[0], anchor=(0.6, 0.2, 1.7))
    scene = dataclasses.replace(toy.SCENE, surfaces=(door,), joints=(hinge,))
    arm = Arm(scene, toy.at_rest(joint=((openness, 0.0),)))
    action = next(duck(arm, aside), None)
    assert (action is not None and action[7] < 0.0) == ducks


@pytest.mark.parametrize(
    ("pitch", "yaw", "shift"),
    [(35.0, 0.0, 0.0), (50.0, 0.0, 0.0), (50.0, 4.0, -0.1), (50.0, 14.0, 0.0), (50.0, -35.0, 0.0)],
    ids=["steep", "straight ahead", "a machine beside", "to the left", "far to the right"],
)
def test_a_level_hand_and_the_forearm_do_not_come_into_line_over_a_counter(pitch, yaw, shift):
    start = Arm(toy.SCENE, toy.at_rest())
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, start.hand(pitch, yaw=yaw).ravel())
    arm = Arm(toy.SCENE, toy.at_rest(eef_pose=(*start.position, *quaternion)))
    found = wrist_room(arm, shift)
    between = abs(yaw - math.degrees(math.atan2(-found, reach_at(arm.pitch))))
    if pitch < STRAIGHT_PITCH:
        assert found == 0.0
    else:
        assert between == pytest.approx(max(WRIST_BEND, abs(yaw)))
    assert found * shift >= 0.0


@pytest.mark.parametrize(("pitch", "sides"), [(30.0, {-1.0, 0.0, 1.0}), (60.0, {0.0, 1.0})])
def test_the_base_does_not_come_closer_where_a_level_hand_would_be_in_line(pitch, sides):
    start = Arm(toy.SCENE, toy.at_rest())
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, start.hand(pitch).ravel())
    arm = Arm(toy.SCENE, toy.at_rest(eef_pose=(*start.position, *quaternion)))
    assert {float(np.sign(off)) for off in offsets_bent(arm, 0.2)} == sides
