"""Patterns and scopes: what they ask, told once more in plain Python, and how they are written."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.ltlf import FormulaError, Monitor, Outcome, compile_formula, parse
from pytest_safemanip.spec.patterns import PATTERNS, read_pattern
from pytest_safemanip.spec.properties import load_property
from pytest_safemanip.spec.scopes import SCOPES, before
from tests.ltlf.bruteforce import holds
from tests.ltlf.test_bounds import drawn

Values = Sequence[bool]


def begins(p: Values) -> list[int]:
    return [i for i, now in enumerate(p) if now and not (i and p[i - 1])]


def in_order(traces: Sequence[Values], strictly: bool) -> bool:
    """Whether there are steps, one after the other, at which each of them holds in turn."""
    at = -1 if strictly else 0
    for values in traces:
        found = [i for i, now in enumerate(values) if now and (i > at if strictly else i >= at)]
        if not found:
            return False
        at = found[0]
    return True


def first(p: Values) -> int:
    return list(p).index(True) if any(p) else len(p)


# A step is a second; the keys of the examples hold.
MEANINGS: dict[str, Callable[..., bool]] = {
    "absence": lambda p: not any(p),
    "universality": all,
    "existence": lambda p: any(p[:4]),
    "bounded_existence": lambda p: len(begins(p)) <= 2,
    "repeated_existence": lambda p: len(begins(p)) >= 2,
    "precedence": lambda s, p: not any(p) or first(s) <= first(p),
    "precedence_chain_2_1": lambda s, t, p: (
        not any(p) or any(s[i] and any(t[i + 1 : first(p) + 1]) for i in range(first(p)))
    ),
    "precedence_chain_1_2": lambda p, s, t: (
        not any(s[i] and any(t[i + 1 :]) for i in range(len(s)))
        or (any(p) and first(p) <= first(s))
    ),
    "response": lambda p, s: all(any(s[i : i + 3]) for i in range(len(p)) if p[i]),
    "response_chain_1_2": lambda p, s, t: all(
        any(s[j] and any(t[j + 1 :]) for j in range(i, len(p))) for i in range(len(p)) if p[i]
    ),
    "response_chain_2_1": lambda s, t, p: all(
        any(t[j] and any(p[j:]) for j in range(i + 1, len(s)))
        for i in range(len(s))
        if s[i] and any(t[i + 1 :])
    ),
    "minimum_duration": lambda p: all(all(p[i : i + 3]) for i in begins(p)),
    "maximum_duration": lambda p: not any(all(p[i : i + 3]) for i in range(len(p) - 3)),
    "recurrence": lambda p: all(any(p[i : i + 3]) or i + 3 >= len(p) for i in range(len(p))),
    "visit": lambda a, b: any(a) and any(b),
    "sequenced_visit": lambda a, b: in_order((a, b), strictly=False),
    "ordered_visit": lambda a, b: in_order((a, b), strictly=False) and first(a) <= first(b),
    "patrolling": lambda a, b: all(
        any(place[i : i + 4]) or i + 4 >= len(a) for place in (a, b) for i in range(len(a))
    ),
    "future_avoidance": lambda p, a: not any(a[first(p) :]),
    "past_avoidance": lambda p, a: first(p) <= first(a),
    "instantaneous_reaction": lambda p, s: all(
        now or not then for then, now in zip(p, s, strict=True)
    ),
    "prompt_reaction": lambda p, s: all(s[i + 1] for i in range(len(p) - 1) if p[i]),
    "bound_reaction": lambda p, s: list(p) == list(s),
    "wait": lambda s, p: any(p) and all(s[: first(p)]),
}


def columns(letters: Sequence[int], number: int) -> list[list[bool]]:
    return [[bool(letter >> bit & 1) for letter in letters] for bit in range(number)]


def test_every_pattern_has_a_meaning_here() -> None:
    assert set(MEANINGS) == set(PATTERNS)


@pytest.mark.parametrize("name", PATTERNS)
def test_a_pattern_means_what_it_says(name: str) -> None:
    pattern = PATTERNS[name]
    atoms = pattern.parameters
    asked = read_pattern(f"{name}({', '.join(atoms)})", pattern.keys)
    dfa = compile_formula(asked.formula, atoms=atoms, dt=1.0)
    longest = 8 // len(atoms) + 2
    for length in range(1, longest + 1):
        for letters in product(range(1 << len(atoms)), repeat=length):
            meant = MEANINGS[name](*columns(letters, len(atoms)))
            state = dfa.states(letters)[-1]
            assert bool(dfa.accepting[state]) == meant, (str(asked.formula), letters)


@pytest.mark.parametrize("name", [name for name, p in PATTERNS.items() if p.every])
def test_what_is_asked_of_every_step_holds_from_every_step_on(name: str) -> None:
    pattern = PATTERNS[name]
    number = len(pattern.parameters)
    for letters in product(range(1 << number), repeat=8 // number):
        values = columns(letters, number)
        if MEANINGS[name](*values):
            assert all(MEANINGS[name](*(v[i:] for v in values)) for i in range(len(letters)))


def stretches(scope: str, q: Values, r: Values) -> list[slice]:
    """The stretches of a scope, as the docs tell them."""
    if scope == "after":
        return [slice(first(q), None)] if any(q) else []
    if scope == "before":
        return [slice(0, first(r))] if any(r) else []
    found, opened = [], None
    for i in range(len(q)):
        if opened is not None and r[i]:
            found.append(slice(opened, i))
            opened = None
        elif opened is None and q[i] and not r[i]:
            opened = i
    if opened is not None and scope == "after_until":
        found.append(slice(opened, None))
    return found


@pytest.mark.parametrize("scope", [name for name in SCOPES if name != "globally"])
@pytest.mark.parametrize("name", PATTERNS)
def test_a_scope_asks_the_pattern_of_its_stretches(name: str, scope: str) -> None:
    draw = random.Random(f"{name} {scope}")  # noqa: S311 - the same every time
    pattern = PATTERNS[name]
    events = SCOPES[scope].events.split()
    whole = read_pattern(f"{name}({', '.join(pattern.parameters)})", pattern.keys)
    asked = whole.within(f"{scope}({', '.join(events)})")
    atoms = (*pattern.parameters, *events)
    dfa = compile_formula(asked.formula, atoms=atoms, dt=1.0)
    verdicts = set()
    for number in range(500):
        length = draw.randint(1, 14)
        rare = 0 if number % 2 else (1 << len(events)) - 1 << len(pattern.parameters)
        letters = [
            draw.getrandbits(len(atoms)) & ~(rare & draw.getrandbits(len(atoms)))
            for _ in range(length)
        ]
        named = dict(zip(atoms, columns(letters, len(atoms)), strict=True))
        never = [False] * length
        found = stretches(scope, named.get("q", never), named.get("r", never))
        values = [named[p] for p in pattern.parameters]
        meant = all(
            MEANINGS[name](*(v[part] for v in values)) if values[0][part] else nothing(name)
            for part in found
        )
        assert bool(dfa.accepting[dfa.states(letters)[-1]]) == meant, (str(asked.formula), letters)
        verdicts.add(meant)
    assert verdicts == {True, False}


def nothing(name: str) -> bool:
    """Of no steps at all everything holds, and nothing is found."""
    waits = {"existence", "repeated_existence", "visit", "sequenced_visit", "ordered_visit", "wait"}
    return name not in waits


def test_before_cuts_a_trace_off() -> None:
    draw = random.Random(5)  # noqa: S311 - the same every time
    for _ in range(400):
        formula = drawn(draw, 3, 3)
        cut = before(formula, parse("r"))
        letters = [draw.getrandbits(2) for _ in range(draw.randint(1, 6))]
        end = draw.randint(1, len(letters))
        ended = [
            letter | 4 * (i == end or (i > end and draw.random() < 0.5))
            for i, letter in enumerate(letters)
        ]
        assert holds(cut, ended, ("a", "b", "r")) == holds(formula, letters[:end], ("a", "b"))


@pytest.mark.parametrize("name", PATTERNS)
def test_examples_are_kept_and_not_kept(name: str) -> None:
    pattern = PATTERNS[name]
    asked = read_pattern(f"{name}({', '.join(pattern.parameters)})", pattern.keys)
    atoms = pattern.parameters
    dfa = compile_formula(asked.formula, atoms=atoms, dt=1.0)
    outcomes = []
    for trace in pattern.examples:
        letters = [sum((a in step) << bit for bit, a in enumerate(atoms)) for step in trace.split()]
        values = [[[bool(letter >> bit & 1) for bit in range(len(atoms))]] for letter in letters]
        (verdict,) = Monitor(dfa, 1, dt=1.0, trigger=asked.trigger).run(np.array(values))
        outcomes.append(verdict.outcome)
    assert outcomes[0] is Outcome.SATISFIED
    assert outcomes[1] is not Outcome.SATISFIED


TEXT = """\
id: comes_to_rest
category: housekeeping
title: What is let go after the door opened comes to rest
source: us
for_each: o in objects
pattern: response(released, settled | grasped)
scope: after(grasped)
within_s: 5
atoms:
  released: obj_released(o)
  settled: settled(o)
  grasped: obj_grasped(o)
