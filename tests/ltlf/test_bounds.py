"""Bounds in seconds: their meaning, against the definition of MTL over finite traces."""

from __future__ import annotations

import itertools
import os
import random

from pytest_safemanip.ltlf import (
    Always,
    And,
    Atom,
    Eventually,
    Formula,
    FormulaError,
    Implies,
    Next,
    Not,
    Or,
    Release,
    StateClass,
    Until,
    WeakNext,
    WeakUntil,
    compile_formula,
    parse,
)
from pytest_safemanip.ltlf.formula import Bound, bounded, is_bounded
from tests.ltlf.bruteforce import holds

ATOMS = ("a", "b")
EXAMPLES = int(os.environ.get("SAFEMANIP_LTLF_EXAMPLES", "600"))
LONGEST = 4  # steps that continuations are tried for; no bound drawn for them reaches further


def drawn(draw: random.Random, depth: int, longest: int) -> Formula:
    """A random formula, half of whose timed operators have bounds up to so many seconds."""
    if depth == 0 or draw.random() < 0.1:
        return Atom(draw.choice(ATOMS))
    left = drawn(draw, depth - 1, longest)
    if draw.random() < 0.5:
        unary = draw.choice((Eventually, Always, Eventually, Always, Not, Next, WeakNext))(left)
        core: Formula = unary
    else:
        node = draw.choice((Until, WeakUntil, Until, WeakUntil, And, Or, Implies, Release))
        core = node(left, drawn(draw, depth - 1, longest))
    if isinstance(core, Eventually | Always | Until | WeakUntil) and draw.random() < 0.7:
        low, high = sorted(round(draw.uniform(0, longest), 1) for _ in range(2))
        return bounded(core, Bound(draw.choice((0.0, low)), high))
    return core


def bounded_formulas(count: int, depth: int, longest: int) -> list[Formula]:
    """Random formulas, each with a bound."""
    draw, found = random.Random(depth), list[Formula]()  # noqa: S311 (no secret)
    while len(found) < count:
        formula = drawn(draw, depth, longest)
        if is_bounded(formula):
            found.append(formula)
    return found


def test_random_bounded_formulas_accept_what_the_definition_accepts() -> None:
    draw = random.Random(1)  # noqa: S311 (no secret)
    refused = 0
    for formula in bounded_formulas(EXAMPLES, 3, 4):
        try:
            dfa = compile_formula(formula, atoms=ATOMS, dt=1.0, cache=False)
        except FormulaError:  # more states than the limit
            refused += 1
            continue
        assert parse(str(formula)) == formula
        for _ in range(12):
            trace = [draw.randrange(4) for _ in range(draw.randint(1, 12))]
            assert dfa.accepts(trace) == holds(formula, trace, ATOMS), (str(formula), trace)
    assert refused <= EXAMPLES // 50


def test_a_bad_prefix_is_one_that_no_continuation_is_accepted_after() -> None:
    draw = random.Random(2)  # noqa: S311 (no secret)
    for formula in bounded_formulas(EXAMPLES // 10, 2, 2):
        dfa = compile_formula(formula, atoms=ATOMS, dt=1.0, cache=False)
        for _ in range(2):
            prefix = [draw.randrange(4) for _ in range(draw.randint(1, 4))]
            values = {holds(formula, prefix + list(more), ATOMS) for more in continuations()}
            expected = {(True,): StateClass.TRUE, (False,): StateClass.FALSE}.get(tuple(values))
            if expected is None:
                now = holds(formula, prefix, ATOMS)
                expected = StateClass.CURRENTLY_TRUE if now else StateClass.CURRENTLY_FALSE
            found = dfa.classes[dfa.states(prefix)[-1]]
            assert found is expected, (str(formula), prefix)


def continuations() -> list[tuple[int, ...]]:
    """Every way to go on for a few steps, the end among them."""
    return [x for n in range(LONGEST + 1) for x in itertools.product(range(4), repeat=n)]
