from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.trace.geometry import (
    angle_between,
    boxes_overlap,
    conjugate,
    corners,
    matrix,
    multiply,
    relative,
    rotate,
    tilt,
    to_local,
    to_world,
)
from pytest_safemanip.trace.planar import breadth, footprints_overlap, hull_margin

numbers = st.floats(-2.0, 2.0)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)
quaternions = (
    st.tuples(numbers, numbers, numbers, numbers)
    .filter(lambda q: np.linalg.norm(q) > 0.1)
    .map(lambda q: np.array(q) / np.linalg.norm(q))
)
poses = st.tuples(vectors, quaternions).map(np.concatenate)


def yaw(radians):
    return (np.cos(radians / 2), 0.0, 0.0, np.sin(radians / 2))


def test_a_quarter_turn_about_the_vertical_turns_x_into_y():
    turn = np.array(yaw(np.pi / 2))
    assert rotate(turn, (1.0, 0.0, 0.0)) == pytest.approx(np.array((0.0, 1.0, 0.0)))
    assert matrix(turn)[:, 0] == pytest.approx(np.array((0.0, 1.0, 0.0)))
    assert angle_between(turn, np.array(yaw(0.0))) == pytest.approx(np.pi / 2)
    assert tilt(turn) == pytest.approx(0.0, abs=1e-7)
    assert tilt(np.array((np.cos(0.2), np.sin(0.2), 0.0, 0.0))) == pytest.approx(0.4)


@given(quaternions, quaternions, vectors)
def test_rotations_compose_and_both_signs_are_the_same(p, q, v):
    assert rotate(multiply(p, q), v) == pytest.approx(rotate(p, rotate(q, v)))
    assert rotate(-q, v) == pytest.approx(rotate(q, v))
    assert angle_between(q, -q) == pytest.approx(0.0)
    turned = 2.0 * np.arccos(min(1.0, abs(multiply(conjugate(p), q)[0])))
    assert angle_between(p, q) == pytest.approx(turned, abs=1e-6)
    assert matrix(q) @ v == pytest.approx(rotate(q, v))


@given(poses, poses, vectors)
def test_frames_are_left_and_entered_again(pose, other, point):
    assert to_local(pose, to_world(pose, point)) == pytest.approx(point, abs=1e-9)
    seen = relative(pose, other)
    assert to_world(pose, to_world(seen, point)) == pytest.approx(to_world(other, point), abs=1e-9)


def box(x, y, turn=0.0, half=(0.1, 0.1, 0.1), z=0.0):
    return np.array((x, y, z, *yaw(turn))), half


DIAGONAL = 0.1 * np.sqrt(2.0)


@pytest.mark.parametrize(
    ("other", "apart"),
    [
        (box(0.201, 0.0), True),
        (box(0.199, 0.0), False),
        (box(0.1 + DIAGONAL + 0.001, 0.0, np.pi / 4), True),
        (box(0.1 + DIAGONAL - 0.001, 0.0, np.pi / 4), False),
        # Their upright bounding boxes overlap, they do not.
        (box(0.19, 0.19, np.pi / 4), True),
        (box(0.15, 0.15, np.pi / 4), False),
    ],
)
def test_turned_boxes_overlap_only_where_they_really_do(other, apart):
    one = box(0.0, 0.0)
    assert boxes_overlap(*one, *other) != apart
    assert boxes_overlap(*other, *one) != apart
    assert footprints_overlap(corners(*one), corners(*other), 0.0) != apart
    raised = np.add(other[0], (0, 0, 5.0, 0, 0, 0, 0))
    assert not boxes_overlap(*one, raised, other[1])
    assert footprints_overlap(corners(*one), corners(raised, other[1]), 0.0) != apart


@pytest.mark.parametrize(("slack", "overlap"), [(0.019, True), (0.021, False), (-0.01, True)])
def test_a_slight_overlap_counts_as_apart(slack, overlap):
    one, other = box(0.0, 0.0), box(0.18, 0.0)
    assert boxes_overlap(*one, *other, slack) == overlap
    assert footprints_overlap(corners(*one), corners(*other), slack) == overlap


@pytest.mark.parametrize(("place", "overlap"), [((0.0, 0.05), True), ((0.0, 0.15), False)])
def test_a_wall_without_thickness_has_a_footprint(place, overlap):
    wall = box(*place, half=(0.0, 0.02, 0.5))
    assert footprints_overlap(corners(*wall), corners(*box(0.0, 0.0)), -1e-9) == overlap
    beside = box(0.0, 0.3, half=(0.0, 0.02, 0.5))
    assert not footprints_overlap(corners(*wall), corners(*beside), -1e-9)


SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0.5), (0.5, 0)], float)


@pytest.mark.parametrize(
    ("points", "target", "margin"),
    [
        (SQUARE, (0.5, 0.5), 0.5),
        (SQUARE, (0.9, 0.5), 0.1),
        (SQUARE, (1.0, 0.5), 0.0),
        (SQUARE, (1.3, 0.5), -0.3),
        (SQUARE, (1.3, 1.4), -0.5),
        (SQUARE[:2], (0.5, 0.2), -0.2),
        (SQUARE[:1], (3.0, 4.0), -5.0),
        (SQUARE[[0, 0, 0]], (0.0, 0.1), -0.1),
        (SQUARE[[0, 1, 5]], (0.5, 0.2), -0.2),
        (np.zeros((0, 2)), (0.0, 0.0), -np.inf),
    ],
)
def test_the_margin_is_the_distance_to_the_edge_of_what_carries(points, target, margin):
    assert hull_margin(points, np.array(target)) == pytest.approx(margin)


@pytest.mark.parametrize("angle", [0.0, 0.3, 2.0])
def test_a_footprint_is_as_broad_as_where_it_is_narrowest(angle):
    turn = np.array(((np.cos(angle), -np.sin(angle)), (np.sin(angle), np.cos(angle))))
    corners = np.array([(x, y) for x in (-0.1, 0.1) for y in (-0.003, 0.003)]) @ turn.T + 0.7
    assert breadth(np.column_stack((corners, np.ones(4)))) == pytest.approx(0.006)
    assert breadth(np.zeros((2, 3))) == 0.0


def random_turn(random, shape=()):
    q = random.normal(size=(*shape, 4))
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


@pytest.mark.parametrize("count", [2, 3, 5, 8, 13, 29])
def test_of_many_points_each_is_turned_to_the_same_bits_as_alone(count):
    random = np.random.default_rng(count)
    points, turns = random.normal(size=(count, 3)), random_turn(random, (count,))
    alone = [rotate(turn[None], point[None])[0] for turn, point in zip(turns, points, strict=True)]
    assert np.array_equal(rotate(turns, points), alone)
    alone = [rotate(turns[0], point[None])[0] for point in points]
    assert np.array_equal(rotate(turns[0], points), alone)
    assert np.array_equal(matrix(turns), [matrix(turn[None])[0] for turn in turns])
