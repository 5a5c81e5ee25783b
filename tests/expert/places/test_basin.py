from __future__ import annotations

import dataclasses

import pytest

from pytest_safemanip.expert.places.basin import BEFORE_MIDDLE, END_ROOM, right_end
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.trace.elements import Body
from tests import toy

# 20 cm wide, its handle of 20 cm to the right, as the robot sees it.
PAN = Body("mug", (0.1, 0.2, 0.03), (0.0, -0.1, 0.0), (0.0, 0.0, 0.0), 0.8)
SCENE = dataclasses.replace(toy.SCENE, bodies=(PAN, toy.SCENE.bodies[1]))


def test_a_pan_in_a_basin_leaves_room_at_the_end_of_its_handle():
    arm = Arm(SCENE, toy.at_rest())
    spot = right_end(arm, Thing(arm, "mug"), Furniture(arm, "cab"))
    tip, wall = spot[1] - 0.3, 0.6 - 0.3
    assert tip - wall == pytest.approx(END_ROOM, abs=1e-6)
    assert (spot[0], spot[2]) == pytest.approx((-BEFORE_MIDDLE, 1.8), abs=1e-6)
