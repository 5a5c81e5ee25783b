from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.room import Room, walls
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import Body
from pytest_safemanip.trace.geometry import corners
from tests import toy

BOX = np.asarray(corners(np.array((0.0, 0.0, 1.0, *toy.UPRIGHT)), (0.1, 0.2, 0.05)))[None]
ROOM = Room(BOX, np.eye(3), np.array((-0.5, -0.5, 0.5)), np.array((0.5, 0.5, 1.5)))


@pytest.mark.parametrize(
    ("point", "away"),
    [((0.15, 0.0, 1.0), 0.05), ((0.0, 0.0, 1.08), 0.03), ((0.0, 0.0, 1.04), -0.01)],
    ids=["beside", "above", "inside"],
)
def test_distance_to_the_nearest_box(point, away):
    points = np.array((point,))
    assert ROOM.exactly(points) == pytest.approx((away,))
    assert ROOM.away(points) == pytest.approx((away,), abs=0.004)
    assert ROOM.away(points, np.array((0.02,))) == pytest.approx((away - 0.02,), abs=0.004)


@pytest.mark.parametrize("size", [0.02, 0.2, 2.0])
def test_the_least_distance_is_that_of_the_nearest_point(size):
    points = np.random.default_rng(0).uniform((0.0, -0.1, 0.9), (size, 0.1, 1.1), (200, 3))
    assert ROOM.least(points) == ROOM.exactly(points).min()


def test_what_is_far_off_is_free():
    assert ROOM.away(np.array(((0.4, 0.4, 1.4), (9.0, 9.0, 9.0)))).min() > 0.5


def test_what_is_left_out_is_not_in_the_room():
    arm = Arm(toy.SCENE, toy.at_rest())
    mug = Thing(arm, "obj")
    inside = (mug.centre @ arm.frame)[None]
    assert Room.around(arm, [mug.centre]).exactly(inside)[0] < 0.0
    assert Room.around(arm, [mug.centre], ["mug"]).exactly(inside)[0] > 0.03


def test_a_hollow_vessel_has_a_wall_all_round_and_a_floor():
    scene = dataclasses.replace(
        toy.SCENE,
        bodies=(Body("mug", (0.1,) * 3, (0.0,) * 3, (0.0,) * 3, 0.3), toy.SCENE.bodies[1]),
    )
    arm = Arm(scene, toy.at_rest())
    bowl = Thing(arm, "obj")
    low, high = bowl.centre - 0.3, bowl.centre + 0.3
    room = Room(np.array(walls(bowl)), np.eye(3), low, high)
    turns = np.linspace(0.0, 2.0 * np.pi, 17)
    ring = np.stack((np.cos(turns), np.sin(turns), 0.0 * turns), axis=1)
    assert (room.exactly(bowl.centre + 0.06 * ring) > 0.02).all()
    assert (room.exactly(bowl.centre + 0.1 * ring) < 0.005).all()
    assert room.exactly((bowl.centre - (0.0, 0.0, 0.098))[None])[0] < 0.0
