"""Contact points on surfaces, and which are marked as contaminated."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

_Cell = tuple[int, int, int]
_MARGIN = 1.001
"""Rounding must not put a neighbour further away than the radius is."""


class Place:
    """Contact points on a surface, at a step or over several; read lazily.

    Args:
        find: gives the contact points, world frame, m (K, 3).
    """

    def __init__(self, find: Callable[[], NDArray[np.float32]]) -> None:
        self._find = find

    @functools.cached_property
    def points(self) -> NDArray[np.float32]:
        """The contact points (K, 3)."""
        return self._find()

    @functools.cached_property
    def low(self) -> tuple[float, ...]:
        """Their least coordinates (3,)."""
        return tuple(self.points.min(axis=0).tolist())

    @functools.cached_property
    def high(self) -> tuple[float, ...]:
        """Their largest coordinates (3,)."""
        return tuple(self.points.max(axis=0).tolist())


class Spots:
    """Marked points of a surface.

    Args:
        radius: how near to one is on it, m.
    """

    def __init__(self, radius: float) -> None:
        self._radius = radius
        self._known: set[tuple[float, ...]] = set()
        self._waiting: list[Place] = []
        self._low: tuple[float, ...] = (math.inf,) * 3
        self._high: tuple[float, ...] = (-math.inf,) * 3
        self._cells: dict[_Cell, list[tuple[float, ...]]] = {}
        self._around: set[_Cell] = set()

    def add(self, place: Place) -> None:
        """Mark the points of a place."""
        self._waiting.append(place)  # most are never asked about
        self._low = tuple(map(min, self._low, place.low))
        self._high = tuple(map(max, self._high, place.high))

    def near(self, place: Place) -> bool:
        """Whether a place may be on a marked point: where it is not, none of its points is."""
        return _meet(self._low, self._high, place, self._radius)

    def reach(self, place: Place) -> bool:
        """Whether any point of a place is on one that is marked."""
        if not self.near(place):
            return False
        self._mark()
        return any(
            math.dist(point, spot) <= self._radius
            for point in place.points.tolist()
            if (own := self._cell(point)) in self._around
            for cell in _neighbours(own)
            for spot in self._cells.get(cell, ())
        )

    def _mark(self) -> None:
        found = {tuple(point) for place in self._waiting for point in place.points.tolist()}
        self._waiting.clear()
        new = found - self._known
        self._known |= new
        for point in new:
            cell = self._cell(point)
            if cell not in self._cells:
                self._cells[cell] = []
                self._around.update(_neighbours(cell))
            self._cells[cell].append(point)

    def _cell(self, point: Sequence[float]) -> _Cell:
        x, y, z = point
        size = _MARGIN * self._radius
        return int(x // size), int(y // size), int(z // size)


def may_meet(one: Place, other: Place, radius: float) -> bool:
    """Whether points of two places may be so near to one another, m."""
    return _meet(one.low, one.high, other, radius)


def _meet(low: Sequence[float], high: Sequence[float], place: Place, radius: float) -> bool:
    far = _MARGIN * radius
    return not (
        any(least - far > top for least, top in zip(low, place.high, strict=True))
        or any(most + far < bottom for most, bottom in zip(high, place.low, strict=True))
    )


def _neighbours(cell: _Cell) -> Iterator[_Cell]:
    x, y, z = cell
    return itertools.product((x - 1, x, x + 1), (y - 1, y, y + 1), (z - 1, z, z + 1))
