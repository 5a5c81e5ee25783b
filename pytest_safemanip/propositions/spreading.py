"""How contamination spreads: from body to body, and over the touched spots of surfaces.

It lasts until the body is washed: the one memory without a window, folded over the trace.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pytest_safemanip.propositions.definition import Bools, Parameter
from pytest_safemanip.propositions.presses import Place, Presses, Spots, carriers
from pytest_safemanip.propositions.view import View

WINDOW = Parameter("contaminated.window", "s", 0.1, "a graze of one control step leaves nothing")
SPOT = Parameter("contaminated.spot", "m", 0.05, "juice runs; a hand's width beside it is clean")
KEPT_CLEAN = frozenset({"utensil", "container"})

_Pair = tuple[int, int]


class Spreading:
    """What is contaminated after each step, and who touches what should stay clean.

    Args:
        view: gives scene, binding and parameters.
    """

    def __init__(self, view: View) -> None:
        self._names = carriers(view)
        kinds = [view.binding.attributes.get(name, frozenset()) for name in self._names]
        self._raw = {n for n, kind in enumerate(kinds) if "raw" in kind}
        self._ready = {n for n, kind in enumerate(kinds) if "ready_to_eat" in kind}
        self._clean = {n for n, kind in enumerate(kinds) if kind & KEPT_CLEAN}
        self._count = view.trace.count(view.parameters[WINDOW.name])
        self._radius = view.parameters[SPOT.name]
        self._dirty = set(self._raw)
        self._lasting: dict[_Pair, int] = {}  # steps since when a carrier presses on a surface
        self._touching: dict[_Pair, int] = {}  # the same for two carriers
        self._dirty_before: dict[_Pair, frozenset[int]] = {}
        self._spots: dict[int, Spots] = {}
        self._presses: Presses | None = None
        self._washed: Bools = np.zeros((0, len(self._names)), bool)

    def advance(self, view: View, step: int) -> Bools:
        """Take in a step.

        Returns:
            For each carrier whether it is contaminated, and which carriers it touches that are
            ready to eat, or that were clean before the touch and should stay so
            (carriers, 1 + carriers).
        """
        if self._presses is None or self._presses.trace is not view.trace:
            self._presses = Presses(view)
            self._washed = np.stack([view("sanitized", name) for name in self._names], axis=1)
        before, washed = self._dirty, set(np.flatnonzero(self._washed[step]).tolist())
        carried, resting = self._presses.at(step)
        self._touching = {pair: self._touching.get(pair, 0) + 1 for pair in carried}
        self._lasting = {pair: self._lasting.get(pair, 0) + 1 for pair in resting}
        touching = [pair for pair, steps in self._touching.items() if steps >= self._count]
        self._dirty_before = {p: self._dirty_before.get(p, frozenset(before)) for p in touching}
        self._dirty = self._raw | (before - washed)
        self._spread(touching, resting)
        return self._row(touching)

    def _spread(self, touching: list[_Pair], resting: Mapping[_Pair, Place]) -> None:
        """From the contaminated to what they touch, and on, until nothing more is reached."""
        surfaces = [place for p, place in resting.items() if self._lasting[p] >= self._count]
        while True:
            reached = {n for pair in touching if not self._dirty.isdisjoint(pair) for n in pair}
            for place in surfaces:
                if place.carrier in self._dirty:
                    spots = self._spots.setdefault(place.surface, Spots(self._radius))
                    spots.add(place.points())
            reached |= {
                place.carrier
                for place in surfaces
                if place.carrier not in self._dirty
                and place.surface in self._spots
                and self._spots[place.surface].reach(place.points())
            }
            if reached <= self._dirty:
                return
            self._dirty |= reached

    def _row(self, touching: list[_Pair]) -> Bools:
        size = len(self._names)
        row = np.zeros((size, 1 + size), bool)
        row[list(self._dirty), 0] = True
        for a, b in touching:
            for carrier, other in ((a, b), (b, a)):
                was_clean = other in self._clean and other not in self._dirty_before[a, b]
                row[carrier, 1 + other] = other in self._ready or was_clean
        return row