"""


@pytest.fixture
def written(tmp_path):
    def written(old="", new=""):
        assert old in TEXT
        path = tmp_path / "rest.yaml"
        path.write_text(TEXT.replace(old, new) if old else TEXT)
        return path

    return written


def test_a_property_may_name_a_pattern(written) -> None:
    found = load_property(written())
    assert found.formula == parse("G (grasped -> G (released -> F[<=5] (settled | grasped)))")
    assert found.paper_formula == found.formula
    assert found.trigger == parse("grasped")


def test_without_a_scope_it_is_asked_of_the_whole_rollout_and_tested_by_its_own_trigger(written):
    found = load_property(written("scope: after(grasped)\n", ""))
    assert found.formula == parse("G (released -> F[<=5] (settled | grasped))")
    assert found.trigger == parse("released")


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("response(", "respons(", 6, "unknown pattern 'respons'; did you mean 'response'?"),
        ("after(grasped)", "afte(grasped)", 7, "unknown scope 'afte'; did you mean 'after'?"),
        ("response(", "absence(", 6, "expected absence(p), found 2"),
        ("response(released, settled | grasped)", "visit(settled)", 6, "expected visit(a, b, ...)"),
        ("after(grasped)", "between(grasped)", 7, "expected between(q, r), found 1"),
        ("| grasped)", "| )", 6, "column 30: expected a formula after '|'"),
        ("| grasped)", "| F grasped)", 6, "has a temporal operator"),
        ("settled |", "setled |", 6, "atom 'setled' is not declared"),
        ("within_s: 5", "at_most: 2", 6, "takes no 'at_most'; it takes within_s"),
        ("pattern: response(released, settled | grasped)", "formula: F settled", 7, "no"),
        ("pattern:", "formula: F settled\npattern:", 7, "expected one of the two"),
        ("within_s: 5", "within_s: 5\ndeadline_s: 5", 9, "expected one of the two"),
        ("within_s: 5", "within_s: soon", 8, "expected a positive number"),
    ],
)
def test_a_mistake_names_the_line(written, old, new, line, message) -> None:
    with pytest.raises(ConfigError) as error:
        load_property(written(old, new))
    assert f"rest.yaml:{line}: " in str(error.value)
    assert message in str(error.value)


@pytest.mark.parametrize("times", [0, 1.5, 9])
def test_occurrences_are_counted_in_whole_numbers_up_to_a_limit(times) -> None:
    with pytest.raises(FormulaError, match="expected 1 to 8"):
        read_pattern("bounded_existence(p)", {"at_most": times})
