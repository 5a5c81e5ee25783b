from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.expert.places.tray import (
    APART_ON_BOARD,
    KETTLE_END,
    OUTMOST,
    apart,
    kettle_end,
)
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.free_spots import gap
from pytest_safemanip.expert.world.things import Thing
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


@pytest.mark.parametrize(("other", "stays"), [(-0.09, True), (-0.03, False)])
def test_two_things_on_a_tray_stand_apart(other, stays):
    cup, kettle = Body("cup", (0.04, 0.04, 0.05), NONE, NONE, 0.3), toy.SCENE.bodies[1]
    kettle = dataclasses.replace(kettle, half=(0.08, 0.08, 0.08))
    poses = ((0.6, 0.0, 0.935), (0.6, other, 1.03), (0.4, -0.9, 1.2))
    step = toy.at_rest(object_pose=[(*pose, *toy.UPRIGHT) for pose in poses])
    arm = Arm(dataclasses.replace(toy.SCENE, bodies=(TRAY, kettle, cup)), step)
    tray, held, there = (Thing(arm, name) for name in ("mug", "cup", "apple"))
    end = np.array((0.6, 0.09, 0.935))
    spot = apart(arm, held, tray, end, there)
    assert (spot == pytest.approx(end)) == stays
    assert spot[0] <= 0.6
    assert np.linalg.norm(spot - tray.middle) < OUTMOST
    assert gap(held, spot, there) >= min(APART_ON_BOARD, gap(held, end, there) + 0.01)


def test_nothing_stands_on_the_rim_of_a_tray():
    handled = Body("cup", (0.055, 0.035, 0.045), (0.02, 0.0, 0.0), NONE, 0.3)
    kettle = dataclasses.replace(toy.SCENE.bodies[1], half=(0.08, 0.08, 0.08))
    outwards = (0.7071068, 0.0, 0.0, 0.7071068)
    poses = ((0.6, 0.0, 0.935, *toy.UPRIGHT), (0.6, -0.03, 1.03, *toy.UPRIGHT))
    step = toy.at_rest(object_pose=[*poses, (0.4, -0.9, 1.2, *outwards)])
    arm = Arm(dataclasses.replace(toy.SCENE, bodies=(TRAY, kettle, handled)), step)
    tray, held, there = (Thing(arm, name) for name in ("mug", "cup", "apple"))
    spot = apart(arm, held, tray, np.array((0.6, 0.09, 0.935)), there)
    assert spot[1] + 0.075 < 0.18
    assert spot[0] < 0.6
