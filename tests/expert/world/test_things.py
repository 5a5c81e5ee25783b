from __future__ import annotations

import dataclasses
import math

import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.things import Thing, contents
from tests import toy

TRAY, CARROT, PLATE = (0.1, 0.1, 0.03), (0.08, 0.02, 0.02), (0.09, 0.09, 0.01)
BOWL = (0.15, 0.15, 0.04)


def seen(half, height, lean=0.0):
    """What lies in or on a tray with an apple of such half sizes so high, m, that leans, rad."""
    tray, apple = toy.SCENE.bodies
    bodies = dataclasses.replace(tray, half=TRAY), dataclasses.replace(apple, half=half)
    turn = (math.cos(lean / 2.0), 0.0, math.sin(lean / 2.0), 0.0)
    poses = (0.0, 0.0, 0.93, *toy.UPRIGHT), (0.0, 0.0, height, *turn)
    arm = Arm(dataclasses.replace(toy.SCENE, bodies=bodies), toy.at_rest(object_pose=poses))
    return [thing.entity for thing in contents(arm, Thing(arm, "obj"))]


@pytest.mark.parametrize(
    ("half", "height", "lean", "inside"),
    [
        (CARROT, 0.93, 0.0, ["apple"]),
        (CARROT, 0.945, 0.6, ["apple"]),  # its box reaches 17 mm below the tray
        (PLATE, 0.89, 0.0, []),
        (BOWL, 0.935, 0.0, []),
        (CARROT, 1.2, 0.0, []),
    ],
    ids=["lies in it", "leans in it", "lies below it", "is around it", "hangs above it"],
)
def test_what_lies_or_leans_in_a_vessel_is_in_it(half, height, lean, inside):
    assert seen(half, height, lean) == inside
