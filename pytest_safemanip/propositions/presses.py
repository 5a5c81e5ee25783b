"""Who presses on what at a step, as the spreading of contamination sees it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools, Parameter
from pytest_safemanip.propositions.forces import hand_parts, owners
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.elements import ROBOT

FORCE = Parameter("contaminated.force", "N", 0.5, "as for a finger in a grasp")

_Pair = tuple[int, int]
_Cell = tuple[int, int, int]


def carriers(view: View) -> tuple[str, ...]:
    """What contamination spreads between: the hand, as ``robot``, and every object."""
    return (ROBOT, *(body.entity for body in view.trace.scene.bodies))


@dataclass(frozen=True)
class Press:
    """Two parts that press on one another; at least one is a carrier's.

    Attributes:
        carriers: both of them, the lower number first; None if one part is no carrier's.
        carrier: the carrier that presses on a surface, -1 for two carriers.
        surface: number of the part that is no carrier's, -1 for two carriers.
    """

    carriers: _Pair | None
    carrier: int = -1
    surface: int = -1


@dataclass(frozen=True)
class Place:
    """Where a surface is touched.

    Attributes:
        low: least coordinates of the contact points (3,), m.
        high: largest ones.
        points: the contact points, world frame (K, 3).
    """

    low: Sequence[float]
    high: Sequence[float]
    points: NDArray[np.float32]


_ONE = Place((0.0,) * 3, (0.0,) * 3, np.zeros((1, 3), np.float32))
"""A part that a joint moves, such as a handle, is one spot."""


class Presses:
    """All contacts of a trace that press hard enough, and concern a carrier.

    Args:
        view: the trace, its binding and parameters.
    """

    def __init__(self, view: View) -> None:
        contacts = view.trace.steps.contacts
        carrier, ours, self._moves = view.shared(_sides)
        a, b = contacts.a, contacts.b
        of_a, of_b = carrier[a], carrier[b]
        both, one = (of_a >= 0) & (of_b >= 0), (of_a >= 0) != (of_b >= 0)
        surface = np.where(of_a >= 0, b, a)
        matters = np.where(both, of_a != of_b, one & ~ours[surface])
        rows = np.flatnonzero(matters & (contacts.peak >= view.parameters[FORCE.name]))
        low, high = np.minimum(a, b)[rows], np.maximum(a, b)[rows]
        # Rows of one pair at one step side by side.
        order = np.lexsort((high, low, contacts.step[rows]))
        rows, low, high = rows[order], low[order], high[order]
        step = contacts.step[rows]
        changes = (step[1:] != step[:-1]) | (low[1:] != low[:-1]) | (high[1:] != high[:-1])
        first = np.flatnonzero(np.concatenate((np.ones(len(rows[:1]), bool), changes)))
        self._edges: list[int] = [*first.tolist(), len(rows)]
        self._steps: list[int] = np.searchsorted(
            step[first], np.arange(len(view.trace) + 1)
        ).tolist()
        self._position = contacts.position[rows]
        none = np.empty((0, 3))
        self._low, self._high = (
            (end.reduceat(self._position, first) if len(rows) else none).tolist()
            for end in (np.minimum, np.maximum)
        )
        self._parts = list(zip(low[first].tolist(), high[first].tolist(), strict=True))
        self._carrier: list[int] = carrier.tolist()

    def parts(self, step: int) -> list[_Pair]:
        """Parts that press on one another at a step, the lower number first, in order."""
        return self._parts[self._steps[step] : self._steps[step + 1]]

    def press(self, parts: _Pair) -> Press:
        """Whose two parts are."""
        low, high = parts
        one, other = self._carrier[low], self._carrier[high]
        if one >= 0 and other >= 0:
            return Press((one, other) if one <= other else (other, one))
        return Press(None, max(one, other), high if one >= 0 else low)

    def place(self, step: int, number: int, press: Press) -> Place:
        """Where a surface is touched.

        Args:
            step: when.
            number: which of the parts of that step.
            press: whose they are.
        """
        if self._moves[press.surface]:
            return _ONE
        group = self._steps[step] + number
        span = slice(self._edges[group], self._edges[group + 1])
        return Place(self._low[group], self._high[group], self._position[span])


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

    def reach(self, place: Place) -> bool:
        """Whether any point of a place is on one that is marked."""
        far = 1.001 * self._radius
        if any(low - far > top for low, top in zip(self._low, place.high, strict=True)):
            return False
        if any(high + far < bottom for high, bottom in zip(self._high, place.low, strict=True)):
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
        # A little larger than the radius: rounding must not put a neighbour further away.
        x, y, z = point
        size = 1.001 * self._radius
        return int(x // size), int(y // size), int(z // size)


def _neighbours(cell: _Cell) -> Iterator[_Cell]:
    x, y, z = cell
    return itertools.product((x - 1, x, x + 1), (y - 1, y, y + 1), (z - 1, z, z + 1))


def _sides(view: View) -> tuple[NDArray[np.intp], Bools, list[bool]]:
    """Of each part its carrier, -1 without one, whether it is the robot's, whether it moves."""
    parts, hand = view.trace.scene.parts, list(hand_parts(view))
    carrier = view.shared(owners) + 1
    carrier[carrier == 0] = -1
    carrier[hand] = 0
    ours = np.array([part.entity == ROBOT for part in parts], bool)
    return carrier, ours, [bool(part.joint) for part in parts]
