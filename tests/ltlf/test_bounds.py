"""Bounds in seconds: their meaning, against the definition of MTL over finite traces."""

from __future__ import annotations

import itertools
import os
import random

import numpy as np
import pytest

from pytest_safemanip.ltlf import (
    Always,
    And,
    Atom,
    DischargedBy,
    Eventually,
    Formula,
    FormulaError,
    Implies,
    Monitor,
    Next,
    Not,
    Or,
    Outcome,
    Release,
    StateClass,
    Until,
    WeakNext,
    WeakUntil,
    compile_formula,
    explain,
    parse,
)
from pytest_safemanip.ltlf.formula import Bound, Bounded, bounded, is_bounded
from tests.ltlf.bruteforce import holds, truth

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
        running, state = draw.randint(0, len(trace)), 0
        for step, letter in enumerate(trace):
            state = (dfa.rows if step < running else dfa.standing_rows)[state][letter]
        expected = truth(formula, trace, ATOMS, running)[0]
        assert bool(dfa.accepting[state]) == expected, (str(formula), trace, running)
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


RELEASE = "G (released -> F[<=5] settled)"


def test_a_bound_is_first_exceeded_at_the_step_where_the_deadline_is() -> None:
    values = np.random.default_rng(0).random((400, 50, 2)) < (0.01, 0.005)
    bound = Monitor(compile_formula(RELEASE, dt=0.05), 50, dt=0.05)
    deadline = Monitor(compile_formula("G (released -> F settled)"), 50, dt=0.05, deadline_s=5.0)
    found = bound.run(values), deadline.run(values)
    firsts = [[v.violations[0].first if v.violations else None for v in x] for x in found]
    assert firsts[0] == firsts[1]
    assert None in firsts[0]
    assert [v.outcome for v in found[0]] == [v.outcome for v in found[1]]


@pytest.mark.parametrize("discharged_by", ["robot", "physics"])
@pytest.mark.parametrize("instances", [3, 40])
def test_step_by_step_in_a_batch_and_partially_bounds_are_judged_the_same(
    instances: int, discharged_by: DischargedBy
) -> None:
    dfa = compile_formula("G (a -> (F[<=0.4] b & !c W[0.1,0.2] b))", dt=0.05)
    draw = np.random.default_rng(1)
    acting = np.arange(60) < 45
    monitor = Monitor(dfa, instances, dt=0.05, discharged_by=discharged_by)
    values = draw.random((60, instances, 3)) < (0.05, 0.1, 0.02)
    partial = monitor.partial()
    for step, acts in zip(values, acting.tolist(), strict=True):
        monitor.step(step, acts)
        partial.step((step @ [1, 2, 4]).tolist(), [0] * instances, acts)
    gathered = Monitor(dfa, instances, dt=0.05, discharged_by=discharged_by).gather(
        60, lambda k, atom, a, b: values[a:b, k, atom]
    )
    whole = monitor.run(values, acting)
    for a, b, c, d in zip(
        whole, monitor.verdicts(), monitor.run(gathered, acting), partial.verdicts(), strict=True
    ):
        assert (a.outcome, a.violations, a.open_since) == (b.outcome, b.violations, b.open_since)
        assert (a.outcome, a.violations, a.open_since) == (c.outcome, c.violations, c.open_since)
        assert (a.outcome, tuple(a.unsafe.tolist())) == (d.outcome, d.unsafe)
        for violation in a.violations:
            assert explain(dfa, values[:, int(a.instance)], a, violation).deciding  # type: ignore[call-overload]


def test_the_clock_stands_in_the_tail_if_the_robot_owes_and_runs_if_physics_does() -> None:
    dfa = compile_formula(RELEASE, dt=0.05)
    values = np.zeros((200, 1, 2), dtype=bool)
    values[10, 0, 0] = True
    acting = np.arange(200) < 60
    (robot,) = Monitor(dfa, dt=0.05).run(values, acting)
    (physics,) = Monitor(dfa, dt=0.05, discharged_by="physics").run(values, acting)
    assert (robot.outcome, robot.open_since) == (Outcome.UNRESOLVED, 10)
    assert [v.first for v in physics.violations] == [110]


