"""Points and boxes seen from frames over time, coordinate by coordinate: for many vectors of three
numbers, numpy takes several times as long as for three long rows.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from pytest_safemanip.trace.geometry import CORNERS, Array, matrix


def rotation(q: Array) -> Array:
    """Rotation matrices (3, 3, K) of unit quaternions (K, 4); columns are the frame's axes."""
    return np.ascontiguousarray(np.moveaxis(matrix(q), 0, -1))


def placed(pose: Array, points: Array) -> Array:
    """Points (N, 3), each of the frame of a pose (T, N, 7), in the world (3, N, T)."""
    x, y, z, w, i, j, k = np.ascontiguousarray(pose.T, float)
    a, b, c = points.T[..., None]
    u, v, t = 2.0 * (j * c - k * b), 2.0 * (k * a - i * c), 2.0 * (i * b - j * a)
    result: Array = np.empty((3, *x.shape))
    result[0] = x + a + w * u + (j * t - k * v)
    result[1] = y + b + w * v + (k * u - i * t)
    result[2] = z + c + w * t + (i * v - j * u)
    return result


def inner(a: Array, b: Array) -> Array:
    """Inner products (...) of vectors (3, ...); the same bits however many there are, which those
    of ``einsum`` are not.
    """
    result: Array = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return result


class Frames:
    """Poses as frames; what does not turn has one set of axes.

    Args:
        pose: of each (K, 7).

    Attributes:
        turn: the one quaternion of all of them, as bytes; None if they turn.
    """

    def __init__(self, pose: Array) -> None:
        moves = bool((pose != pose[0]).any())
        pose = np.asarray(pose if moves else pose[:1], float)
        turns = moves and bool((pose[:, 3:] != pose[0, 3:]).any())
        self.turn = None if turns else pose[0, 3:].tobytes()
        self._axes = rotation(pose[:, 3:]) if self.turn is None else _axes(self.turn)
        self._origin = self.turned(pose[:, :3].T)

    def local(self, points: Array) -> Array:
        """World points (3, ..., K) in these frames."""
        return self.shifted(self.turned(points))

    def turned(self, vectors: Array) -> Array:
        """World vectors (3, ..., K) along the axes of these frames."""
        return _along(self._axes, vectors)

    def shifted(self, turned: Array) -> Array:
        """World points, along the axes of these frames already, in these frames (3, ..., K)."""
        origin = self._origin.reshape(3, *(1,) * (turned.ndim - 2), -1)
        return np.subtract(turned, origin, order="C")


def along(turn: bytes, vectors: Array) -> Array:
    """World vectors (3, ..., K) along the axes of frames by their quaternion, which is
    :attr:`Frames.turn`.
    """
    return _along(_axes(turn), vectors)


def _along(axes: Array, vectors: Array) -> Array:
    x, y, z = vectors
    result: Array = np.empty(vectors.shape)
    for axis in range(3):
        a, b, c = axes[:, axis]
        result[axis] = a * x + b * y + c * z
    return result


@lru_cache(maxsize=256)
def _axes(turn: bytes) -> Array:
    """Step by step, the same frames are asked for again and again."""
    return rotation(np.frombuffer(turn).reshape(1, 4))


def corners_within(centre: Array, edges: Array, limit: ArrayLike, ground: Array) -> Array:
    """Which corners of boxes are within a box that the axes go through the middle of (K, 8).

    Args:
        centre: of the boxes (3, K).
        edges: half of their edges, as vectors: coordinate, edge (3, 3, K).
        limit: half extents of the box (3,), m.
        ground: which of the boxes stand on the box's floor, as it were: their corners below its
            middle count as at its height (K,).
    """
    low, high = _ends(centre, edges, ground)
    limit = np.asarray(limit, float)[:, None]
    within = np.empty((centre.shape[1], 8), bool)
    within[:] = ((low > -limit) & (high < limit)).all(axis=0)[:, None]
    beside = ((low >= limit) | (high <= -limit)).any(axis=0)
    unclear = np.flatnonzero(~(within[:, 0] | beside))
    if len(unclear):
        points = np.tensordot(edges[:, :, unclear], CORNERS, axes=(1, 1))  # (3, K, 8)
        points += centre[:, unclear, None]
        lying = ground[unclear, None]
        points[2] = np.where(lying, np.maximum(points[2], 0.0), points[2])
        within[unclear] = (np.abs(points) < limit[:, None]).all(axis=0)
    return within


def depth_within(centre: Array, edges: Array, limit: ArrayLike, ground: Array) -> Array:
    """How far inside a box the outermost corner of each of other boxes is, m; negative outside
    (K,). The arguments are those of :func:`corners_within`.
    """
    low, high = _ends(centre, edges, ground)
    limit = np.asarray(limit, float)[:, None]
    result: Array = np.minimum(limit + low, limit - high).min(axis=0)
    return result


def _ends(centre: Array, edges: Array, ground: Array) -> tuple[Array, Array]:
    """The least and the greatest coordinates of the corners of boxes (3, K), (3, K)."""
    reach = np.abs(edges).sum(axis=1)
    low, high = centre - reach, centre + reach
    for end in (low, high):
        end[2] = np.where(ground, np.maximum(end[2], 0.0), end[2])
    return low, high
