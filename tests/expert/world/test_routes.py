from __future__ import annotations

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest

from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.world.routes import CARRYING_BODY, TURNS_ABOUT, _Grid, floor, route
from pytest_safemanip.expert.world.standing import BASE_ROOM, BODY_REAR, rearmost
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import Entity, Surface
from tests import toy

FLOOR = Surface("floor", "", (2.8, 3.2, 0.02), (0.0, 0.0, -0.02, *toy.UPRIGHT))
START, GOAL = (-1.5, 0.0), (1.53, 0.02)


def arm(*half):
    """A robot at the start that faces along x, its hand before it, a counter in the middle."""
    return among(Surface("counter", "", half, (0.0, 0.0, half[2], *toy.UPRIGHT)))


def among(*counters, start=START):
    """Likewise among some counters."""
    entities = (*toy.SCENE.entities, Entity("floor", "room", "Floor"))
    scene = dataclasses.replace(toy.SCENE, entities=entities, surfaces=(*counters, FLOOR))
    step = toy.at_rest(
        base_pose=(*start, 0.0, *toy.UPRIGHT),
        eef_pose=(start[0] + 0.4, start[1], 1.2, 0.0, 1.0, 0.0, 0.0),
        object_pose=((start[0] + 0.4, start[1], 1.15, *toy.UPRIGHT), (0, 3, 1, *toy.UPRIGHT)),
    )
    return Arm(scene, step)


def places(robot):
    """Where the base passes, every centimetre of the way."""
    stops = route(robot, Thing(robot, "obj"), np.array(GOAL))
    assert not any(turn for _, turn in stops)
    corners = [np.array(START), *(place for place, _ in stops)]
    assert corners[-1] == pytest.approx(GOAL)
    return np.concatenate([np.linspace(a, b, 400) for a, b in pairwise(corners)])


@pytest.mark.parametrize("half", [(0.4, 1.0, 0.45), (0.1, 2.0, 0.2), (0.4, 1.0, 0.8)])
def test_the_way_leads_around_what_stands_on_the_floor(half):
    way = places(arm(*half))
    for low, _, back, front, wide in CARRYING_BODY:
        if low < 2 * half[2]:
            beside = np.abs(way[:, 1]) > half[1] + wide
            before = (way[:, 0] + front < -half[0]) | (way[:, 0] + back > half[0])
            assert (beside | before).all()


def test_it_goes_straight_where_nothing_is_in_the_way():
    assert np.abs(places(arm(0.4, 0.1, 0.0))[:, 1]).max() < 0.03


def test_a_load_that_is_lower_than_a_counter_goes_around_it_too():
    robot = arm(0.2, 0.5, 0.6)
    way = places(robot)
    hand = 0.4 + Thing(robot, "obj").reach(np.array((1.0, 0.0, 0.0)))
    near = (way[:, 0] + hand > -0.2) & (way[:, 0] < 0.2)
    assert (np.abs(way[near, 1]) > 0.5).all()


def test_a_wall_across_the_room_leaves_no_way():
    robot = arm(0.1, 3.2, 1.0)
    with pytest.raises(SkillFailed, match="no way"):
        route(robot, Thing(robot, "obj"), np.array(GOAL))


@pytest.mark.parametrize("off", [0.01, 0.02, 0.03, 0.04, 0.05, 0.06])
def test_it_gets_to_a_goal_at_the_edge_of_the_floor(off):
    robot = among()
    back, aside = floor(robot)[0]
    goal = np.array((back - off, aside + 0.3))
    stops = [robot.base, *(place for place, _ in route(robot, Thing(robot, "obj"), goal))]
    assert stops[-1] == pytest.approx(goal)
    way = sum(float(np.abs(b - a).sum()) for a, b in pairwise(stops))
    assert way < np.abs(goal - START).sum() + 0.1


def test_where_it_is_too_long_to_go_sideways_it_turns_and_at_the_end_faces_as_before():
    # An aisle of 0.75 m along y, and nothing but that: 0.7 m long, the base does not fit across it.
    walls = [
        Surface("counter", "", (1.2, 0.6, 0.45), (1.575 * side, 0.0, 0.45, *toy.UPRIGHT))
        for side in (-1.0, 1.0)
    ]
    robot = among(*walls, start=(0.0, -2.0))
    goal = np.array((0.0, 2.0))
    here, heading = robot.base, 0.0
    stops = route(robot, None, goal)
    assert {abs(turn) for _, turn in stops} == {0.0, 90.0}
    for place, turn in stops:
        along = np.array((math.cos(heading), math.sin(heading)))
        left = np.array((-along[1], along[0]))
        _, _, back, front, half = CARRYING_BODY[0]
        corners = [a * along + b * left for a in (back, front) for b in (-half, half)]
        for at in np.linspace(here, place, 200):
            xs, ys = (np.array(corners) + at).T
            assert (ys.min() > 0.6 or ys.max() < -0.6) or (np.abs(xs) < 0.375).all()
        middle = place - TURNS_ABOUT * along
        heading += math.radians(turn)
        here = middle + TURNS_ABOUT * np.array((math.cos(heading), math.sin(heading)))
        if turn:
            assert np.abs(middle[1]) > 0.6 + 0.4
    assert here == pytest.approx(goal)
    assert heading == pytest.approx(0.0)


def test_it_turns_where_only_a_quarter_of_the_circle_is_free():
    # An aisle of 1.2 m that bends from along x to along y: nothing turns there all the way round.
    half, edge = 0.5, 0.6
    boxes = [
        ((1.5, half), (0.0, -edge - half)),
        ((half, 1.5), (-edge - half, 0.0)),
        ((1.0, 1.0), (edge + 1.0, edge + 1.0)),
    ]
    counters = [
        Surface("counter", "", (*size, 0.8), (*at, 0.8, *toy.UPRIGHT)) for size, at in boxes
    ]
    robot = among(*counters, start=(0.0, 0.0))
    turns = _Grid(robot, None, np.array((-1.5, -1.5)), np.array((60, 60))).turns()
    assert turns[0].any()
    assert not turns.all(axis=0).any()


def test_what_is_behind_a_place_is_told_from_there():
    robot = arm(0.4, 1.0, 0.45)
    assert rearmost(robot, 0.0, 0.0) == -np.inf
    assert rearmost(robot, 0.0, 0.0, 1.5) == pytest.approx(0.4 + BODY_REAR[1] + BASE_ROOM)
