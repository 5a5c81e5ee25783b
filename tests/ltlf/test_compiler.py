from __future__ import annotations

import itertools
import json
import os
import subprocess
import sys
import time

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pytest_safemanip.errors import TraceError
from pytest_safemanip.fuzz.formulas import formulas, traces
from pytest_safemanip.ltlf import (
    Always,
    And,
    Constant,
    FormulaError,
    Limits,
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
from pytest_safemanip.ltlf.formula import conjuncts

from .bruteforce import holds

ATOMS = ("a", "b", "c")
EXAMPLES = int(os.environ.get("SAFEMANIP_LTLF_EXAMPLES", "1000"))


@settings(max_examples=EXAMPLES, deadline=None)
@given(formulas(4), st.lists(traces(), min_size=1, max_size=4))
@example(parse("WX a"), [[0]])
@example(parse("X a"), [[7]])
def test_the_automaton_accepts_what_the_definition_accepts(formula, some_traces):
    dfa = compile_formula(formula, atoms=ATOMS, cache=False)
    for trace in some_traces:
        assert dfa.accepts(trace) == holds(formula, trace, ATOMS), trace


@settings(max_examples=200, deadline=None)
@given(formulas(3, ("a", "b")))
def test_a_class_says_what_any_continuation_can_bring(formula):
    dfa = compile_formula(formula, atoms=("a", "b"), cache=False)
    for state in range(1, len(dfa)):
        reached = {state}
        while (more := reached | {int(t) for s in reached for t in dfa.table[s]}) != reached:
            reached = more
        outcomes = {bool(dfa.accepting[s]) for s in reached}
        accepted = bool(dfa.accepting[state])
        expected = {
            (True, True): StateClass.CURRENTLY_TRUE,
            (True, False): StateClass.TRUE,
            (False, True): StateClass.CURRENTLY_FALSE,
            (False, False): StateClass.FALSE,
        }[accepted, len(outcomes) == 2]
        assert dfa.classes[state] is expected


@settings(max_examples=200, deadline=None)
@given(formulas(3, ("a", "b")))
def test_the_automaton_is_minimal_complete_and_numbered_breadth_first(formula):
    dfa = compile_formula(formula, atoms=("a", "b"), cache=False)
    states = range(len(dfa))
    assert dfa.table.shape == (len(dfa), 4)
    assert ((dfa.table >= 0) & (dfa.table < len(dfa))).all()
    assert list(dict.fromkeys([0, *dfa.table.ravel().tolist()])) == list(states)
    entered = {*dfa.table.ravel().tolist()}
    # Table filling: two states differ if a trace tells them apart. The initial state has no
    # acceptance of its own unless a step leads to it.
    differ = {
        (s, t)
        for s, t in itertools.product(states, states)
        if {s, t} <= entered and dfa.accepting[s] != dfa.accepting[t]
    }
    while True:
        more = {
            (s, t)
            for s, t in itertools.product(states, states)
            if any(
                (int(u), int(v)) in differ for u, v in zip(dfa.table[s], dfa.table[t], strict=True)
            )
        } - differ
        if not more:
            break
        differ |= more
    assert len(differ) == len(dfa) * (len(dfa) - 1)


@settings(max_examples=200, deadline=None)
@given(formulas(3, ("a", "b")))
def test_a_residual_is_what_the_state_still_asks(formula):
    atoms = ("a", "b")
    dfa = compile_formula(formula, atoms=atoms, cache=False)
    standing = [part for part in conjuncts(formula) if isinstance(part, Always)]
    words = [w for n in (1, 2, 3) for w in itertools.product(range(4), repeat=n)]
    for state, residual in enumerate(dfa.residuals):
        owed = residual
        if dfa.classes[state] not in (StateClass.TRUE, StateClass.FALSE):
            for part in standing:
                owed = And(owed, part)
        for word in words:
            reached = state
            for letter in word:
                reached = int(dfa.table[reached, letter])
            assert holds(owed, word, atoms) == dfa.accepting[reached], (state, str(residual), word)


@pytest.mark.parametrize(
    ("formula", "owed"),
    [
        ("G (a -> F b)", {"F b"}),
        ("G (a -> b W c)", {"b W c"}),
        ("G (a -> WX (!b W c))", {"!b W c"}),
        ("G (a -> F (b & F c))", {"F (b & F c)", "F c"}),
        ("G (a -> F b) & G (c -> X d)", {"F b", "d", "d & F b"}),
        ("F a & F b", {"F a", "F b"}),
        ("X X a", {"X a", "a"}),
        ("a <-> X a", {"a", "!a"}),
    ],
)
def test_residuals_read_like_what_is_owed_now(formula, owed):
    dfa = compile_formula(formula)
    shown = {str(residual) for residual in dfa.residuals[1:]}
    assert shown - {"true", "false"} == owed
    assert str(dfa.residuals[0]) == formula


def test_a_residual_without_a_short_normal_form_is_still_written():
    text = " <-> ".join("X " * i + "a" for i in range(1, 21))
    dfa = compile_formula(text)
    assert max(len(str(residual)) for residual in dfa.residuals) < 3000
    assert dfa.accepts([0] * 22) == holds(parse(text), [0] * 22, ("a",))


@settings(max_examples=200, deadline=None)
@given(formulas(3), formulas(3))
def test_equal_languages_have_equal_tables(p, q):
    pairs = [
        (p, Not(Not(p))),
        (p, And(p, Or(p, q))),
        (WeakUntil(p, q), Or(Until(p, q), Always(p))),
        (Release(p, q), Not(Until(Not(p), Not(q)))),
        (Until(p, q), Or(q, And(p, Next(Until(p, q))))),
        (Not(Next(p)), WeakNext(Not(p))),
    ]
    for one, other in pairs:
        x, y = (compile_formula(f, atoms=ATOMS, cache=False) for f in (one, other))
        assert np.array_equal(x.table, y.table)
        assert np.array_equal(x.accepting, y.accepting)
        assert x.classes == y.classes


def test_the_table_is_read_as_documented():
    dfa = compile_formula("G (b -> F a)")
    assert dfa.atoms == ("a", "b")
    assert dfa.table.tolist() == [[0, 0, 1, 0], [1, 0, 1, 0]]
    assert dfa.accepting.tolist() == [True, False]
    assert dfa.classes == (StateClass.CURRENTLY_TRUE, StateClass.CURRENTLY_FALSE)
    assert dfa.states([0b10, 0b00, 0b01]) == [1, 1, 0]


def test_atoms_can_be_given_in_any_order_and_more_than_occur():
    dfa = compile_formula("G a", atoms=("b", "a"))
    assert dfa.table.shape[1] == 4
    assert dfa.accepts([{"a": True, "b": False}])
    assert not dfa.accepts([0b01])


def test_a_stepper_follows_the_states():
    dfa = compile_formula("G (a -> X b)")
    step = dfa.stepper()
    assert [step(letter) for letter in (0b00, 0b01, 0b10, 0b01, 0b00, 0b00)] == [
        StateClass.CURRENTLY_TRUE,
        StateClass.CURRENTLY_FALSE,
        StateClass.CURRENTLY_TRUE,
        StateClass.CURRENTLY_FALSE,
        StateClass.FALSE,
        StateClass.FALSE,
    ]


def test_a_formula_is_compiled_once_and_cannot_be_changed():
    dfa = compile_formula("G (cached -> F again)")
    assert compile_formula("G(cached->(F again))") is dfa
    assert compile_formula("G (cached -> F again)", cache=False) is not dfa
    with pytest.raises(ValueError, match="read-only"):
        dfa.table[0, 0] = 1
    with pytest.raises(ValueError, match="read-only"):
        dfa.accepting[0] = False


@pytest.mark.parametrize(
    ("formula", "limits", "message"),
    [
        (" & ".join(f"a{i}" for i in range(13)), Limits(), "13 atoms; the limit is 12"),
        ("F (a & X X X X X X X X b)", Limits(states=100), "more than 100 states"),
        ("F (a & X X X X X X X X X X b)", Limits(seconds=0.001), r"more than 0.001 s \(limit 'sec"),
        ("F (a & X X X X X X X X X X X X X X X X X X b)", Limits(seconds=60), "limit 'states'"),
        (f"{'X ' * 60} a & {'X ' * 60} b & {'X ' * 60} c", Limits(), "128 temporal operators"),
        (
            " <-> ".join(f"F (a & X {'X ' * i} b)" for i in range(1, 9)),
            Limits(seconds=60),
            "decision nodes",
        ),
    ],
)
def test_a_limit_exceeded_is_named(formula, limits, message):
    began = time.monotonic()
    with pytest.raises(FormulaError, match=message):
        compile_formula(formula, limits=limits)
    assert time.monotonic() - began < 60


def test_atoms_missing_or_listed_twice():
    with pytest.raises(FormulaError, match="'b' occurs in the formula but not in the list"):
        compile_formula("a & b & c", atoms=("a",))
    with pytest.raises(FormulaError, match="listed twice"):
        compile_formula("a", atoms=("a", "a"))


@pytest.mark.parametrize(
    ("trace", "message"),
    [
        ([], "empty trace"),
        ([{"a": True}], "step 0: no value for atom 'b'"),
        (
            [{"a": True, "b": True}, {"a": True, "b": True, "bb": False}],
            "step 1: unknown atom 'bb'",
        ),
        ([{"a": True, "b": 1}], "atom 'b': expected a boolean, found 1"),
        ([{"a": True, "b": None}], "atom 'b': expected a boolean, found None"),
        ([4], "bitmask 4 does not fit 2 atoms"),
        ([-1], "bitmask -1"),
        ([True], "found bool"),
        (["ab"], "found str"),
        (np.zeros((3, 3), bool), r"expected values of shape \(any, 2\)"),
        (np.zeros((3, 2)), "expected a boolean array"),
        (np.zeros((0, 2), bool), "empty trace"),
    ],
)
def test_a_bad_trace_is_refused(trace, message):
    with pytest.raises(TraceError, match=message):
        compile_formula("a U b").accepts(trace)


def test_a_near_miss_is_suggested():
    with pytest.raises(TraceError, match="did you mean 'settled'"):
        compile_formula("F settled").accepts([{"settled": True, "setled": True}])


def test_traces_can_be_mappings_letters_or_arrays():
    dfa = compile_formula("G (a -> F b)")
    assert dfa.accepts([{"a": True, "b": False}, {"a": np.False_, "b": np.True_}])
    assert dfa.accepts([1, np.int64(2)])
    assert dfa.accepts(np.array([[True, False], [False, True]]))


def test_many_atoms_fit_wider_letters():
    names = [f"a{i:02}" for i in range(12)]
    dfa = compile_formula(f"G ({' & '.join(names)})")
    full = np.ones((2, 12), bool)
    assert dfa.accepts(full)
    full[1, 11] = False
    assert not dfa.accepts(full)


@pytest.mark.parametrize("constant", ["true", "false", "last", "X true"])
def test_formulas_without_atoms(constant):
    dfa = compile_formula(constant)
    for length in (1, 2, 3):
        assert dfa.accepts([{}] * length) == holds(parse(constant), [0] * length, ())


@pytest.mark.parametrize(
    ("value", "expected"), [(True, StateClass.TRUE), (False, StateClass.FALSE)]
)
def test_constants_are_decided_from_the_start(value, expected):
    dfa = compile_formula(Constant(value))
    assert (len(dfa), dfa.classes[0]) == (1, expected)


_COMPILE_ALL = """
import json, sys
from pytest_safemanip.ltlf import compile_formula
dfas = [compile_formula(text) for text in json.loads(sys.argv[1])]
found = [[d.table.tolist(), d.accepting.tolist(), [str(r) for r in d.residuals]] for d in dfas]
print(json.dumps(found))
"""


def test_eight_processes_at_once_compile_the_same_from_cold():
    texts = [
        "G (a -> F b)",
        "G (a -> (b W c))",
        "G (a -> WX (!b W c))",
        "G (a -> F (b & F c))",
        "(F a <-> G b) U (c R X a)",
    ]
    command = [sys.executable, "-c", _COMPILE_ALL, json.dumps(texts)]
    running = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(8)]
    answers = [process.communicate(timeout=60)[0] for process in running]
    assert [process.returncode for process in running] == [0] * 8
    here = [compile_formula(text) for text in texts]
    expected = [
        [d.table.tolist(), d.accepting.tolist(), [str(r) for r in d.residuals]] for d in here
    ]
    assert [json.loads(answer) for answer in answers] == [expected] * 8


def test_the_engine_imports_neither_pytest_nor_a_simulator():
    code = (
        "import sys, pytest_safemanip.ltlf; "
        "print([m for m in ('pytest', 'mujoco', 'yaml', 'sympy', 'ltlf2dfa') if m in sys.modules])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("text", "states", "entered"), [("a", 3, False), ("G a", 2, True), ("F (last & a)", 2, True)]
)
def test_the_start_is_merged_where_nothing_tells_it_apart(text, states, entered):
    dfa = compile_formula(text)
    assert len(dfa) == states
    assert (0 in dfa.table) == entered
    assert bool(dfa.accepting[0]) == entered  # where an accepting and a rejecting state would do
