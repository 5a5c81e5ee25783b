"""Distances between oriented boxes, pair by pair, coordinate by coordinate: the same bits however
many pairs there are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pytest_safemanip.trace.geometry import Array

_TURNS = 32
"""Rounds of projection from one box to the other and back. Distances are then right to the last
bit, but for boxes that all but touch: there they may be a millimetre too large."""
_ARRIVED = 1e-18
"""Square of the way of a round, m2, below which the nearest point is found."""
_PARALLEL = 1e-3
"""Sine of an angle below which two edges count as parallel, and have no common normal."""


class Boxes(NamedTuple):
    """Oriented boxes.

    Attributes:
        centre: world frame (3, K), m.
        axes: unit vectors: coordinate, axis (3, 3, K).
        half: half extents (3, K), m.
    """

    centre: Array
    axes: Array
    half: Array

    @classmethod
    def of(cls, pose: Array, half: Array) -> Boxes:
        """Of the poses of their centres (K, 7) and half extents (K, 3)."""
        x, y, z, w, i, j, k = np.ascontiguousarray(np.asarray(pose, float).T)
        length = np.sqrt(w * w + i * i + j * j + k * k)  # of float32, within 1e-7
        w, i, j, k = w / length, i / length, j / length, k / length
        axes: Array = np.empty((3, 3, len(x)))
        axes[0, 0], axes[1, 1], axes[2, 2] = (
            1.0 - 2.0 * (j * j + k * k),
            1.0 - 2.0 * (i * i + k * k),
            1.0 - 2.0 * (i * i + j * j),
        )
        axes[0, 1], axes[1, 0] = 2.0 * (i * j - w * k), 2.0 * (i * j + w * k)
        axes[0, 2], axes[2, 0] = 2.0 * (i * k + w * j), 2.0 * (i * k - w * j)
        axes[1, 2], axes[2, 1] = 2.0 * (j * k - w * i), 2.0 * (j * k + w * i)
        return cls(np.array((x, y, z)), axes, np.ascontiguousarray(np.asarray(half, float).T))

    @property
    def rise(self) -> Array:
        """How far they reach above and below their centres, m (K,)."""
        return _sum(np.abs(self.axes[2]) * self.half)


def gap(one: Boxes, other: Boxes) -> Array:
    """Signed distances of pairs of boxes (K,), m: of their nearest points, or minus the least that
    one would have to move for them to come apart.
    """
    place, turn = _seen_from(one, other)
    found = _separation(place, turn, one.half, other.half)
    apart = np.flatnonzero(found > 0.0)
    if len(apart):
        some = place[:, apart], turn[..., apart], one.half[:, apart], other.half[:, apart]
        found[apart] = _nearest(*some)
    return found


def separation(one: Boxes, other: Boxes) -> Array:
    """What is above 0 where pairs of boxes are apart, and then no more than their distance, m (K,);
    elsewhere as :func:`gap`, for much less.
    """
    return _separation(*_seen_from(one, other), one.half, other.half)


def _seen_from(one: Boxes, other: Boxes) -> tuple[Array, Array]:
    """Centres (3, K) and axes (3, 3, K) of boxes in the frames of others."""
    turn = np.array([[_sum(one.axes[:, i] * other.axes[:, j]) for j in range(3)] for i in range(3)])
    away = other.centre - one.centre
    return np.array([_sum(one.axes[:, i] * away) for i in range(3)]), turn


def _separation(place: Array, turn: Array, one: Array, other: Array) -> Array:
    """The largest gap along the normals of faces and of pairs of edges (K,), negative for an
    overlap (Gottschalk, Lin and Manocha, SIGGRAPH 1996).

    Args:
        place: of the other box's centre, in the first one's frame (3, K).
        turn: the other one's axes in that frame (3, 3, K).
        one: half extents of the first (3, K).
        other: of the other (3, K).
    """
    size = np.abs(turn)
    found = np.full(place.shape[1], -np.inf)
    for i in range(3):
        np.maximum(found, np.abs(place[i]) - one[i] - _sum(size[i] * other), out=found)
        along = np.abs(_sum(place * turn[:, i]))
        np.maximum(found, along - other[i] - _sum(size[:, i] * one), out=found)
    for i in range(3):
        for j in range(3):
            (i1, i2), (j1, j2) = ((i + 1) % 3, (i + 2) % 3), ((j + 1) % 3, (j + 2) % 3)
            sine = np.sqrt(np.maximum(1.0 - turn[i, j] ** 2, 0.0))
            apart = np.abs(place[i2] * turn[i1, j] - place[i1] * turn[i2, j])
            reach = one[i1] * size[i2, j] + one[i2] * size[i1, j]
            reach += other[j1] * size[i, j2] + other[j2] * size[i, j1]
            edges = sine > _PARALLEL
            along = np.divide(apart - reach, sine, out=np.full(len(sine), -np.inf), where=edges)
            np.maximum(found, along, out=found)
    return found


def _nearest(place: Array, turn: Array, one: Array, other: Array) -> Array:
    """Distance of the nearest points of boxes that are apart (K,); arguments as above.

    A point is projected onto one box, then onto the other, and so on, with momentum that starts
    again where it leads away (O'Donoghue and Candes, 2015).
    """

    def on_other(point: Array) -> Array:
        there = point - place
        inside = np.array([_sum(turn[:, j] * there) for j in range(3)])
        inside = np.clip(inside, -other, other)
        nearest: Array = place + np.array([_sum(turn[i] * inside) for i in range(3)])
        return nearest

    found = ahead = np.clip(place, -one, one)
    pace, arrived = np.ones(place.shape[1]), np.zeros(place.shape[1], bool)
    for _ in range(_TURNS):
        new = np.where(arrived, found, np.clip(on_other(ahead), -one, one))
        way = new - found
        arrived = arrived | (_sum(way * way) < _ARRIVED)
        away = _sum((ahead - new) * way) > 0.0
        pace = np.where(away, 1.0, pace)
        faster = 0.5 + np.sqrt(0.25 + pace * pace)
        ahead = new + np.where(away, 0.0, (pace - 1.0) / faster) * way
        found, pace = new, faster
        if arrived.all():
            break
    apart = on_other(found) - found
    length: Array = np.sqrt(_sum(apart * apart))
    return length


def footprint_gap(one: Boxes, other: Boxes) -> Array:
    """Signed gap between the vertical projections of pairs of boxes (K,), m: the largest along a
    normal of their edges, negative for an overlap.
    """
    away = other.centre[:2] - one.centre[:2]
    found = np.full(away.shape[1], -np.inf)
    for edges in (one.axes[:2], other.axes[:2]):
        for number in range(3):
            x, y = edges[:, number]
            length = np.sqrt(x * x + y * y)
            level = length > _PARALLEL
            normal = np.divide((-y, x), length, out=np.zeros((2, len(x))), where=level)
            reach = sum(
                _sum(np.abs(normal[0] * box.axes[0] + normal[1] * box.axes[1]) * box.half)
                for box in (one, other)
            )
            along = np.abs(normal[0] * away[0] + normal[1] * away[1]) - reach
            np.maximum(found, np.where(level, along, -np.inf), out=found)
    return found


def _sum(rows: Array) -> Array:
    """Sums of three rows (3, ...)."""
    result: Array = rows[0] + rows[1] + rows[2]
    return result
