"""The input of propositions: a scene, its steps, and contacts by pair of parts."""

from __future__ import annotations

from collections.abc import Iterator, Set
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Floats, Steps


@dataclass(frozen=True)
class Trace:
    """A scene and its steps, which propositions are evaluated on."""

    scene: Scene
    steps: Steps

    def __len__(self) -> int:
        return len(self.steps)

    @property
    def dt(self) -> float:
        """Control period, s."""
        return self.scene.control_period

    def count(self, seconds: float) -> int:
        """A duration in control periods, rounded to the nearest, at least one."""
        return max(1, round(seconds / self.dt))

    @cached_property
    def pair_codes(self) -> NDArray[np.int64]:
        """A number for the pair of parts of each contact, whichever comes first (R,).

        ``divmod`` with the number of parts gives the pair back, the lower index first.
        """
        contacts = self.steps.contacts
        codes = np.minimum(contacts.a, contacts.b).astype(np.int64)
        codes *= len(self.scene.parts)
        codes += np.maximum(contacts.a, contacts.b)
        return codes

    @cached_property
    def pair_table(self) -> PairTable:
        """Contacts by pair of parts, computed once for all propositions."""
        return PairTable(self)


class PairTable:
    """Sustained normal force of every pair of parts over time, in newtons.

    Args:
        trace: gives parts and contacts.
    """

    def __init__(self, trace: Trace) -> None:
        self._length, self._parts = len(trace), len(trace.scene.parts)
        self._codes = key = trace.pair_codes
        contacts, parts = trace.steps.contacts, self._parts
        touch, place = np.zeros(parts * parts, bool), np.zeros(parts * parts, np.int64)
        touch[key] = True  # sorting takes several times as long
        found = np.flatnonzero(touch)
        place[found] = np.arange(len(found)) * self._length
        force = np.zeros((len(found), self._length), np.float32)
        np.maximum.at(force.ravel(), place[key] + contacts.step, contacts.sustained)
        self._pairs = {divmod(k, parts): row for k, row in zip(found.tolist(), force, strict=True)}
        self._highest = force.max(axis=1)

    def __iter__(self) -> Iterator[tuple[tuple[int, int], Floats]]:
        """Pairs of part indices (lower first) that touch at all, with their force (T,)."""
        return iter(self._pairs.items())

    def reaching(self, limit: float) -> Iterator[tuple[tuple[int, int], Floats]]:
        """Pairs whose force reaches a limit (N) at some step, with their force (T,)."""
        reach = (self._highest >= limit).tolist()
        return (pair for pair, hard in zip(self._pairs.items(), reach, strict=True) if hard)

    def rows(self, side: Set[int], other: Set[int]) -> NDArray[np.intp]:
        """Contact rows between a part of ``side`` and one of ``other`` (K,)."""
        chosen = [a * self._parts + b for a, b in self._between(side, other)]
        if not chosen:
            return np.empty(0, np.intp)
        wanted = np.zeros(self._parts**2, bool)
        wanted[chosen] = True
        return np.flatnonzero(wanted[self._codes])

    def force(self, side: Set[int], other: Set[int]) -> Floats:
        """Largest sustained force between a part of ``side`` and one of ``other`` (T,)."""
        result = np.zeros(self._length, np.float32)
        for pair in self._between(side, other):
            np.maximum(result, self._pairs[pair], out=result)
        return result

    def _between(self, side: Set[int], other: Set[int]) -> list[tuple[int, int]]:
        return [
            (a, b)
            for a, b in self._pairs
            if (a in side and b in other) or (b in side and a in other)
        ]
