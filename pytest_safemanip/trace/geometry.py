"""Rotations, poses and boxes over arrays. Quaternions are ``wxyz``; poses are (..., 7)."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[Any]
"""A floating-point array; float32 in recordings, float64 in computations."""

CORNERS: Array = np.array(list(product((-1.0, 1.0), repeat=3)))
"""Signs of the eight corners of a box (8, 3)."""
_FROM_PRODUCTS: Array = np.array([
    (0, 0, 0,   0, 0, 0,   0, 0, 0),  # ww
    (0, 0, 0,   0, 0, -2,  0, 2, 0),  # wx
    (0, 0, 2,   0, 0, 0,  -2, 0, 0),  # wy
    (0, -2, 0,  2, 0, 0,   0, 0, 0),  # wz
    (0, 0, 0,   0, 0, 0,   0, 0, 0),  # xw
    (0, 0, 0,   0, -2, 0,  0, 0, -2),  # xx
    (0, 2, 0,   2, 0, 0,   0, 0, 0),  # xy
    (0, 0, 0,   0, 0, 0,   0, 0, 0),  # xz
    (0, 0, 0,   0, 0, 0,   0, 0, 0),  # yw
    (0, 0, 0,   0, 0, 0,   0, 0, 0),  # yx
    (-2, 0, 0,  0, 0, 0,   0, 0, -2),  # yy
    (0, 0, 0,   0, 0, 2,   0, 2, 0),  # yz
    (0, 0, 0,   0, 0, 0,   0, 0, 0),  # zw
    (0, 0, 2,   0, 0, 0,   2, 0, 0),  # zx
    (0, 0, 0,   0, 0, 0,   0, 0, 0),  # zy
    (-2, 0, 0,  0, -2, 0,  0, 0, 0),  # zz
], float)  # fmt: skip
"""A rotation matrix less the identity, row by row (9), from the products of its unit quaternion's
numbers (16): twice ``xy - wz`` at row 0, column 1, say."""
_IDENTITY: Array = np.eye(3)
_INVERSE: Array = np.array((1.0, -1.0, -1.0, -1.0))
_ROUNDING = 1e-9
"""More than what float64 places are off by, m."""


def conjugate(q: Array) -> Array:
    """Inverse of unit quaternions (..., 4)."""
    return np.multiply(q, _INVERSE)


def multiply(p: Array, q: Array) -> Array:
    """Hamilton product of quaternions (..., 4)."""
    p, q = np.asarray(p, float), np.asarray(q, float)
    pw, px, py, pz = (p[..., number] for number in range(4))
    qw, qx, qy, qz = (q[..., number] for number in range(4))
    first = pw * qw - px * qx - py * qy - pz * qz
    result: Array = np.empty((*first.shape, 4))
    result[..., 0] = first
    result[..., 1] = pw * qx + px * qw + py * qz - pz * qy
    result[..., 2] = pw * qy - px * qz + py * qw + pz * qx
    result[..., 3] = pw * qz + px * qy - py * qx + pz * qw
    return result


def about(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Unit quaternions (..., 4) of rotations about a unit vector (3,) by angles (...) in rad."""
    half = np.asarray(angle, float)[..., None] / 2.0
    return np.concatenate((np.cos(half), np.sin(half) * np.asarray(axis)), axis=-1)


def rotate(q: Array, v: ArrayLike) -> Array:
    """Vectors (..., 3) turned by unit quaternions (..., 4)."""
    q, v = np.asarray(q, float), np.asarray(v, float)
    if q.ndim == 1:
        x, y, z = matrix(q).T
        # A matrix product's last bit depends on how many vectors there are.
        turned: Array = v[..., :1] * x + v[..., 1:2] * y + v[..., 2:] * z
        return turned
    u = q[..., 1:]
    t = 2.0 * cross(u, v)
    result: Array = v + q[..., :1] * t + cross(u, t)
    return result


def cross(a: Array, b: Array) -> Array:
    """Vector products (..., 3); ``numpy.cross`` takes several times as long for a few vectors."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    first = ay * bz - az * by
    result: Array = np.empty((*first.shape, 3), first.dtype)
    result[..., 0], result[..., 1], result[..., 2] = first, az * bx - ax * bz, ax * by - ay * bx
    return result


def matrix(q: Array) -> Array:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4); columns are the frame's axes."""
    q = np.asarray(q, float)
    products = (q[..., :, None] * q[..., None, :]).reshape(*q.shape[:-1], 16)
    result: Array = (products @ _FROM_PRODUCTS).reshape(*q.shape[:-1], 3, 3) + _IDENTITY
    return result


def angle_between(p: Array, q: Array) -> Array:
    """Angle in [0, pi] of the rotations between unit quaternions (..., 4)."""
    apart, across = np.subtract(p, q, dtype=float), np.add(p, q, dtype=float)
    # Half of the angle between them as vectors; -q is the same rotation as q.
    squares = [np.einsum("...i,...i->...", v, v) for v in (apart, across)]
    near, far = np.minimum(*squares), np.maximum(*squares)
    result: Array = 4.0 * np.arctan2(np.sqrt(near), np.sqrt(far))
    return result


def to_local(pose: Array, points: ArrayLike) -> Array:
    """World points (..., 3) in the frame of poses (..., 7)."""
    pose = np.asarray(pose, float)
    return rotate(conjugate(pose[..., 3:]), np.asarray(points, float) - pose[..., :3])


