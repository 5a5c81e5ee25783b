from __future__ import annotations

import dataclasses

import pytest

from pytest_safemanip.policies.scripted.arm import Arm
from pytest_safemanip.policies.scripted.ends import KETTLE_END, kettle_end
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.trace.elements import Body, Surface
from tests import toy

NONE = (0.0, 0.0, 0.0)
TRAY = Body("mug", (0.12, 0.18, 0.015), NONE, NONE, 0.4)
AWRY = (0.9950042, 0.0, 0.0, -0.0998334)
"""Turned by 11 degrees: its left end is farther ahead."""
LEFT, RIGHT = 0.36 * KETTLE_END, -0.36 * KETTLE_END


@pytest.mark.parametrize(
    ("machine", "end"),
    [(None, LEFT), (0.25, LEFT), (-0.25, RIGHT)],
    ids=["none: the far end", "on the left", "on the right"],
)
def test_a_kettle_goes_to_the_end_of_a_tray_that_is_beside_a_machine(machine, end):
    scene = dataclasses.replace(toy.SCENE, bodies=(TRAY, toy.SCENE.bodies[1]))
    if machine is not None:
        pose = (0.5, machine, 1.1, *toy.UPRIGHT)
        scene = dataclasses.replace(
            scene, surfaces=(Surface("cabinet", "", (0.1, 0.1, 0.2), pose),)
        )
    poses = ((0.6, 0.0, 0.935, *AWRY), (3.0, 3.0, 0.94, *toy.UPRIGHT))
    arm = Arm(scene, toy.at_rest(object_pose=poses))
    assert kettle_end(arm, Thing(arm, "mug"))[1] == pytest.approx(end, abs=0.01)