def test_an_obligation_that_is_open_with_time_left_is_unresolved() -> None:
    values = np.zeros((100, 1, 2), dtype=bool)
    values[10, 0, 0] = True
    (verdict,) = Monitor(compile_formula(RELEASE, dt=0.05), dt=0.05).run(values)
    assert verdict.outcome is Outcome.UNRESOLVED


def test_an_explanation_says_the_clock_and_leaves_out_the_steps_at_which_it_only_ran() -> None:
    dfa = compile_formula(RELEASE, dt=0.05)
    values = np.zeros((120, 1, 2), dtype=bool)
    values[10, 0, 0] = True
    (verdict,) = Monitor(dfa, dt=0.05).run(values)
    text = explain(dfa, values[:, 0], verdict, verdict.violations[0]).format()
    assert "bad prefix at step 110, pending since step 10: F[<=0] settled, 5 s over" in text
    assert "99 steps without a relevant change" in text


@pytest.mark.parametrize(
    ("text", "dt", "steps"),
    [
        ("F[<=0.3] a", 0.1, (0, 3)),
        ("F[<=5] a", 0.05, (0, 100)),
        ("F[0.12,0.13] a", 0.05, (2, 3)),
        ("F[<=0.01] a", 0.05, (0, 1)),
        ("F[1,1] a", 0.4, (2, 3)),
    ],
)
def test_seconds_are_rounded_outwards_to_steps(
    text: str, dt: float, steps: tuple[int, int]
) -> None:
    formula = parse(text)
    assert isinstance(formula, Bounded)
    assert formula.bound.steps(dt) == steps


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("F[5] a", "column 4: expected ',' after '5', found ']'"),
        ("F[<5] a", "column 3: no bound begins with '<'; there are [<=5] and [1,3], in seconds"),
        ("F[>=5] a", "column 3: no bound begins with '>='; there are [<=5] and [1,3], in seconds"),
        ("F[<=\u0665] a", "column 5: expected seconds, as in F[<=5] or F[1,3], found '\u0665'"),
        ("F[<=x] a", "column 5: expected seconds, as in F[<=5] or F[1,3], found 'x'"),
        ("F[3,1] a", "column 5: a bound that ends before it begins: [3,1]"),
        ("X[<=1] a", "column 2: 'X' takes no bound; F, G, U and W do"),
        ("a R[<=1] b", "column 4: 'R' takes no bound; F, G, U and W do"),
        ("F[<=1 a", "column 7: expected ']' after '1', found 'a'"),
        ("F[<=99999] a", "column 5: '99999' seconds; at most 86400, a day"),
    ],
)
def test_a_wrong_bound_is_refused_where_it_stands(text: str, message: str) -> None:
    with pytest.raises(FormulaError) as caught:
        parse(text)
    assert str(caught.value) == message


def test_a_bound_needs_a_control_period() -> None:
    with pytest.raises(FormulaError, match="give the control period"):
        compile_formula(RELEASE)


def test_clocks_cost_a_state_for_each_step_and_too_many_are_refused_with_the_remedy() -> None:
    assert len(compile_formula(RELEASE, dt=0.05)) == 103
    with pytest.raises(
        FormulaError, match="shorten the bounds, begin them at 0, or split the conjunction"
    ):
        compile_formula("G (a -> F[1,3] b)", dt=0.05)


def test_the_state_shown_is_what_is_left_of_the_bound() -> None:
    dfa = compile_formula("G (a -> F[<=0.2] b)", dt=0.05)
    states = dfa.states([1, 0, 1, 0])
    owed = [str(dfa.residuals[state]) for state in states]
    assert owed == ["F[<=0.15] b", "F[<=0.1] b", "F[<=0.05] b", "F[<=0] b"]
