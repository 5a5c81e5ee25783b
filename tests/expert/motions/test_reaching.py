from __future__ import annotations

from dataclasses import replace

import pytest

from pytest_safemanip.expert.motions.hand_ways import HandWays
from pytest_safemanip.expert.motions.poses import Pose, Ways
from pytest_safemanip.expert.motions.reaching import OTHERWISE, Reaching, turned_otherwise
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.choices import Choices
from pytest_safemanip.expert.robot.rotations import about_z
from pytest_safemanip.expert.world.room import Room
from tests import toy


@pytest.fixture
def arm():
    return Arm(toy.SCENE, toy.at_rest())


def found(arm, pose, either):
    room = Room.around(arm, [pose.point])
    return Reaching(arm, HandWays(arm, room, Ways()), either=either).find([pose])


def pose(arm, yaw):
    """The hand before the robot, straight down, turned about the vertical."""
    point = arm.position
    return Pose(point, about_z(yaw) @ arm.straight_down, 1.0, 0.0, point[None])


@pytest.mark.parametrize(("yaw", "turned"), [(0.0, True), (120.0, False)])
def test_a_hand_is_turned_over_where_its_last_joint_would_come_to_its_end(arm, yaw, turned):
    wanted = pose(arm, yaw)
    assert bool(found(arm, wanted, either=False)) == (not turned)
    ways = found(arm, wanted, either=True)
    assert {way.pose.turned for way in ways} == {turned}
    sign = -1.0 if turned else 1.0
    assert ways[0].pose.hand == pytest.approx(wanted.hand * (sign, sign, 1.0))


def test_the_base_is_turned_otherwise_only_where_that_is_chosen(arm):
    (way,) = found(arm, pose(arm, 120.0), either=True)

    def find(but):
        return [replace(way, turn=turn) for turn in (0.0, 90.0) if turn not in but]

    assert [way.turn for way in turned_otherwise(arm, find)] == [0.0, 90.0]
    arm.choices = Choices({OTHERWISE: 1})
    assert [way.turn for way in turned_otherwise(arm, find)] == [90.0]
    assert turned_otherwise(arm, lambda but: []) == []
