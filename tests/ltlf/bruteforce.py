"""LTLf by its definition: what the engine is judged by."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pytest_safemanip.ltlf import (
    Always,
    And,
    Atom,
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
from pytest_safemanip.ltlf.formula import Bounded


def holds(formula: Formula, trace: Sequence[int], atoms: Sequence[str]) -> bool:
    """Whether a trace of letters satisfies a formula."""
    return truth(formula, trace, atoms)[0]


def truth(
    formula: Formula, trace: Sequence[int], atoms: Sequence[str], running: int | None = None
) -> list[bool]:
    """Value of a formula at every step, straight from the definition of each operator.

    A step is a second: bounds are rounded outwards to whole ones. After the first `running` steps
    clocks stand.
    """
    end = len(trace)
    steps = range(end)
    p, q = ([truth(part, trace, atoms, running) for part in formula.operands] + [[], []])[:2]
    match formula:
        case Constant(value):
            return [value for _ in steps]
        case Last():
            return [t == end - 1 for t in steps]
        case Atom(name):
            return [bool(trace[t] >> atoms.index(name) & 1) for t in steps]
        case Not():
            return [not p[t] for t in steps]
        case And():
            return [p[t] and q[t] for t in steps]
        case Or():
            return [p[t] or q[t] for t in steps]
        case Implies():
            return [not p[t] or q[t] for t in steps]
        case Iff():
            return [p[t] == q[t] for t in steps]
        case Next():
            return [t + 1 < end and p[t + 1] for t in steps]
        case WeakNext():
            return [t + 1 == end or p[t + 1] for t in steps]
        case Eventually():
            return [any(p[u] for u in range(t, end)) for t in steps]
        case Always():
            return [all(p[u] for u in range(t, end)) for t in steps]
        case Until():
            return [any(q[u] and all(p[t:u]) for u in range(t, end)) for t in steps]
        case WeakUntil():
            return [all(p[t:]) or any(q[u] and all(p[t:u]) for u in range(t, end)) for t in steps]
        case Release():
            return [all(q[u] or any(p[t:u]) for u in range(t, end)) for t in steps]
        case Bounded(core, bound):
            first, final = math.floor(bound.low), math.ceil(bound.high)
            clock = [t if running is None else min(t, running) for t in steps]
            passed = [[clock[u] - clock[t] for u in steps] for t in steps]
            near = [[u for u in range(t, end) if passed[t][u] <= final] for t in steps]
            within = [[u for u in near[t] if passed[t][u] >= first] for t in steps]
            match core:
                case Eventually():
                    return [any(p[u] for u in within[t]) for t in steps]
                case Always():
                    return [all(p[u] for u in within[t]) for t in steps]
                case Until() | WeakUntil():
                    until = [any(q[u] and all(p[t:u]) for u in within[t]) for t in steps]
                    weak = isinstance(core, WeakUntil)
                    return [until[t] or (weak and all(p[u] for u in near[t])) for t in steps]
    raise AssertionError(formula)
