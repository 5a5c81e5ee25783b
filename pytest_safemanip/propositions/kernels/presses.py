"""Pressing contacts at each step, as input of the spreading of contamination."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools, Parameter
from pytest_safemanip.propositions.kernels.forces import hand_parts, owners
from pytest_safemanip.propositions.kernels.spots import Place
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.elements import ROBOT

FORCE = Parameter("contaminated.force", "N", 0.5, "as for a finger in a grasp")

_Pair = tuple[int, int]


def carriers(view: View) -> tuple[str, ...]:
    """The carriers of contamination: the hand, as ``robot``, and every object."""
    return (ROBOT, *(body.entity for body in view.trace.scene.bodies))


@dataclass(frozen=True)
class PressingParts:
    """Two parts that press on one another; at least one is a carrier's.

    Attributes:
        carriers: both of them, the lower number first; None if one part is no carrier's.
        carrier: the carrier that presses on a surface, -1 for two carriers.
        surface: number of the part that is no carrier's, -1 for two carriers.
    """

    carriers: _Pair | None
    carrier: int = -1
    surface: int = -1


_ONE = Place(lambda: np.zeros((1, 3), np.float32))
"""A part that a joint moves, such as a handle, is one spot."""


class Presses:
    """All contacts of a trace that press hard enough, and concern a carrier.

    Args:
        view: the trace, its binding and parameters.
    """

    def __init__(self, view: View) -> None:
        contacts, self._size = view.trace.steps.contacts, len(view.trace.scene.parts)
        self._carrier, matters, self._moves = view.shared(_sides)
        self._codes = codes = view.trace.pair_codes
        rows = np.flatnonzero(matters[codes] & (contacts.sustained >= view.parameters[FORCE.name]))
        # Rows of one pair at one step side by side.
        key = contacts.step[rows].astype(np.int64) * self._size**2 + codes[rows]
        order = np.argsort(key, kind="stable")
        rows, key = rows[order], key[order]
        first = np.flatnonzero(np.diff(key, prepend=-1))
        self._at, self._pairs = np.divmod(key[first], self._size**2)
        self._edges = np.append(first, len(rows))
        self._steps = np.searchsorted(self._at, np.arange(len(view.trace) + 1))
        self._rows, self._contacts = rows, contacts

    def parts(self, step: int) -> list[_Pair]:
        """Parts that press on one another at a step, the lower number first, in order."""
        pairs = self._pairs[self._steps[step] : self._steps[step + 1]].tolist()
        return [divmod(pair, self._size) for pair in pairs]

    def touching(self, stop: int) -> set[_Pair]:
        """Parts that touch one another before a step, however lightly, the lower number first."""
        pairs = np.unique(self._codes[slice(*self._contacts.span(0, stop))]).tolist()
        return {divmod(pair, self._size) for pair in pairs}

    def until(self, step: int) -> int:
        """The first later step at which other parts press; the number of steps if none is."""
        later = np.searchsorted(self._changes, step, side="right")
        return int(self._changes[later])

    def press(self, parts: _Pair) -> PressingParts:
        """The owners of two parts."""
        low, high = parts
        one, other = self._carrier[low], self._carrier[high]
        if one >= 0 and other >= 0:
            return PressingParts((one, other) if one <= other else (other, one))
        return PressingParts(None, max(one, other), high if one >= 0 else low)

    def place(self, number: int, press: PressingParts, first: int, stop: int) -> Place:
        """Contact points on a surface, over steps at which the same parts press.

        Args:
            number: which of the parts of these steps.
            press: whose they are.
            first: of the steps.
            stop: one after the last of them.
        """
        if self._moves[press.surface]:
            return _ONE
        return Place(partial(self._points, number, first, stop))

    def _points(self, number: int, first: int, stop: int) -> NDArray[np.float32]:
        groups = self._steps[first:stop] + number
        begin, end = self._edges[groups], self._edges[groups + 1]
        count = end - begin
        shift = np.repeat(end - np.cumsum(count), count)
        return np.asarray(self._contacts.position[self._rows[shift + np.arange(len(shift))]])

    @cached_property
    def _changes(self) -> NDArray[np.intp]:
        """Steps at which other parts press than at the step before; the number of steps last."""
        count = np.diff(self._steps)
        other = np.diff(count, prepend=-1) != 0
        like = np.flatnonzero(~other[self._at])
        changed = self._pairs[like] != self._pairs[like - count[self._at[like]]]
        other[self._at[like[changed]]] = True
        return np.append(np.flatnonzero(other), len(count))


def _sides(view: View) -> tuple[list[int], Bools, list[bool]]:
    """Of each part its carrier, -1 without one (parts,); which pairs of parts matter, the lower
    number first (parts * parts,); which parts move (parts,).
    """
    parts, hand = view.trace.scene.parts, list(hand_parts(view))
    carrier = view.shared(owners) + 1
    carrier[carrier == 0] = -1
    carrier[hand] = 0
    carries, ours = carrier >= 0, np.array([part.entity == ROBOT for part in parts], bool)
    both = np.logical_and.outer(carries, carries) & np.not_equal.outer(carrier, carrier)
    one = np.logical_and.outer(carries, ~carries & ~ours)
    matters = (both | one | one.T).ravel()
    return carrier.tolist(), matters, [bool(part.joint) for part in parts]
