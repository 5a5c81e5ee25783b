from __future__ import annotations

import dataclasses
import math

import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.tasks.collecting import in_order
from pytest_safemanip.expert.world.things import Thing
from tests import toy

FACING_Y = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
THIRD = dataclasses.replace(toy.SCENE.entities[-1], name="plum")
SCENE = dataclasses.replace(
    toy.SCENE,
    entities=(*toy.SCENE.entities, THIRD),
    bodies=(*toy.SCENE.bodies, dataclasses.replace(toy.SCENE.bodies[-1], entity="plum")),
)


@pytest.mark.parametrize(
    ("mug", "apple", "first"),
    [
        ((0.0, 0.6), (0.4, 0.6), "mug"),
        ((0.4, 0.6), (0.0, 0.6), "apple"),
        ((0.02, 0.5), (0.0, 0.7), "mug"),
        ((0.0, 0.7), (0.02, 0.5), "apple"),
    ],
    ids=["farther", "nearer", "in front", "behind"],
)
def test_the_farther_cup_comes_first_and_of_two_behind_each_other_the_one_in_front(
    mug, apple, first
):
    poses = [(*place, 1.5, *toy.UPRIGHT) for place in (mug, apple, (1.0, 0.6))]
    step = toy.at_rest(
        object_pose=poses, object_twist=[[0.0] * 6] * 3, base_pose=(0.0, -1.0, 0.0, *FACING_Y)
    )
    arm = Arm(SCENE, step)
    assert in_order(arm, "mug", "apple", Thing(arm, "plum"))[0] == first
