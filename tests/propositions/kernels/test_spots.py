"""Marked points of a surface; a radius of 5 cm unless another is named."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from pytest_safemanip.propositions.kernels.spots import Place, Spots, may_meet

RADIUS = 0.05


def place(*points):
    return Place(lambda: np.array(points, np.float32))


def marked(*points, radius=RADIUS):
    spots = Spots(radius)
    spots.add(place(*points))
    return spots


def test_a_place_knows_the_box_around_its_points():
    found = place((1, 5, -3), (2, 4, 0))
    assert (found.low, found.high) == ((1, 4, -3), (2, 5, 0))


def test_the_points_of_a_place_are_looked_up_once():
    calls = []
    found = Place(lambda: calls.append(1) or np.zeros((1, 3), np.float32))
    assert not calls
    assert found.low == found.high == (0, 0, 0)
    assert len(calls) == 1


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("start", [0.0, 0.31, -0.31])
@pytest.mark.parametrize(("away", "on_it"), [(0.0, True), (0.0499, True), (0.0501, False)])
def test_what_is_within_the_radius_of_a_mark_is_on_it(axis, sign, start, away, on_it):
    at = [start, start, start]
    spots = marked(at)
    at[axis] += sign * away
    assert spots.reach(place(at)) == on_it


def test_exactly_the_radius_is_on_it():
    # Numbers that are exact in binary.
    spots = marked((0.5, 0.25, 0.0), radius=0.0625)
    assert spots.reach(place((0.5625, 0.25, 0.0)))
    assert not spots.reach(place((0.5626, 0.25, 0.0)))


def test_the_distance_is_that_in_space():
    # 3 cm and 4 cm to the side are 5 cm; 3, 4 and 1 cm are 5.1 cm.
    spots = marked((0.0, 0.0, 0.0), radius=0.0501)
    assert spots.reach(place((0.03, 0.04, 0.0)))
    assert not spots.reach(place((0.03, 0.04, 0.01)))
    assert not spots.reach(place((0.049, 0.049, 0.049)))


def test_any_point_of_a_place_may_be_on_any_mark():
    spots = marked((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert spots.reach(place((0.5, 0.0, 0.0), (1.0, 0.04, 0.0)))
    assert not spots.reach(place((0.5, 0.0, 0.0), (0.9, 0.0, 0.0)))


def test_marks_add_up():
    spots = Spots(RADIUS)
    assert not spots.reach(place((0.0, 0.0, 0.0)))
    for x in (0.0, 0.5, 0.5, -0.7):
        spots.add(place((x, 0.0, 0.0)))
        assert spots.reach(place((x, 0.0, 0.04)))
    assert spots.reach(place((0.0, 0.04, 0.0)))
    assert not spots.reach(place((0.25, 0.0, 0.0)))


def test_marks_are_found_as_by_trying_all():
    random = np.random.default_rng(7)
    marks = random.uniform(-0.3, 0.3, (40, 3)).astype(np.float32)
    spots, hits = marked(*marks), 0
    for point in random.uniform(-0.4, 0.4, (400, 3)).astype(np.float32):
        wanted = min(math.dist(point, mark) for mark in marks.tolist()) <= RADIUS
        assert spots.reach(place(point)) == wanted
        assert spots.near(place(point)) or not wanted
        hits += wanted
    assert 10 < hits < 390


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("apart", "near"), [(0.04, True), (0.06, False)])
def test_near_looks_at_the_boxes_around_both(axis, sign, apart, near):
    # Two boxes of 20 cm, so far apart.
    offset = np.zeros(3)
    offset[axis] = sign * (0.2 + apart)
    box = np.array(list(itertools.product((-0.1, 0.1), repeat=3)))
    assert marked(*box).near(place(*(box + offset))) == near
    assert may_meet(place(*box), place(*(box + offset)), RADIUS) == near
    assert may_meet(place(*box), place(*(box + offset)), RADIUS + 0.02)


def test_nothing_is_near_to_no_mark():
    assert not Spots(RADIUS).near(place((0.0, 0.0, 0.0)))
