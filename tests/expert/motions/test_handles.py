from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_safemanip.expert.motions.handles import handle, level
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import Body
from pytest_safemanip.trace.geometry import matrix
from tests import toy

NONE = (0.0, 0.0, 0.0)
# 16 cm wide, its lug of 3 cm to the front of its frame.
BOWL = Body("mug", (0.08, 0.095, 0.03), (0.0, -0.015, 0.0), NONE, 0.3)
SCENE = dataclasses.replace(toy.SCENE, bodies=(BOWL, toy.SCENE.bodies[1]))


def _arm(quat, hand=toy.UPRIGHT):
    poses = ((0.5, 0.1, 1.0, *quat), (0.9, 0.0, 1.0, *toy.UPRIGHT))
    arm = Arm(SCENE, toy.at_rest(object_pose=poses, eef_pose=(0.4, 0.1, 1.1, *hand)))
    return arm, Thing(arm, "mug")


@pytest.mark.parametrize("yaw", [0.0, 30.0, -100.0])
def test_a_handle_begins_at_the_wall_and_points_away_from_the_middle(yaw):
    half = math.radians(yaw) / 2.0
    _, bowl = _arm((math.cos(half), 0.0, 0.0, math.sin(half)))
    root, way = handle(bowl)
    out = np.array((math.sin(2.0 * half), -math.cos(2.0 * half), 0.0))
    assert way == pytest.approx(out)
    assert root == pytest.approx(np.array((0.5, 0.1, 1.03)) + 0.08 * out, abs=1e-6)


@pytest.mark.parametrize("out", [(-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.6, 0.8, 0.0)])
def test_a_hand_sets_a_vessel_level_that_has_swung_in_it(out):
    swung = np.array((0.9, 0.06, -0.08, 0.4))
    arm, bowl = _arm(tuple(swung / np.linalg.norm(swung)), (0.8, 0.0, 0.6, 0.0))
    turn = level(arm, bowl, np.array(out)) @ arm.rotation.T
    axes = turn @ matrix(bowl.pose[3:])
    assert axes[:, 2] == pytest.approx((0.0, 0.0, 1.0), abs=1e-6)
    assert -axes[:, 1] == pytest.approx(out, abs=0.02)
