from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.tasks.stirring import end
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import Body
from tests import toy


@pytest.mark.parametrize("degrees", [-150.0, -70.0, 40.0, 110.0])
def test_the_lower_end_of_a_leaning_stick(degrees):
    stick = Body("mug", (0.1, 0.005, 0.009), (0.0,) * 3, (0.0,) * 3, 0.1)
    scene = dataclasses.replace(toy.SCENE, bodies=(stick, toy.SCENE.bodies[1]))
    turn = np.radians(degrees) / 2.0
    pose = (1.0, 2.0, 1.1, np.cos(turn), 0.0, np.sin(turn), 0.0)
    arm = Arm(scene, toy.at_rest(object_pose=(pose, (3.0, 3.0, 1.0, *toy.UPRIGHT))))
    low = end(Thing(arm, "obj"))
    assert np.linalg.norm(low - pose[:3]) == pytest.approx(0.1, abs=0.003)
    assert low[2] == pytest.approx(Thing(arm, "obj").bottom, abs=0.009)
