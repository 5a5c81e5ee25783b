from __future__ import annotations

import dataclasses

import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.tasks.tipping import fill_height
from pytest_safemanip.expert.world.things import Thing
from tests import toy


@pytest.mark.parametrize(
    ("half", "place", "expected"),
    [
        ((0.03, 0.03, 0.03), (0.5, 0.1, 1.0), 0.06),
        ((0.02, 0.02, 0.07), (0.5, 0.1, 1.0), 0.04),
        ((0.07, 0.02, 0.01), (0.5, 0.1, 1.0), 0.02),
        ((0.03, 0.03, 0.03), (0.9, 0.1, 1.0), 0.0),
    ],
    ids=["round", "upright", "flat", "beside the pan"],
)
def test_the_food_in_a_pan_stands_as_high_as_it_is_when_it_lies(half, place, expected):
    mug, apple = toy.SCENE.bodies
    pan = dataclasses.replace(mug, half=(0.12, 0.2, 0.025), centre=(0.0, -0.08, 0.0))
    scene = dataclasses.replace(toy.SCENE, bodies=(pan, dataclasses.replace(apple, half=half)))
    poses = ((0.5, 0.1, 1.0, *toy.UPRIGHT), (*place, *toy.UPRIGHT))
    arm = Arm(scene, toy.at_rest(object_pose=poses))
    assert fill_height(arm, Thing(arm, "mug")) == pytest.approx(expected)
