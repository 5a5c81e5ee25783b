"""Hypothesis strategies for LTLf formulas and the traces that they are read on."""

from __future__ import annotations

from collections.abc import Sequence

from hypothesis import strategies as st

from pytest_safemanip.ltlf.formula import (
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


def formulas(depth: int = 3, atoms: Sequence[str] = ("a", "b", "c")) -> st.SearchStrategy[Formula]:
    """Formulas whose operators are nested up to ``depth`` deep."""
    names = st.sampled_from(atoms).map(Atom)
    found: st.SearchStrategy[Formula] = names | st.sampled_from(
        [Constant(True), Constant(False), Last()]
    )
    for _ in range(depth):
        unary = st.builds(lambda node, p: node(p), st.sampled_from(UNARY), found)
        binary = st.builds(lambda node, p, q: node(p, q), st.sampled_from(BINARY), found, found)
        found = names | unary | binary
    return found


def traces(atoms: int = 3, max_steps: int = 7, min_steps: int = 1) -> st.SearchStrategy[list[int]]:
    """Traces as bitmasks, one for each step: bit k is the value of the k-th atom."""
    return st.lists(st.integers(0, (1 << atoms) - 1), min_size=min_steps, max_size=max_steps)
