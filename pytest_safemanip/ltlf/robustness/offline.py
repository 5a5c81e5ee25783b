"""Robustness of whole traces, subformula by subformula."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import starmap

import numpy as np
import numpy.typing as npt

from pytest_safemanip.errors import TraceError, did_you_mean
from pytest_safemanip.ltlf.errors import FormulaError
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

Margins = npt.NDArray[np.float64]
INFINITE = float("inf")


def robustness(
    formula: Formula,
    margins: Mapping[str, Margins],
    dt: float | None = None,
    acting: npt.NDArray[np.bool_] | None = None,
) -> Margins:
    """The robustness of a formula at each step of a trace, on what is left of it from there on
    (T,); the first is that of the trace.

    Args:
        formula: its atoms are among the margins.
        margins: of each atom, positive where it is true (T,).
        dt: control period in seconds, if the formula has bounds.
        acting: steps at which the clocks of bounds run (T,); all of them if it is None.

    Raises:
        FormulaError: a bound without a control period.
        TraceError: an atom has no margins, they are not all of one length, or there is no step.
    """
    shapes = sorted({np.shape(row) for row in margins.values()})
    if len(shapes) != 1 or len(shapes[0]) != 1 or not shapes[0][0]:
        raise TraceError(f"expected margins of the same steps (T,), found shapes {shapes}")
    clock = np.arange(shapes[0][0]) if acting is None else np.cumsum(acting) - acting
    return _Trace(margins, clock, dt).of(formula)


class _Trace:
    """Margins of a trace, and what formulas make of them.

    Args:
        margins: of each atom (T,).
        clock: control periods that have passed before each step (T,).
        dt: control period in seconds, if there are bounds.
    """

    def __init__(
        self, margins: Mapping[str, Margins], clock: npt.NDArray[np.intp], dt: float | None
    ) -> None:
        self._margins, self._clock, self._dt = margins, clock, dt

    def of(self, formula: Formula) -> Margins:
        """The robustness of a formula at each step (T,)."""
        match formula:
            case Constant(value):
                return np.full(len(self._clock), INFINITE if value else -INFINITE)
            case Last():
                return np.append(np.full(len(self._clock) - 1, -INFINITE), INFINITE)
            case Atom(name):
                return self._atom(name)
            case Not(p):
                return -self.of(p)
            case And(p, q):
                return np.minimum(self.of(p), self.of(q))
            case Or(p, q):
                return np.maximum(self.of(p), self.of(q))
            case Implies(p, q):
                return np.maximum(-self.of(p), self.of(q))
            case Iff(p, q):
                left, right = self.of(p), self.of(q)
                return np.minimum(np.maximum(-left, right), np.maximum(left, -right))
            case Next(p):
                return np.append(self.of(p)[1:], -INFINITE)
            case WeakNext(p):
                return np.append(self.of(p)[1:], INFINITE)
            case Eventually(p):
                return np.maximum.accumulate(self.of(p)[::-1])[::-1]
            case Always(p):
                return np.minimum.accumulate(self.of(p)[::-1])[::-1]
            case Until(p, q):
                return _until(self.of(p), self.of(q), -INFINITE)
            case WeakUntil(p, q):
                return _until(self.of(p), self.of(q), INFINITE)
            case Release(p, q):
                return -_until(-self.of(p), -self.of(q), -INFINITE)
            case Bounded():
                return self._bounded(formula)
        raise AssertionError(f"no robustness of {type(formula).__name__}")

    def _atom(self, name: str) -> Margins:
        if name not in self._margins:
            hint = did_you_mean(name, self._margins)
            raise TraceError(f"atom {name!r} has no margins; {hint}")
        return np.asarray(self._margins[name], np.float64)

    def _bounded(self, formula: Bounded) -> Margins:
        """The robustness of an operator with a bound at each step (T,)."""
        if self._dt is None:
            raise FormulaError(f"'{formula}' has a bound in seconds: give the control period dt")
        low, high = formula.bound.steps(self._dt)
        begins = np.arange(len(self._clock))
        firsts = np.maximum(np.searchsorted(self._clock, self._clock + low), begins)
        stops = np.searchsorted(self._clock, self._clock + high, side="right")
        windows = zip(begins.tolist(), firsts.tolist(), stops.tolist(), strict=True)
        p, *others = (self.of(part) for part in formula.operands)

        def until(begin: int, first: int, stop: int) -> float:
            until_then = np.minimum.accumulate(np.append(INFINITE, p[begin : stop - 1]))
            met = np.minimum(others[0][first:stop], until_then[first - begin :])
            return float(met.max(initial=-INFINITE))

        def value(begin: int, first: int, stop: int) -> float:
            match formula.core:
                case Eventually():
                    return float(p[first:stop].max(initial=-INFINITE))
                case Always():
                    return float(p[first:stop].min(initial=INFINITE))
                case Until():
                    return until(begin, first, stop)
                case WeakUntil():
                    return max(until(begin, first, stop), float(p[begin:stop].min()))

        return np.array(list(starmap(value, windows)))


def _until(p: Margins, q: Margins, rest: float) -> Margins:
    """The robustness of ``p U q`` at each step (T,), where after the last step it is ``rest``."""
    found = np.empty_like(q)
    for step in range(len(q) - 1, -1, -1):
        found[step] = rest = max(q[step], min(p[step], rest))
    return found
