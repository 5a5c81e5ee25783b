from __future__ import annotations

import dataclasses
import math

import pytest

from pytest_safemanip.expert.motions.grasping import PADS, across
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.hand import FINGERTIP, OPENING
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import Body
from tests import toy

NONE = (0.0, 0.0, 0.0)
ACROSS = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))


@pytest.mark.parametrize("height", [0.021, 0.027, 0.04])
def test_the_lower_one_of_two_fingers_stays_above_what_a_thing_lies_on(height):
    # Narrow from the robot's side: one finger comes down before it, the other one behind it.
    thing = Body("mug", (0.015, 0.03, height / 2.0), NONE, NONE, 0.1)
    scene = dataclasses.replace(toy.SCENE, bodies=(thing, toy.SCENE.bodies[1]))
    poses = ((0.5, 0.0, 1.0, *toy.UPRIGHT), (0.9, 0.0, 1.0, *toy.UPRIGHT))
    arm = Arm(scene, toy.at_rest(object_pose=poses, eef_pose=(0.3, 0.0, 1.2, *ACROSS)))
    grasp = across(arm, Thing(arm, "mug"), 35.0)
    lowest = grasp.point[2] - OPENING / 2.0 * grasp.opening * abs(grasp.hand[2, 0])
    assert abs(grasp.hand[:2, 0] @ (1.0, 0.0)) > 0.9
    assert lowest >= 1.0 - height / 2.0 + FINGERTIP - 1e-6
    assert grasp.point[2] <= 1.0 + height / 2.0 - PADS
