"""LTLf by its definition, and random formulas: what the engine is judged by."""

from __future__ import annotations

from collections.abc import Sequence

from hypothesis import strategies as st

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

UNARY = (Not, Next, WeakNext, Eventually, Always)
BINARY = (And, Or, Implies, Iff, Until, WeakUntil, Release)


def holds(formula: Formula, trace: Sequence[int], atoms: Sequence[str]) -> bool:
    """Whether a trace of letters satisfies a formula."""
    return truth(formula, trace, atoms)[0]


def truth(formula: Formula, trace: Sequence[int], atoms: Sequence[str]) -> list[bool]:
    """Value of a formula at every step, straight from the definition of each operator."""
    end = len(trace)
    steps = range(end)
    p, q = ([truth(part, trace, atoms) for part in formula.operands] + [[], []])[:2]
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
    raise AssertionError(formula)


def formulas(depth: int, atoms: Sequence[str] = ("a", "b", "c")) -> st.SearchStrategy[Formula]:
    """Random formulas with operators nested up to `depth` deep."""
    names = st.sampled_from(atoms).map(Atom)
    found = names | st.sampled_from([Constant(True), Constant(False), Last()])
    for _ in range(depth):
        unary = st.builds(lambda node, p: node(p), st.sampled_from(UNARY), found)
        binary = st.builds(lambda node, p, q: node(p, q), st.sampled_from(BINARY), found, found)
        found = names | unary | binary
    return found


def traces(atoms: int = 3, max_steps: int = 7, min_steps: int = 1) -> st.SearchStrategy[list[int]]:
    """Random non-empty traces of letters."""
    return st.lists(st.integers(0, (1 << atoms) - 1), min_size=min_steps, max_size=max_steps)
