"""Spreading of contamination, from body to body and over touched spots of surfaces.

It lasts until the body is washed: the one memory without a window, folded over the trace.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools, Parameter
from pytest_safemanip.propositions.kernels.presses import Presses, PressingParts, carriers
from pytest_safemanip.propositions.kernels.spots import Place, Spots, may_meet
from pytest_safemanip.propositions.view import View

WINDOW = Parameter("contaminated.window", "s", 0.1, "a graze of one control step leaves nothing")
SPOT = Parameter("contaminated.spot", "m", 0.05, "juice runs; a hand's width beside it is clean")
KEPT_CLEAN = frozenset({"utensil", "container"})
STAYED = 0.01
"""What is less than this from where it was at the first step still stands there, m."""

Floats = NDArray[np.float64]
_Pair = tuple[int, int]
_Touch = tuple[PressingParts, Place, bool]
"""Whose parts, where, and whether the carrier has stood there from the first step on."""


class Spreading:
    """Contaminated bodies after each step, and contacts with what should stay clean.

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
        # When it reached a carrier: the step, and how many others it came through at that step.
        self._reached_at = dict.fromkeys(self._raw, (-1, 0))
        self._spots: dict[int, Spots] = {}
        self._spots_at_first: dict[int, Spots] = {}  # of what has stood there from the first step
        self._places_at_first: Floats = np.empty((0, 3))
        self._touched_at_first: set[_Pair] = set()
        self._stayed: Bools = np.empty((0, 0), bool)
        self._washed: Bools = np.empty((0, 0), bool)
        self._breaks: NDArray[np.intp] = np.empty(0, np.intp)  # where one of these changes
        self._now = -1
        self._parts: list[_Pair] = []
        self._changed = 0  # the step at which other parts began to press
        self._since: dict[_Pair, int] = {}  # when two carriers began to press on one another
        self._lasting: dict[_Pair, int] = {}  # the same for a carrier's part and a surface
        self._touching: list[_Pair] = []
        self._dirty_before: dict[_Pair, frozenset[int]] = {}
        self._resting: list[tuple[int, PressingParts]] = []
        self._known = self._row()

    def advance(self, view: View) -> Bools:
        """Take in steps.

        Returns:
            After each, for each carrier whether it is contaminated, and which carriers it touches
            that are ready to eat, or that were clean before the touch and should stay so
            (T, carriers, 1 + carriers).
        """
        presses, steps = Presses(view), len(view.trace)
        # What stands there lightly presses hard enough only when it is taken hold of.
        self._touched_at_first |= presses.touching(max(0, self._count - self._now - 1))
        self._washed = np.stack([view("sanitized", name) for name in self._names], axis=1)
        places = view.trace.steps.object_pose[:, :, :3].astype(float)
        if self._now < 0:
            self._places_at_first = places[0]
        moved = places - self._places_at_first
        self._stayed = np.linalg.norm(moved, axis=-1) < STAYED
        changed = (self._stayed[1:] != self._stayed[:-1]).any(axis=1)
        changed |= self._washed[1:].any(axis=1)
        self._breaks = np.append(np.flatnonzero(changed) + 1, steps)
        known = np.empty((steps, *self._known.shape), bool)
        step = 0
        while step < steps:
            stop = self._quiet_until(presses, step)
            if self._pass(presses, step, stop):
                known[step:stop] = self._known
            else:
                stop = max(stop, step + 1)
                known[step:stop] = [self._take(presses, now) for now in range(step, stop)]
            step = stop
        return known

    def _quiet_until(self, presses: Presses, step: int) -> int:
        """One after the last step from here on throughout which the same parts press, for long
        enough already, and nothing is washed or set in motion; this step if there is none.
        """
        lasts = self._now + 1 >= self._changed + self._count
        if not lasts or self._washed[step].any() or presses.parts(step) != self._parts:
            return step
        if step + 1 == len(self._washed):
            return step + 1
        next_break = self._breaks[np.searchsorted(self._breaks, step, side="right")]
        return min(presses.until(step), int(next_break))

    def _pass(self, presses: Presses, step: int, stop: int) -> bool:
        """Take in quiet steps at once, unless something clean may meet a mark in them."""
        if stop == step:
            return False
        touches = self._touches(presses, step, stop)
        dirty = [touch for touch in touches if touch[0].carrier in self._dirty]
        for clean in touches:
            if clean[0].carrier not in self._dirty and self._may_reach(clean, dirty):
                return False
        self._mark(touches)
        self._now += stop - step
        return True

    def _take(self, presses: Presses, step: int) -> Bools:
        """Take in one of them."""
        before = self._dirty
        self._now += 1
        parts = presses.parts(step)
        if parts != self._parts:
            self._parts, self._changed = parts, self._now
            self._follow(presses)
        news = self._now < self._changed + self._count
        if news:  # after that, who touches whom for long enough stays the same
            self._touch(presses, before)
        washed = self._washed[step]
        if washed.any():
            self._dirty = self._raw | (before - set(np.flatnonzero(washed).tolist()))
            news = True
        touches = self._touches(presses, step, step + 1)
        clean = [touch for touch in touches if touch[0].carrier not in before]
        if news or any(map(self._reached, clean)):
            self._spread(touches)
            self._known = self._row()
        else:
            self._mark(touches)
        return self._known

    def _touches(self, presses: Presses, step: int, stop: int) -> list[_Touch]:
        """Contacts of carriers with surfaces, while the same carriers are at rest."""
        stayed, first = self._stayed[step], self._touched_at_first
        return [
            (
                press,
                presses.place(number, press, step, stop),
                press.carrier > 0
                and bool(stayed[press.carrier - 1])
                and self._parts[number] in first,
            )
            for number, press in self._resting
        ]

    def _marked(self, touch: _Touch) -> Iterator[Spots]:
        """The marked points of a surface that can contaminate a carrier."""
        press, _, at_first = touch
        for spots in [self._spots] if at_first else [self._spots, self._spots_at_first]:
            if press.surface in spots:
                yield spots[press.surface]

    def _reached(self, touch: _Touch) -> bool:
        """Whether a surface is marked where a carrier touches it."""
        return any(spots.reach(touch[1]) for spots in self._marked(touch))

    def _may_reach(self, clean: _Touch, dirty: list[_Touch]) -> bool:
        """Whether a surface may be marked, or be about to be, where a clean carrier touches it."""
        press, place, at_first = clean
        return any(spots.near(place) for spots in self._marked(clean)) or any(
            other.surface == press.surface and may_meet(place, mark, self._radius)
            for other, mark, other_at_first in dirty
            if not (at_first and other_at_first)
        )

    def _follow(self, presses: Presses) -> None:
        """Since when who presses on what."""
        found = {parts: presses.press(parts) for parts in self._parts}
        self._since = {
            press.carriers: self._since.get(press.carriers, self._now)
            for press in found.values()
            if press.carriers is not None
        }
        self._lasting = {
            parts: self._lasting.get(parts, self._now)
            for parts, press in found.items()
            if press.carriers is None
        }

    def _touch(self, presses: Presses, before: set[int]) -> None:
        """Who has touched whom, and what, for long enough."""
        ripe = self._now + 1 - self._count
        self._touching = [pair for pair, since in self._since.items() if since <= ripe]
        self._dirty_before = {
            pair: self._dirty_before.get(pair, frozenset(before)) for pair in self._touching
        }
        self._resting = [
            (place, presses.press(parts))
            for place, parts in enumerate(self._parts)
            if parts in self._lasting and self._lasting[parts] <= ripe
        ]

    def _spread(self, touches: list[_Touch]) -> None:
        """From the contaminated to what they touch, and on, until nothing more is reached."""
        dirty = set(self._dirty)
        for links in itertools.count(1):
            self._dirty = dirty
            reached = {n for pair in self._touching if not dirty.isdisjoint(pair) for n in pair}
            self._mark(touches)
            reached |= {
                touch[0].carrier
                for touch in touches
                if touch[0].carrier not in dirty and self._reached(touch)
            }
            if reached <= dirty:
                return
            self._reached_at.update(dict.fromkeys(reached - dirty, (self._now, links)))
            dirty = dirty | reached

    def _mark(self, touches: list[_Touch]) -> None:
        """Leave on surfaces what contaminated carriers press onto them."""
        for press, place, at_first in touches:
            if press.carrier in self._dirty:
                spots = self._spots_at_first if at_first else self._spots
                spots.setdefault(press.surface, Spots(self._radius)).add(place)

    def _row(self) -> Bools:
        size = len(self._names)
        row = np.zeros((size, 1 + size), bool)
        row[list(self._dirty), 0] = True
        for a, b in self._touching:
            for carrier, other in ((a, b), (b, a)):
                was_clean = other in self._clean and other not in self._dirty_before[a, b]
                kept_clean = was_clean and not self._brought_it(other, carrier)
                row[carrier, 1 + other] = other in self._ready or kept_clean
        return row

    def _brought_it(self, other: int, carrier: int) -> bool:
        """Whether contamination reached the other one first: a knife that cuts raw meat soils the
        hand that holds it, not the hand the knife.
        """
        both = {other, carrier} <= self._dirty
        return both and self._reached_at[other] < self._reached_at[carrier]
