from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
import pytest

from pytest_safemanip.expert.motions.holds import holds, motion
from pytest_safemanip.expert.robot.arm import Arm
from tests import toy

(DOOR,) = toy.SCENE.joints
LEVER = dataclasses.replace(DOOR, gives_access=False, half=(0.06, 0.012, 0.012))
ON_HINGE = (*DOOR.anchor, 1.0, 0.0, 0.0, 0.0)
KNOB = dataclasses.replace(LEVER, half=(0.03, 0.006, 0.02), pose=ON_HINGE)
SHORT = dataclasses.replace(KNOB, pose=(DOOR.anchor[0] + 0.03, *ON_HINGE[1:]))
"""Its farthest point is as far from its hinge as a knob's may be, but on one side."""
JOINTS = pytest.mark.parametrize("joint", [DOOR, LEVER], ids=["door", "lever"])
WAYS = pytest.mark.parametrize("goal", [1.0, 0.0], ids=["open", "close"])


@functools.cache
def found(joint, goal, wider):
    return holds(Arm(toy.SCENE, toy.at_rest()), joint, (), 0.5, goal, wider=wider)


def poses(found):
    return {(*hold.point.round(4), *hold.hand.ravel().round(3), hold.finger) for hold in found}


@JOINTS
@WAYS
@pytest.mark.parametrize("wider", [False, True], ids=["usual", "wider"])
def test_fingers_push_a_face_the_way_the_part_is_to_go(joint, goal, wider):
    pushed = [hold for hold in found(joint, goal, wider) if not hold.pinched]
    assert pushed
    for hold in pushed:
        moved, _ = motion(joint, hold.contact, math.copysign(1.0, goal - 0.5))
        assert hold.normal @ moved < -0.5


@JOINTS
@pytest.mark.parametrize("wider", [False, True], ids=["usual", "wider"])
def test_both_fingertips_push_where_the_base_stands_a_little_askew(joint, wider):
    turn = math.radians(3.0) / 2.0
    base = np.array(toy.at_rest().base_pose)
    base[3:] = math.cos(turn), 0.0, 0.0, math.sin(turn)
    arm = Arm(toy.SCENE, dataclasses.replace(toy.at_rest(), base_pose=base))
    pushed = [hold for hold in holds(arm, joint, (), 0.5, 1.0, wider=wider) if not hold.pinched]
    off = np.array([abs(hold.normal @ hold.hand[:, 0]) for hold in pushed if not hold.finger])
    assert (off < 1e-6).any()
    assert not ((off > 1e-6) & (off < math.sin(math.radians(6.0)))).any()


@pytest.mark.parametrize("joint", [DOOR, LEVER, SHORT], ids=["door", "lever", "short lever"])
@WAYS
def test_the_wider_set_only_pushes_and_in_ways_that_the_usual_one_has_not(joint, goal):
    usual, wider = found(joint, goal, False), found(joint, goal, True)
    assert not any(hold.pinched for hold in wider)
    assert not poses(usual) & poses(wider)


def test_a_bar_is_pinched_by_fingers_that_are_open_no_wider_than_it_needs():
    pinched = [hold for hold in found(LEVER, 1.0, False) if hold.pinched]
    assert pinched
    assert max(hold.opening for hold in pinched) < 0.8


@WAYS
def test_the_wider_set_of_a_knob_pinches_it_with_slanted_hands(goal):
    usual, wider = found(KNOB, goal, False), found(KNOB, goal, True)
    assert wider
    assert all(hold.pinched for hold in wider)
    assert not poses(usual) & poses(wider)
