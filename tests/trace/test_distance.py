from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from pytest_safemanip.trace.distance import Boxes, footprint_gap, gap
from pytest_safemanip.trace.geometry import about, boxes_overlap, corners, matrix
from pytest_safemanip.trace.planar import footprints_overlap

RANDOM = np.random.default_rng(5)
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def random_boxes(count, spread=0.8):
    turns = RANDOM.normal(size=(count, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    poses = np.concatenate((RANDOM.uniform(-spread, spread, (count, 3)), turns), axis=1)
    return poses, RANDOM.uniform(0.02, 0.3, (count, 3))


def true_distance(pose_a, half_a, pose_b, half_b):
    """By bounded least squares over the coordinates of a point in each box."""
    a, b = matrix(pose_a[3:]) * half_a, matrix(pose_b[3:]) * half_b
    found = lsq_linear(np.hstack((a, -b)), pose_b[:3] - pose_a[:3], (-1, 1), method="bvls")
    return np.sqrt(2.0 * found.cost)


def test_boxes_that_are_apart_have_the_distance_of_their_nearest_points():
    (pose_a, half_a), (pose_b, half_b) = random_boxes(300), random_boxes(300)
    found = gap(Boxes.of(pose_a, half_a), Boxes.of(pose_b, half_b))
    apart = np.flatnonzero(found > 0)
    assert 100 < len(apart) < 290
    wanted = [true_distance(pose_a[k], half_a[k], pose_b[k], half_b[k]) for k in apart]
    assert found[apart] == pytest.approx(wanted, abs=2e-3)
    assert np.quantile(np.abs(found[apart] - wanted), 0.95) < 1e-6


def test_boxes_that_overlap_have_the_depth_that_parts_them():
    (pose_a, half_a), (pose_b, half_b) = random_boxes(300, 0.3), random_boxes(300, 0.3)
    found = gap(Boxes.of(pose_a, half_a), Boxes.of(pose_b, half_b))
    for slack in (0.0, 0.01, 0.05):
        overlap = boxes_overlap(pose_a, half_a, pose_b, half_b, slack)
        sure = np.abs(found + slack) > 1e-9
        assert (overlap == (found < -slack))[sure].all()


@pytest.mark.parametrize(
    ("place", "wanted"),
    [
        ((0.5, 0.0, 0.0), 0.3),
        ((0.5, 0.6, 0.0), 0.5),
        ((0.5, 0.6, 1.4), 1.3),
        ((0.15, 0.0, 0.0), -0.05),
        ((0.15, 0.18, 0.0), -0.02),
        ((0.0, 0.0, 0.0), -0.2),
    ],
)
@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_faces_edges_and_corners_are_measured_as_they_are(place, wanted, angle):
    turn = about((0.0, 0.0, 1.0), angle)
    half = np.full((1, 3), 0.1)
    there = np.array((*(matrix(turn) @ np.array(place)), *turn))
    one, other = (Boxes.of(np.array([pose]), half) for pose in ((0, 0, 0, *turn), there))
    assert gap(one, other)[0] == pytest.approx(wanted, abs=1e-9)
    assert gap(other, one)[0] == pytest.approx(wanted, abs=1e-9)


def test_footprints_are_those_of_the_corners():
    (pose_a, half_a), (pose_b, half_b) = random_boxes(300, 0.5), random_boxes(300, 0.5)
    found = footprint_gap(Boxes.of(pose_a, half_a), Boxes.of(pose_b, half_b))
    points_a, points_b = corners(pose_a, half_a), corners(pose_b, half_b)
    for slack in (0.0, 0.02):
        for k in np.flatnonzero(np.abs(found + slack) > 1e-9):
            assert (found[k] < -slack) == footprints_overlap(points_a[k], points_b[k], slack)


def test_the_bits_do_not_depend_on_how_many_there_are():
    (pose_a, half_a), (pose_b, half_b) = random_boxes(50), random_boxes(50)
    together = gap(Boxes.of(pose_a, half_a), Boxes.of(pose_b, half_b))
    rows = [slice(k, k + 1) for k in range(50)]
    alone = [gap(Boxes.of(pose_a[r], half_a[r]), Boxes.of(pose_b[r], half_b[r])) for r in rows]
    assert np.concatenate(alone).tobytes() == together.tobytes()
    rise = Boxes.of(pose_a, half_a).rise
    assert rise == pytest.approx(np.ptp(corners(pose_a, half_a)[..., 2], axis=1) / 2)
