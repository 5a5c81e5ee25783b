from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.trace.frames import Frames, along, corners_within, inner, placed, rotation
from pytest_safemanip.trace.geometry import corners, matrix, to_local, to_world
from tests.trace.test_geometry import poses, quaternions, vectors

several = st.lists(poses, min_size=1, max_size=4).map(np.array)


@given(quaternions)
def test_a_rotation_is_the_matrix_of_its_quaternion(q):
    assert rotation(q[None])[..., 0] == pytest.approx(matrix(q))


@given(several, vectors)
def test_points_of_frames_are_placed_in_the_world(pose, point):
    points = point + np.arange(3.0 * len(pose)).reshape(-1, 3)
    over_time = np.stack([pose, pose[::-1]])  # (2, N, 7)
    seen = placed(over_time, points).T
    assert seen == pytest.approx(to_world(over_time, points))


@given(several, vectors, st.sampled_from(["turns", "slides", "is still"]))
def test_points_are_seen_from_each_frame(pose, point, how):
    if how != "turns":
        same = slice(3, 7) if how == "slides" else slice(0, 7)
        pose[:, same] = pose[0, same]
    points = point + np.arange(3.0 * 2 * len(pose)).reshape(3, 2, len(pose)).T  # (K, 2, 3)
    frames, wanted = Frames(pose), pytest.approx(to_local(pose[:, None], points))
    seen = frames.local(points.T).T
    assert seen == wanted
    assert frames.turn is not None or how == "turns"
    if frames.turn is not None:
        again = frames.shifted(along(frames.turn, points.T)).T
        assert (seen == again).all()


@given(several, vectors.map(lambda v: 0.01 + abs(v)), vectors.map(lambda v: 0.1 + abs(v)))
def test_corners_within_a_box_are_those_that_are_seen_there(pose, half, limit):
    points = corners(pose, half)
    edges = rotation(pose[:, 3:]) * half[:, None]
    none = np.zeros(len(pose), bool)
    found = corners_within(pose[:, :3].T, edges, limit, none)
    clear = np.abs(np.abs(points) - limit).min(axis=(1, 2)) > 1e-9
    assert (found[clear] == (np.abs(points) < limit).all(axis=-1)[clear]).all()


@pytest.mark.parametrize(("height", "ground", "inside"), [(-0.5, False, 4), (-0.5, True, 8)])
def test_corners_of_what_stands_on_the_floor_count_as_at_the_middle(height, ground, inside):
    centre, edges = np.array([[0.0], [0.0], [height]]), 0.6 * np.eye(3)[..., None]
    found = corners_within(centre, edges, (1.0, 1.0, 1.0), np.array([ground]))
    assert found.sum() == inside


@pytest.mark.parametrize("count", [2, 3, 5, 8, 13, 29])
def test_of_many_inner_products_each_has_the_same_bits_as_alone(count):
    a, b = np.random.default_rng(count).normal(size=(2, 3, count))
    alone = [inner(a[:, n : n + 1], b[:, n : n + 1])[0] for n in range(count)]
    assert np.array_equal(inner(a, b), alone)
    assert inner(a, b) == pytest.approx((a * b).sum(axis=0))
