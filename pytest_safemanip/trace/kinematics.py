"""Poses of the moving parts of fixtures, from the openness of their joints."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.geometry import Array, about, multiply, rotate


def carried(joint: Joint, pose: Array, openness: Array) -> Array:
    """Poses that a joint carries, at other openness.

    Args:
        joint: a door, a drawer or a control.
        pose: pose at openness 0 (..., 7), world frame.
        openness: 0 closed, 1 open (...).

    Returns:
        Poses (..., 7).
    """
    travel, pose = np.asarray(openness, float) * joint.travel, np.asarray(pose, float)
    if joint.kind == "slide":
        return slid(pose, travel[..., None] * np.asarray(joint.axis))
    return swung(pose, np.asarray(joint.axis), travel, np.asarray(joint.anchor))


def slid(pose: Array, way: Array) -> Array:
    """Poses (..., 7) moved by vectors (..., 3)."""
    place = pose[..., :3] + way
    return np.concatenate((place, np.broadcast_to(pose[..., 3:], (*place.shape[:-1], 4))), axis=-1)


def swung(pose: Array, axis: Array, angle: Array, anchor: Array) -> Array:
    """Poses (..., 7) turned about axes (..., 3) through anchors (..., 3) by angles (...) in rad."""
    turn = about(axis, angle)
    place = anchor + rotate(turn, pose[..., :3] - anchor)
    return np.concatenate((place, multiply(turn, pose[..., 3:])), axis=-1)


def opening_direction(joint: Joint, points: Array) -> Array:
    """Unit direction in which points (..., 3) on the moving part move when it opens."""
    axis = np.asarray(joint.axis)
    points = np.asarray(points, float)
    if joint.kind == "slide":
        return np.broadcast_to(axis, points.shape)
    motion = np.cross(axis, points - np.asarray(joint.anchor))
    length = np.linalg.norm(motion, axis=-1, keepdims=True)
    return np.asarray(motion / np.maximum(length, 1e-9))
