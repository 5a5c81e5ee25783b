from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.expert.motions.spots import (
    inside,
    into_thing,
    on_counter,
    on_thing,
    under_tap,
)
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.tasks.handling import on
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.trace.elements import Box
from tests import toy

APPLE = {"apple": "apple"}
SCENE = dataclasses.replace(toy.SCENE, roles={**toy.SCENE.roles, **APPLE})


@pytest.fixture
def arm():
    return Arm(SCENE, toy.at_rest())


def best(spots):
    return min(spots, key=lambda spot: spot.cost)


def test_the_middle_of_another_thing_comes_first(arm):
    mug = Thing(arm, "obj")
    assert best(on_thing(arm, mug)).point == pytest.approx(mug.top)


@pytest.mark.parametrize(("end", "ahead"), [("near", -1.0), ("far", 1.0)])
def test_a_half_is_seen_from_the_robot(arm, end, ahead):
    mug = Thing(arm, "obj")
    spot = best(on_thing(arm, mug, end))
    assert ahead * arm.ahead(spot.point - mug.middle) > 0.01


def test_what_goes_into_a_vessel_stands_on_its_floor(arm):
    mug = Thing(arm, "obj")
    spots = into_thing(arm, Thing(arm, "apple"), mug)
    assert {spot.hollow for spot in spots} == {"mug"}
    assert best(spots).point[2] == pytest.approx(mug.bottom, abs=0.01)


@pytest.mark.parametrize("handle", [0.0, 0.1, -0.1], ids=["none", "behind", "before"])
def test_into_a_vessel_is_within_its_walls_whatever_handle_it_has(handle):
    half = 0.1 + abs(handle), 0.1, 0.05
    pan = dataclasses.replace(SCENE.bodies[0], half=half, centre=(handle, 0.0, 0.0))
    arm = Arm(dataclasses.replace(SCENE, bodies=(pan, SCENE.bodies[1])), toy.at_rest())
    vessel, apple = Thing(arm, "obj"), Thing(arm, "apple")
    spots = into_thing(arm, apple, vessel)
    offs = [np.linalg.norm((spot.point - vessel.middle)[:2]) for spot in spots]
    assert 0.0 < max(offs) <= 0.1 - apple.sides()[1][1] / 2.0


def test_what_is_high_may_be_hollow_and_what_is_flat_is_not(arm):
    assert {spot.hollow for spot in on(arm, "apple", "obj")} == {"mug", ""}
    flat = dataclasses.replace(SCENE.bodies[0], half=(0.1, 0.1, 0.01))
    arm = Arm(dataclasses.replace(SCENE, bodies=(flat, SCENE.bodies[1])), toy.at_rest())
    assert {spot.hollow for spot in on(arm, "apple", "obj")} == {""}


def test_on_a_counter_all_of_it_is_below(arm):
    mug, counter = Thing(arm, "obj"), Furniture(arm, "counter")
    spots = on_counter(arm, mug, counter)
    assert spots
    for spot in spots:
        assert spot.point[2] == pytest.approx(0.9)
        assert (np.abs(spot.point[:2]) < (0.95, 0.45)).all()


def test_near_another_thing_is_as_near_as_possible(arm):
    mug, apple = Thing(arm, "obj"), Thing(arm, "apple")
    spot = best(on_counter(arm, mug, Furniture(arm, "counter"), apple))
    assert np.linalg.norm((spot.point - apple.middle)[:2]) < 0.15


def test_where_there_is_no_counter_there_is_no_room(arm):
    high = dataclasses.replace(SCENE.surfaces[0], half=(0.02, 0.02, 0.45))
    arm = Arm(dataclasses.replace(SCENE, surfaces=(high,)), toy.at_rest())
    assert on_counter(arm, Thing(arm, "obj"), Furniture(arm, "counter")) == []


def test_in_a_fixture_things_stand_on_its_floor_within_its_walls(arm):
    pose, half = Furniture(arm, "cab").interiors()[0]
    spots = inside(arm, Thing(arm, "obj"), Furniture(arm, "cab"))
    assert spots
    for spot in spots:
        assert spot.point[2] == pytest.approx(pose[2] - half[2])
        assert (np.abs(spot.point - pose[:3])[:2] < half[:2]).all()


def test_water_that_falls_beside_a_basins_wall_is_met_on_the_basins_floor_where_there_is_room():
    boxes = (*SCENE.boxes, Box("cabinet", "water", "water", (0.01, 0.01, 0.5)))
    poses = toy.at_rest().box_pose[0], (0.27, 0.6, 1.5, *toy.UPRIGHT)
    arm = Arm(dataclasses.replace(SCENE, boxes=boxes), toy.at_rest(box_pose=poses))
    basin, half = Furniture(arm, "cab").interiors()[0]
    spots = under_tap(arm, Thing(arm, "obj"), Furniture(arm, "cab"))
    assert spots
    radius = np.hypot(*Thing(arm, "obj").corners[0, :2] - Thing(arm, "obj").middle[:2])
    for spot in spots:
        assert spot.point[2] == pytest.approx(basin[2] - half[2])
        assert abs(spot.point[0] - basin[0]) < half[0] - 0.05
        assert np.linalg.norm(spot.point[:2] - poses[1][:2]) <= 0.9 * radius


def test_what_lies_askew_may_be_turned_straight_to_fit_on_a_shelf():
    _, half = Furniture(Arm(SCENE, toy.at_rest()), "cab").interiors()[0]
    long = float(half[1]) - 0.01
    body = dataclasses.replace(SCENE.bodies[0], half=(0.7 * long, long, 0.03))
    scene = dataclasses.replace(SCENE, bodies=(body, SCENE.bodies[1]))

    def spots(degrees):
        turn = np.radians(degrees) / 2.0
        pose = (1.0, 2.0, 1.1, np.cos(turn), 0.0, 0.0, np.sin(turn))
        arm = Arm(scene, toy.at_rest(object_pose=(pose, (3.0, 3.0, 1.0, *toy.UPRIGHT))))
        return inside(arm, Thing(arm, "obj"), Furniture(arm, "cab"))

    assert len(spots(45.0)) == len(spots(0.0)) > 0
