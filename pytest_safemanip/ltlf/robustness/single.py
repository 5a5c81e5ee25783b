"""Robustness on one step, whatever came before it: what that step alone makes of a formula."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pytest_safemanip.ltlf.formula import (
    Always,
    And,
    Atom,
    Bounded,
    Constant,
    Eventually,
    Formula,
    Iff,
    Implies,
    Last,
    Next,
    Not,
    Or,
    Release,
    Until,
    WeakNext,
    WeakUntil,
)
from pytest_safemanip.ltlf.robustness.offline import INFINITE, Margins


def step_robustness(
    formula: Formula, margins: Mapping[str, Margins], dt: float, *, goes_on: bool
) -> Margins:
    """The robustness of a formula on each of some steps alone (K,).

    Args:
        formula: what is asked from that step on.
        margins: of each atom, positive where it is true (K,).
        dt: control period in seconds.
        goes_on: whether the trace goes on in the best way for the formula, so that it is negative
            where nothing can make the step good; False if the trace ends with it.
    """
    return _Steps(margins, dt, goes_on).of(formula, best=True)


class _Steps:
    """Steps, and what formulas are worth on each of them.

    Args:
        margins: of each atom (K,).
        dt: control period in seconds.
        goes_on: whether the trace goes on.
    """

    def __init__(self, margins: Mapping[str, Margins], dt: float, goes_on: bool) -> None:
        self._margins, self._dt, self._goes_on = margins, dt, goes_on
        self._like = np.zeros(len(next(iter(margins.values()), ())))

    def of(self, formula: Formula, best: bool) -> Margins:
        """The robustness of a formula (K,).

        Args:
            formula: the formula.
            best: whether what comes is as large as can be, or as small.
        """
        match formula:
            case Constant(value):
                return self._all(INFINITE if value else -INFINITE)
            case Last():
                return self._all(-INFINITE if self._goes_on else INFINITE)
            case Atom(name):
                return np.asarray(self._margins[name], np.float64)
            case Not(p):
                return -self.of(p, not best)
            case And(p, q):
                return np.minimum(self.of(p, best), self.of(q, best))
            case Or(p, q):
                return np.maximum(self.of(p, best), self.of(q, best))
            case Implies(p, q):
                return np.maximum(-self.of(p, not best), self.of(q, best))
            case Iff(p, q):
                return self.of(And(Implies(p, q), Implies(q, p)), best)
            case Next() | WeakNext():
                return self._rest(best, isinstance(formula, WeakNext))
            case Bounded(core, bound):
                low, high = bound.steps(self._dt)
                return self._clocked(core, low, high, best)
        weak = not isinstance(formula, Eventually | Until)
        return self._unrolled(formula, self._rest(best, weak), best)

    def _clocked(self, core: Formula, low: int, high: int, best: bool) -> Margins:
        weak = not isinstance(core, Eventually | Until)
        over = self._all(INFINITE if weak else -INFINITE)
        rest = self._rest(best, weak) if high else over
        if not low:
            return self._unrolled(core, rest, best)
        match core:
            case Until(p, _) | WeakUntil(p, _):
                return np.minimum(self.of(p, best), rest)
        return rest

    def _unrolled(self, core: Formula, rest: Margins, best: bool) -> Margins:
        """A temporal operator, given what the steps to come make of it."""
        match core:
            case Eventually(p):
                return np.maximum(self.of(p, best), rest)
            case Always(p):
                return np.minimum(self.of(p, best), rest)
            case Until(p, q) | WeakUntil(p, q):
                return np.maximum(self.of(q, best), np.minimum(self.of(p, best), rest))
            case Release(p, q):
                return np.minimum(self.of(q, best), np.maximum(self.of(p, best), rest))
        raise AssertionError(f"no robustness of {type(core).__name__}")

    def _rest(self, best: bool, weak: bool) -> Margins:
        """What a formula is worth from the next step on."""
        return self._all(INFINITE if (best if self._goes_on else weak) else -INFINITE)

    def _all(self, value: float) -> Margins:
        return np.full_like(self._like, value)