def to_world(pose: Array, points: ArrayLike) -> Array:
    """Points (..., 3) of the frame of poses (..., 7), in the world."""
    pose = np.asarray(pose, float)
    return pose[..., :3] + rotate(pose[..., 3:], points)


def centred(pose: Array, centre: ArrayLike) -> Array:
    """Poses (..., 7) of a box whose centre (3,) is given in the frame of poses (..., 7)."""
    return np.concatenate((to_world(pose, centre), np.asarray(pose)[..., 3:]), axis=-1)


def relative(pose: Array, other: Array) -> Array:
    """Poses ``other`` (..., 7) as seen from the frames ``pose`` (..., 7)."""
    position = to_local(pose, np.asarray(other)[..., :3])
    turn = multiply(conjugate(np.asarray(pose)[..., 3:]), np.asarray(other)[..., 3:])
    return np.concatenate((position, turn), axis=-1)


def corners(pose: Array, half: ArrayLike, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """World positions (..., 8, 3) of the corners of boxes attached to poses (..., 7).

    Args:
        pose: what the boxes are attached to.
        half: their half extents (..., 3).
        centre: their centres in the frame of the poses (..., 3).
    """
    pose = np.asarray(pose, float)
    half, centre = np.asarray(half, float), np.asarray(centre, float)
    local = centre[..., None, :] + CORNERS * half[..., None, :]
    result: Array = local @ np.swapaxes(matrix(pose[..., 3:]), -1, -2) + pose[..., None, :3]
    return result


def tilt(q: Array, axis: ArrayLike = (0.0, 0.0, 1.0)) -> Array:
    """Angle in rad between the world's vertical and a body axis (3,) turned by ``q`` (..., 4)."""
    up = rotate(q, np.broadcast_to(np.asarray(axis, float), (*np.shape(q)[:-1], 3)))[..., 2]
    result: Array = np.arccos(np.clip(up, -1.0, 1.0))
    return result


def boxes_overlap(
    pose_a: Array, half_a: ArrayLike, pose_b: Array, half_b: ArrayLike, slack: float = 0.0
) -> NDArray[np.bool_]:
    """Whether pairs of oriented boxes interpenetrate by more than ``slack`` metres (...).

    Separating-axis test over the 15 candidate axes.

    Args:
        pose_a: centre poses (..., 7).
        half_a: half extents (..., 3).
        pose_b: centre poses (..., 7).
        half_b: half extents (..., 3).
        slack: overlap that still counts as apart; negative demands a gap.
    """
    pose_a, pose_b = np.broadcast_arrays(np.asarray(pose_a, float), np.asarray(pose_b, float))
    half_a, half_b = (np.broadcast_to(half, (*pose_a.shape[:-1], 3)) for half in (half_a, half_b))
    apart = np.linalg.norm(pose_b[..., :3] - pose_a[..., :3], axis=-1)
    balls = np.linalg.norm(half_a, axis=-1) + np.linalg.norm(half_b, axis=-1)
    near = balls - apart > slack - _ROUNDING  # the balls around them overlap: few do
    if near.all():
        return np.asarray(boxes_depth(pose_a, half_a, pose_b, half_b) > slack)
    found = np.zeros(near.shape, bool)
    if near.any():
        depth = boxes_depth(pose_a[near], half_a[near], pose_b[near], half_b[near])
        found[near] = depth > slack
    return found


def boxes_depth(pose_a: Array, half_a: ArrayLike, pose_b: Array, half_b: ArrayLike) -> Array:
    """How deep pairs of oriented boxes interpenetrate, m (...); negative for a gap.

    The least overlap along the 15 candidate axes.

    Args:
        pose_a: centre poses (..., 7).
        half_a: half extents (..., 3).
        pose_b: centre poses (..., 7).
        half_b: half extents (..., 3).
    """
    pose_a, pose_b = np.broadcast_arrays(np.asarray(pose_a, float), np.asarray(pose_b, float))
    half_a, half_b = (np.broadcast_to(half, (*pose_a.shape[:-1], 3)) for half in (half_a, half_b))
    axes_a = np.swapaxes(matrix(pose_a[..., 3:]), -1, -2)
    axes_b = np.swapaxes(matrix(pose_b[..., 3:]), -1, -2)
    crossed = cross(axes_a[..., :, None, :], axes_b[..., None, :, :])
    crossed = crossed.reshape(*crossed.shape[:-3], 9, 3)
    axes = np.concatenate((axes_a, axes_b, crossed), axis=-2)
    length = np.linalg.norm(axes, axis=-1)
    parallel = length < 1e-6  # then the cross product is no axis
    axes = axes / np.where(parallel, 1.0, length)[..., None]
    gap = np.abs(axes @ (pose_b - pose_a)[..., :3, None])[..., 0]
    reach = _reach(axes, axes_a, half_a) + _reach(axes, axes_b, half_b)
    result: Array = np.where(parallel, np.inf, reach - gap).min(axis=-1)
    return result


def _reach(axes: Array, own: Array, half: ArrayLike) -> Array:
    """Half extents of boxes with axes (..., 3, 3) along other axes (..., K, 3): (..., K)."""
    shares = np.abs(axes @ np.swapaxes(own, -1, -2))
    result: Array = (shares @ np.asarray(half, float)[..., None])[..., 0]
    return result
