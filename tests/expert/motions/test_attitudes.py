from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.expert.motions.attitudes import dipped
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import Body
from pytest_safemanip.trace.geometry import matrix
from tests import toy

LONG = 0.1


def stick(degrees, off):
    """An arm before a stick that lies at an angle about the vertical, held off its middle, m."""
    turn = np.radians(degrees) / 2.0
    quaternion = np.cos(turn), 0.0, 0.0, np.sin(turn)
    body = Body("mug", (LONG, 0.005, 0.009), (0.0,) * 3, (0.0,) * 3, 0.1)
    scene = dataclasses.replace(toy.SCENE, bodies=(body, toy.SCENE.bodies[1]))
    axis = matrix(np.array(quaternion))[:, 0]
    hand = Arm(scene, toy.at_rest()).position
    pose = (*(hand - off * axis), *quaternion)
    arm = Arm(scene, toy.at_rest(object_pose=(pose, (3.0, 3.0, 1.0, *toy.UPRIGHT))))
    return arm, Thing(arm, "obj"), axis


@pytest.mark.parametrize("degrees", [0.0, 90.0, 150.0, -60.0])
@pytest.mark.parametrize("off", [0.07, -0.07])
def test_the_end_that_is_not_held_is_dipped_before_the_robot(degrees, off):
    arm, thing, axis = stick(degrees, off)
    free = -np.sign(off) * axis
    turns = dipped(arm, thing)
    ends = [turn @ free for turn, _ in turns]
    assert all(end[2] < -0.7 for end in ends)
    best = ends[int(np.argmin([cost for _, cost in turns]))]
    assert arm.ahead(best) < 0.0
    assert arm.aside(best) == pytest.approx(0.0, abs=1e-6)


def test_either_end_is_if_it_is_held_near_its_middle():
    arm, thing, axis = stick(0.0, 0.01)
    ends = [(turn @ axis)[2] for turn, _ in dipped(arm, thing)]
    assert min(ends) < -0.7
    assert max(ends) > 0.7
