"""How contamination spreads: from body to body, and over the touched spots of surfaces.

It lasts until the body is washed: the one memory without a window, folded over the trace.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.propositions.contact import hand_parts
from pytest_safemanip.propositions.definition import Bools, Parameter
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.elements import ROBOT

FORCE = Parameter("contaminated.force", "N", 0.5, "as for a finger in a grasp")
WINDOW = Parameter("contaminated.window", "s", 0.1, "a graze of one control step leaves nothing")
SPOT = Parameter("contaminated.spot", "m", 0.05, "juice runs; a hand's width beside it is clean")
KEPT_CLEAN = frozenset({"utensil", "container"})

_Pair = tuple[int, int]
_Point = tuple[float, ...]


def carriers(view: View) -> tuple[str, ...]:
    """What contamination spreads between: the hand, as ``robot``, and every object."""
    return (ROBOT, *(body.entity for body in view.trace.scene.bodies))


class Spreading:
    """What is contaminated after each step, and who touches what should stay clean.

    Args:
        view: gives scene, binding and parameters.
    """

    def __init__(self, view: View) -> None:
        scene, hand = view.trace.scene, hand_parts(view)
        self._names = carriers(view)
        self._carrier = [
            0 if index in hand else scene.object_index.get(part.entity, -2) + 1
            for index, part in enumerate(scene.parts)
        ]
        self._robot = {i for i, part in enumerate(scene.parts) if part.entity == ROBOT}
        self._moves = [bool(part.joint) for part in scene.parts]
        kinds = [view.binding.attributes.get(name, frozenset()) for name in self._names]
        self._raw = {n for n, kind in enumerate(kinds) if "raw" in kind}
        self._ready = {n for n, kind in enumerate(kinds) if "ready_to_eat" in kind}
        self._clean = {n for n, kind in enumerate(kinds) if kind & KEPT_CLEAN}
        self._force = view.parameters[FORCE.name]
        self._count = view.trace.count(view.parameters[WINDOW.name])
        self._radius = view.parameters[SPOT.name]
        self._dirty = set(self._raw)
        self._lasting: dict[_Pair, int] = {}  # steps since when two parts press
        self._touching: dict[_Pair, int] = {}  # the same for two carriers
        self._dirty_before: dict[_Pair, frozenset[int]] = {}
        self._spots: dict[int, set[_Point]] = {}

    def advance(self, view: View, step: int) -> Bools:
        """Take in a step.

        Returns:
            For each carrier whether it is contaminated, and which carriers it touches that are
            ready to eat, or that were clean before the touch and should stay so
            (carriers, 1 + carriers).
        """
        before = self._dirty
        washed = {n for n, name in enumerate(self._names) if view("sanitized", name)[step]}
        rows = range(*np.searchsorted(view.trace.steps.contacts.step, (step, step + 1)))
        self._press(view, rows)
        touching = self._lasting_touches()
        self._dirty_before = {p: self._dirty_before.get(p, frozenset(before)) for p in touching}
        self._dirty = self._raw | (before - washed)
        self._spread(view, rows)
        return self._row()

    def _press(self, view: View, rows: range) -> None:
        """Since when parts and carriers press on one another."""
        contacts = view.trace.steps.contacts
        pressing = {_pair(contacts.a[r], contacts.b[r]) for r in rows
                    if contacts.peak[r] >= self._force}  # fmt: skip
        self._lasting = {pair: self._lasting.get(pair, 0) + 1 for pair in pressing}
        pairs = {_pair(self._carrier[a], self._carrier[b]) for a, b in pressing}
        self._touching = {
            pair: self._touching.get(pair, 0) + 1
            for pair in pairs
            if pair[0] >= 0 and pair[0] != pair[1]
        }

    def _lasting_touches(self) -> list[_Pair]:
        return [pair for pair, steps in self._touching.items() if steps >= self._count]

    def _spread(self, view: View, rows: range) -> None:
        """From the contaminated to what they touch, and on, until nothing more is reached."""
        touching = self._lasting_touches()
        surfaces = list(self._on_surfaces(view, rows))
        while True:
            reached = {n for pair in touching if self._dirty & set(pair) for n in pair}
            for carrier, surface, point in surfaces:
                if carrier in self._dirty:
                    self._spots.setdefault(surface, set()).add(point)
            reached |= {c for c, surface, point in surfaces if self._is_marked(surface, point)}
            if reached <= self._dirty:
                return
            self._dirty |= reached

    def _is_marked(self, surface: int, point: _Point) -> bool:
        spots = self._spots.get(surface, ())
        return any(math.dist(point, spot) <= self._radius for spot in spots)

    def _on_surfaces(self, view: View, rows: range) -> list[tuple[int, int, _Point]]:
        """(carrier, surface part, place) of lasting touches between a carrier and a surface."""
        contacts, found = view.trace.steps.contacts, []
        for row in rows:
            a, b = int(contacts.a[row]), int(contacts.b[row])
            if self._lasting.get(_pair(a, b), 0) < self._count:
                continue
            if (self._carrier[a] >= 0) == (self._carrier[b] >= 0):
                continue
            own, surface = (a, b) if self._carrier[a] >= 0 else (b, a)
            if surface not in self._robot:
                # A part that a joint moves, such as a door's handle, is one spot.
                place = contacts.position[row].tolist()
                point = (0.0, 0.0, 0.0) if self._moves[surface] else tuple(place)
                found.append((self._carrier[own], surface, point))
        return found

    def _row(self) -> Bools:
        size = len(self._names)
        row = np.zeros((size, 1 + size), bool)
        row[list(self._dirty), 0] = True
        for a, b in self._lasting_touches():
            for carrier, other in ((a, b), (b, a)):
                was_clean = other in self._clean and other not in self._dirty_before[a, b]
                row[carrier, 1 + other] = other in self._ready or was_clean
        return row


def _pair(a: int, b: int) -> _Pair:
    return (int(a), int(b)) if a <= b else (int(b), int(a))
