"""Contacts that exist before the robot moves: an open drawer that stands against its base.

Nobody brought them about, so they are no violation until they break.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.trace import Trace

Codes = NDArray[np.int64]
Forces = NDArray[np.float32]
BROKEN = -1


class AtStart:
    """Which pairs of parts have touched since the first step without a break.

    The first step of a trace is the state after the first control period, in which a robot that
    was at rest comes no further than a few millimetres.

    Args:
        view: gives scene and binding.
    """

    def __init__(self, view: View) -> None:
        self._entity = [part.entity for part in view.trace.scene.parts]
        supports = view.binding.supports
        self._fine = {o: {ROBOT, *supports.get(o, ())} for o in view.binding.objects}
        self._pairs: Codes | None = None
        self._column: NDArray[np.intp] = np.full(len(self._entity) ** 2, BROKEN)  # of each pair
        self._lasting: Bools = np.empty(0, bool)

    def advance(self, view: View) -> Codes:
        """Take in steps.

        Returns:
            After each, the codes (:attr:`Trace.pair_codes`) of the pairs that touch at the first
            step and could be a collision; -1 for those that broke (T, K).
        """
        rows, size = view.trace.steps.contacts, len(self._entity)
        codes = view.trace.pair_codes
        if self._pairs is None:
            first = np.unique(codes[slice(*rows.span(0, 1))])
            self._pairs = first[[self._matters(*divmod(c, size)) for c in first.tolist()]]
            self._lasting = np.ones(len(self._pairs), bool)
            self._column[self._pairs] = np.arange(len(self._pairs))
        there = np.zeros((len(view.trace), len(self._pairs)), bool)
        column = self._column[codes]
        touch = np.flatnonzero(column != BROKEN)
        there[rows.step[touch], column[touch]] = True
        there[0] &= self._lasting
        lasting = np.logical_and.accumulate(there)
        self._lasting = lasting[-1]
        return np.where(lasting, self._pairs, BROKEN)

    def _matters(self, a: int, b: int) -> bool:
        sides = self._entity[a], self._entity[b]
        return ROBOT in sides or any(
            own in self._fine and other not in self._fine[own]
            for own, other in (sides, sides[::-1])
        )


def fresh(trace: Trace, pair: tuple[int, int], force: Forces, since_start: Codes) -> Forces:
    """The force of a pair of parts, 0 as long as they have touched from the first step on (T,).

    Args:
        trace: gives the parts.
        pair: indices of two parts, the lower first.
        force: their sustained force, N (T,).
        since_start: what :class:`AtStart` knows (T, K).
    """
    lower, higher = pair
    lasting = np.equal(since_start, lower * len(trace.scene.parts) + higher).any(axis=1)
    return np.where(lasting, np.float32(0.0), force) if lasting.any() else force
