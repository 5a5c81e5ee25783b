"""Robustness: its sign is acceptance, online it is the same, and rtamt says the same."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from pytest_safemanip.errors import TraceError
from pytest_safemanip.fuzz.formulas import formulas
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
    OnlineRobustness,
    Or,
    Until,
    WeakNext,
    WeakUntil,
    compile_formula,
    parse,
    robustness,
)
from pytest_safemanip.ltlf.formula import Bound, Bounded, bounded
from pytest_safemanip.ltlf.robustness import step_robustness
from pytest_safemanip.ltlf.rules import rules_of

ATOMS = ("a", "b", "c")
INFINITE = float("inf")
MARGINS = st.sampled_from((-3.0, -1.0, -0.25, 0.5, 1.0, 2.0)) | st.floats(-5.0, 5.0, width=16)
COMMON = (Not, Next, WeakNext, Eventually, Always), (And, Or, Implies, Until)
"""Operators that rtamt has too."""


def traces(
    atoms: tuple[str, ...] = ATOMS, least: int = 1
) -> st.SearchStrategy[dict[str, np.ndarray]]:
    """Margins of some atoms over so many to nine steps."""

    def of(steps: int) -> st.SearchStrategy[dict[str, np.ndarray]]:
        row = st.lists(MARGINS, min_size=steps, max_size=steps).map(np.array)
        return st.fixed_dictionaries(dict.fromkeys(atoms, row))

    return st.integers(least, 9).flatmap(of)


@st.composite
def timed(draw: st.DrawFn, depth: int = 3) -> Formula:
    """Formulas of the operators that rtamt has too, with bounds in steps of a second."""
    if depth == 0 or draw(st.integers(0, 9)) == 0:
        return Atom(draw(st.sampled_from(ATOMS[:2])))
    p = draw(timed(depth - 1))
    low = draw(st.integers(0, 2))
    bound = Bound(float(low), float(low + draw(st.integers(0, 3))))
    if draw(st.booleans()):
        core = draw(st.sampled_from(COMMON[0]))(p)
        has_bound = isinstance(core, Eventually | Always) and draw(st.booleans())
    else:
        q = draw(timed(depth - 1))
        core = draw(st.sampled_from((*COMMON[1], WeakUntil)))(p, q)
        has_bound = isinstance(core, WeakUntil) or (isinstance(core, Until) and draw(st.booleans()))
    return bounded(core, bound) if has_bound else core


def progressed(formula, margins, dt=None, acting=None):
    """What it is online after each step."""
    online = OnlineRobustness(formula, dt)
    steps = len(next(iter(margins.values())))
    acting = [True] * steps if acting is None else acting
    return [
        online.step({name: float(row[t]) for name, row in margins.items()}, acting[t])
        for t in range(steps)
    ]


def sign_is_acceptance(formula, margins, dt=None):
    value = robustness(formula, margins, dt)[0]
    dfa = compile_formula(formula, dt=dt)
    accepted = dfa.accepts(
        [
            {name: bool(margins[name][t] > 0.0) for name in dfa.atoms}
            for t in range(len(margins["a"]))
        ]
    )
    if value != 0.0 and all((row != 0.0).all() for row in margins.values()):
        assert accepted == (value > 0.0)


@pytest.mark.parametrize(
    ("text", "a", "b", "value"),
    [
        ("a", [-0.5, 2.0], [0.0, 0.0], -0.5),
        ("!a", [-0.5, 2.0], [0.0, 0.0], 0.5),
        ("X a", [1.0, 2.0], [0.0, 0.0], 2.0),
        ("F a", [-3.0, -1.0, -2.0], [0.0] * 3, -1.0),
        ("G a", [3.0, 1.0, 2.0], [0.0] * 3, 1.0),
        ("a U b", [4.0, 2.0, 1.0], [-1.0, -1.0, 3.0], 2.0),
        ("a U b", [4.0, 2.0], [-1.0, -2.0], -1.0),
        ("a W b", [4.0, 2.0], [-1.0, -2.0], 2.0),
        ("a R b", [-4.0, 2.0, -1.0], [1.0, 3.0, -5.0], 1.0),
        ("G (a -> F b)", [1.0, -1.0, 1.0], [2.0, -1.0, 0.25], 0.25),
        ("F[<=1] a", [-1.0, -2.0, 5.0], [0.0] * 3, -1.0),
        ("F[2,3] a", [9.0, 9.0, 5.0], [0.0] * 3, 5.0),
        ("G[<=1] a", [1.0, 2.0, -5.0], [0.0] * 3, 1.0),
        ("a U[<=1] b", [4.0, 2.0, 1.0], [-1.0, -2.0, 3.0], -1.0),
        ("a W[<=1] b", [4.0, 2.0, -1.0], [-1.0, -2.0, -3.0], 2.0),
        ("F[5,6] a", [1.0], [0.0], -INFINITE),
        ("G[5,6] a", [-1.0], [0.0], INFINITE),
        ("a & true", [0.5], [0.0], 0.5),
        ("last | a", [0.5], [0.0], INFINITE),
        ("X true", [0.5], [0.0], -INFINITE),
    ],
)
def test_what_formulas_are_worth(text, a, b, value):
    margins = {"a": np.array(a), "b": np.array(b)}
    assert robustness(parse(text), margins, dt=1.0)[0] == value
    assert progressed(parse(text), margins, dt=1.0)[-1] == value


@given(formulas(3, ATOMS), traces())
def test_the_sign_is_whether_the_automaton_accepts(formula, margins):
    sign_is_acceptance(formula, margins)


@given(timed(), traces(ATOMS[:2]))
def test_the_sign_is_whether_the_automaton_with_clocks_accepts(formula, margins):
    try:
        sign_is_acceptance(formula, margins, dt=1.0)
    except FormulaError:
        assume(False)  # more states than an automaton may have


@given(formulas(3, ATOMS), traces())
def test_online_it_is_that_of_each_prefix(formula, margins):
    found = progressed(formula, margins)
    for stop in range(1, len(found) + 1):
        prefix = {name: row[:stop] for name, row in margins.items()}
        assert found[stop - 1] == robustness(formula, prefix)[0]


@given(timed(), traces(ATOMS[:2]), st.integers(0, 9))
def test_online_it_is_that_of_each_prefix_with_clocks_that_may_stand(formula, margins, acts):
    acting = np.arange(len(margins["a"])) < acts
    found = progressed(formula, margins, 1.0, acting)
    for stop in range(1, len(found) + 1):
        prefix = {name: row[:stop] for name, row in margins.items()}
        assert found[stop - 1] == robustness(formula, prefix, 1.0, acting[:stop])[0]


@pytest.mark.parametrize("text", ["F[<=2] a", "G[<=2] a", "b U[1,2] a", "b W[<=1] a", "F[1,3] a"])
def test_clocks_stand_in_a_settle_tail_as_those_of_the_automaton_do(text):
    dfa = compile_formula(text, dt=1.0)
    rules = rules_of(dfa, 1.0, None, "robot", "timed", None)
    for seed in range(40):
        rng = np.random.default_rng(seed)
        margins = {name: rng.normal(size=6) for name in dfa.atoms}
        acting = np.arange(6) < rng.integers(1, 7)
        state = 0
        for step in range(6):
            letter = dfa.letter({name: bool(margins[name][step] > 0) for name in dfa.atoms})
            state = int((dfa.table if acting[step] else dfa.standing)[state][letter])
        assert bool(dfa.accepting[state]) == (robustness(dfa.formula, margins, 1.0, acting)[0] > 0)
    assert rules.standing is not rules.table


def in_rtamt(formula: Formula) -> str:
    """The formula as rtamt writes it."""
    core, bound = formula, ""
    if isinstance(formula, Bounded):
        core = formula.core
        bound = f"[{formula.bound.low:.0f}:{formula.bound.high:.0f}]"
    parts = [f"({in_rtamt(part)})" for part in core.operands]
    match core:
        case Atom(name):
            return f"{name} >= 0"
        case Not() | Next() | WeakNext() | Eventually() | Always():
            word = {
                Not: "not",
                Next: "s_next",
                WeakNext: "next",
                Eventually: "eventually",
                Always: "always",
            }[type(core)]
            return f"{word}{bound} {parts[0]}"
    word = {And: "and", Or: "or", Implies: "implies", Until: "until", WeakUntil: "unless"}
    return f"{parts[0]} {word[type(core)]}{bound} {parts[1]}"


@settings(max_examples=60)
@given(timed(), traces(ATOMS[:2], least=2))  # rtamt has no traces of one step
def test_rtamt_says_the_same(formula, margins):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of its parser's runtime
        rtamt = pytest.importorskip("rtamt")
    spec = rtamt.StlDiscreteTimeSpecification()
    for name in margins:
        spec.declare_var(name, "float")
    spec.spec = in_rtamt(formula)
    spec.parse()
    steps = list(range(len(margins["a"])))
    said = spec.evaluate({"time": steps, **{name: row.tolist() for name, row in margins.items()}})
    assert [value for _, value in said] == robustness(formula, margins, dt=1.0).tolist()


def test_it_costs_no_more_late_than_early():
    online = OnlineRobustness(parse("G (a -> F[<=5] b) & G (b -> (c W a))"), dt=0.05)
    rng = np.random.default_rng(3)
    for _ in range(400):
        online.step(dict(zip("abc", rng.normal(size=3), strict=True)))
    assert len(online._open) < 250  # at most one more for each clock that can be running


@pytest.mark.parametrize(
    ("margins", "message"),
    [
        ({"a": np.zeros(3), "b": np.zeros(2)}, "expected margins of the same steps"),
        ({"a": np.zeros(0), "b": np.zeros(0)}, "expected margins of the same steps"),
        ({"a": np.zeros(3)}, "atom 'b' has no margins"),
    ],
)
def test_margins_of_other_steps_or_atoms_are_refused(margins, message):
    with pytest.raises(TraceError, match=message):
        robustness(parse("a U b"), margins)


def test_online_an_atom_without_a_margin_is_refused():
    with pytest.raises(TraceError, match="atom 'settled' has no margin; did you mean 'setled'"):
        OnlineRobustness(parse("F settled")).step({"setled": 1.0})


@pytest.mark.parametrize("make", [OnlineRobustness, lambda f: robustness(f, {"a": np.ones(2)})])
def test_a_bound_needs_the_control_period(make):
    with pytest.raises(FormulaError, match=r"'F\[<=1\] a' has a bound in seconds"):
        make(parse("F[<=1] a"))


@given(formulas(3, ATOMS), traces())
def test_a_step_alone_is_a_trace_of_one_step_or_what_its_best_future_makes_of_it(formula, margins):
    ends = step_robustness(formula, margins, 1.0, goes_on=False)
    goes_on = step_robustness(formula, margins, 1.0, goes_on=True)
    longest = 2 if formula.operands else 0
    for step in range(len(margins["a"])):
        alone = {name: row[step : step + 1] for name, row in margins.items()}
        assert ends[step] == robustness(formula, alone)[0]
        for future in range(1, longest):  # whatever comes is no better
            more = {name: row[step : step + 1 + future] for name, row in margins.items()}
            if len(more["a"]) == 1 + future:
                assert robustness(formula, more)[0] <= goes_on[step]


@pytest.mark.parametrize(
    ("text", "a", "b", "ends", "goes_on"),
    [
        ("G !a", 2.0, 0.0, -2.0, -2.0),
        ("F a", -2.0, 0.0, -2.0, INFINITE),
        ("!a W b", 3.0, -0.5, -0.5, -0.5),
        ("a U b", 3.0, -0.5, -0.5, 3.0),
        ("a R b", -3.0, 0.5, 0.5, 0.5),
        ("!X a", 1.0, 0.0, INFINITE, INFINITE),
        ("F[<=0] a", -2.0, 0.0, -2.0, -2.0),
        ("F[<=3] a", -2.0, 0.0, -2.0, INFINITE),
        ("F[1,3] a", 2.0, 0.0, -INFINITE, INFINITE),
        ("G[1,3] a", 2.0, 0.0, INFINITE, INFINITE),
        ("a W[1,3] b", -2.0, 5.0, -2.0, -2.0),
        ("last -> a", -2.0, 0.0, -2.0, INFINITE),
        ("a <-> b", 2.0, -1.0, -1.0, -1.0),
    ],
)
def test_what_a_step_alone_is_worth(text, a, b, ends, goes_on):
    margins = {"a": np.array([a]), "b": np.array([b])}
    for future, value in ((False, ends), (True, goes_on)):
        assert step_robustness(parse(text), margins, 1.0, goes_on=future).tolist() == [value]
