from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from pytest_safemanip.errors import TraceError
from pytest_safemanip.fuzz.formulas import formulas
from pytest_safemanip.ltlf import Monitor, OmittedSteps, Row, StateClass, compile_formula, explain
from pytest_safemanip.ltlf import witness as deciding
from pytest_safemanip.ltlf.excerpt import Excerpt

ATOMS = ("a", "b")


def explained(text, number=0, tail=0, **options):
    """The explanation of a violation on a trace such as a='.1..'."""
    dfa = compile_formula(text)
    columns = [[mark == "1" for mark in options.pop(atom)] for atom in dfa.atoms]
    values = np.array(columns).T
    acting = np.arange(len(values)) < len(values) - tail
    (verdict,) = Monitor(dfa, ["mug"], dt=0.1, **options).run(values[:, None], acting)
    return explain(dfa, values, verdict, verdict.violations[number])


def decided_by(explanation):
    return {(v.step, v.atom, v.value) for v in explanation.deciding}


def violated_traces(dfa, explanation, steps):
    """Which of all traces from the start on are violated as the explanation means it: bool[...].

    A trace is the number with the letter of step k in bits 2k and 2k + 1.
    """
    first, start = explanation.violation.first, explanation.started_at
    found = []
    for trace in itertools.product(range(4), repeat=steps):
        states = dfa.states(trace)
        bad = any(dfa.classes[s] is StateClass.FALSE for s in states)
        if explanation.violation.reason == "bad prefix":
            found.append(bad)
        elif explanation.violation.at_end:
            found.append(not dfa.accepting[states[-1]])
        else:
            opened = explanation.opened_at - start
            still = not any(dfa.accepting[s] for s in states[opened : first - start + 1])
            found.append(still)
    return np.array(found)


@st.composite
def violations(draw):
    formula = draw(formulas(3, ATOMS))
    dfa = compile_formula(formula, atoms=ATOMS)
    steps = draw(st.integers(1, 4))
    values = np.array(draw(st.lists(st.integers(0, 3), min_size=steps, max_size=steps)))
    values = values[:, None] >> np.arange(2) & 1 == 1
    options = draw(
        st.sampled_from(
            [
                {},
                {"deadline_s": 0.1},
                {"deadline_s": 0.2, "discharged_by": "physics"},
                {"discharged_by": "physics"},
                {"profile": "paper"},
            ]
        )
    )
    acting = np.arange(steps) < steps - 1
    (verdict,) = Monitor(dfa, dt=0.1, **options).run(values[:, None], acting)
    assume(verdict.violations)
    return dfa, values, verdict


def subsets_that_decide(dfa, values, explanation):
    """All sets of (step, atom), as bitmasks over the trace, that suffice by trying all traces."""
    start, first = explanation.started_at, explanation.violation.first
    steps = first + 1 - start
    violated = violated_traces(dfa, explanation, steps)
    letters = values[start : first + 1] @ [1, 2]
    # itertools.product counts with the last step fastest
    actual = sum(int(x) << 2 * (steps - 1 - k) for k, x in enumerate(letters))
    traces = np.arange(4**steps)
    return [mask for mask in range(4**steps) if violated[(traces ^ actual) & mask == 0].all()]


def as_mask(explanation):
    steps = explanation.violation.first + 1 - explanation.started_at
    return sum(
        1 << 2 * (steps - 1 - (v.step - explanation.started_at)) + ATOMS.index(v.atom)
        for v in explanation.deciding
    )


@settings(max_examples=120, deadline=None)
@given(violations())
def test_no_smaller_set_of_values_decides(found):
    dfa, values, verdict = found
    for violation in verdict.violations:
        explanation = explain(dfa, values, verdict, violation)
        assert explanation.smallest
        deciding_sets = subsets_that_decide(dfa, values, explanation)
        assert as_mask(explanation) in deciding_sets
        assert len(explanation.deciding) == min(mask.bit_count() for mask in deciding_sets)
        assert all(v.value == values[v.step, ATOMS.index(v.atom)] for v in explanation.deciding)


@settings(max_examples=60, deadline=None)
@given(violations())
def test_when_the_search_is_too_large_no_value_can_be_left_out(found):
    dfa, values, verdict = found
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(deciding, "_MAX_WORK", 0)
        explanation = explain(dfa, values, verdict, verdict.violations[0])
    assert not explanation.smallest
    deciding_sets = set(subsets_that_decide(dfa, values, explanation))
    mask = as_mask(explanation)
    assert mask in deciding_sets
    assert not any(mask & ~(1 << bit) in deciding_sets for bit in range(20) if mask >> bit & 1)


def test_with_many_atoms_the_greedy_search_answers():
    names = [f"a{i}" for i in range(8)]
    found = explained(f"G !({' & '.join(names)})", **dict.fromkeys(names, ".1."))
    assert not found.smallest
    assert decided_by(found) == {(1, name, True) for name in names}


def test_a_bad_prefix():
    found = explained("G (g -> (s W r))", g=".1....", s=".111..", r="......")
    assert (found.violation.first, found.started_at, found.opened_at) == (4, 0, 1)
    assert [(p.step, str(p.residual)) for p in found.path] == [(1, "s W r"), (4, "false")]
    assert found.format().startswith("bad prefix at step 4, pending since step 1: s W r\n")
    never_released = {(step, "r", False) for step in range(1, 5)}
    assert decided_by(found) == {(1, "g", True), (4, "s", False)} | never_released


def test_a_level_needs_only_its_last_step():
    found = explained("G (g -> (s W r))", g=".1111.", s=".111..", r="......")
    assert found.opened_at == 1
    assert decided_by(found) == {(4, "g", True), (4, "s", False), (4, "r", False)}


def test_what_costs_more_at_first_can_be_less_in_all():
    found = explained("last | a U b", a="..", b="..")
    assert found.violation.first == 1
    assert decided_by(found) == {(0, "a", False), (0, "b", False)}
    found = explained("WX (F b -> b U a)", a="1..1", b="1..1")
    assert decided_by(found) == {(1, "a", False), (1, "b", False), (3, "b", True)}


def test_an_overdue_obligation():
    found = explained("G (a -> F b)", a=".1.....", b="......1", deadline_s=0.3)
    assert (found.violation.first, found.opened_at) == (4, 1)
    assert decided_by(found) == {(1, "a", True)} | {(step, "b", False) for step in range(1, 5)}
    assert [(p.step, str(p.residual)) for p in found.path] == [(1, "F b"), (4, "F b")]


def test_an_obligation_open_at_the_end():
    found = explained("G (a -> F b)", a="1..1.", b=".1...", tail=1, discharged_by="physics")
    assert (found.violation.first, found.opened_at) == (4, 3)
    assert decided_by(found) == {(3, "a", True), (3, "b", False), (4, "b", False)}


def test_steps_of_a_path_tell_how_the_debt_changed():
    found = explained("G (h -> F (r & F s))", h=".1.....", r="...1...", s=".......", deadline_s=0.4)
    assert [(p.step, str(p.residual)) for p in found.path] == [
        (1, "F (r & F s)"),
        (3, "F s"),
        (5, "F s"),
    ]


def test_after_a_restart_only_what_came_since_counts():
    found = explained("G (g -> (s W r))", number=1, g="1..1..", s="1..1..", r="......")
    assert (found.violation.first, found.started_at, found.opened_at) == (4, 2, 3)
    assert min(v.step for v in found.deciding) == 3


def test_an_obligation_that_never_goes_idle_was_owed_from_the_start():
    found = explained("a U b", a="111.", b="....")
    assert (found.violation.first, found.opened_at) == (3, 0)


def test_an_unsatisfiable_formula_decides_alone():
    found = explained("false & a", a="1.")
    assert found.deciding == ()
    assert "decided by the formula alone" in found.format()


def test_of_many_stretches_of_steps_four_are_named_and_the_others_counted():
    text = "a"
    for _ in range(5):
        text = f"a & X X ({text})"
    found = explained(f"!({text})", a="1.1.1.1.1.1.")
    assert found.format().endswith("decided by a at 0, 2, 4, 6 and 2 more")


def test_the_excerpt_keeps_changes_and_folds_the_rest():
    found = explained("G (a -> F b)", a="....1" + "." * 20, b="." * 23 + "1.", deadline_s=1.0)
    items = found.excerpt.items
    assert [item.step if isinstance(item, Row) else (item.first, item.last) for item in items] == [
        3,
        4,
        (5, 13),
        14,
        (15, 22),
        23,
    ]
    assert items[found.excerpt.focus].step == found.violation.first == 14
    assert [item.unsafe for item in items if isinstance(item, Row)] == [False, False, True, False]
    assert found.excerpt.atoms == ("a", "b")
    assert items[1].values == (True, False)


def test_what_keeps_a_violation_going_is_shown():
    found = explained("G !(b | c)", b=".11..", c="..11.")
    assert [(item.step, item.values) for item in found.excerpt.items] == [
        (0, (False, False)),
        (1, (True, False)),
        (2, (True, True)),
        (3, (False, True)),
        (4, (False, False)),
    ]


def test_what_does_not_matter_in_a_state_is_folded():
    # Once b is owed, a changes nothing.
    found = explained("G (a -> F b)", a=".1.1.1.1", b="........", deadline_s=0.5)
    assert [item for item in found.excerpt.items if isinstance(item, OmittedSteps)] == [
        OmittedSteps(2, 5),
        OmittedSteps(7, 7),
    ]


def test_the_text_of_an_explanation():
    found = explained("G (a -> F b)", a=".1.......", b=".......1.", deadline_s=0.3)
    assert found.format() == (
        "overdue at step 4, pending since step 1: F b\n"
        "  step  a  b  residual\n"
        "     0  .  .  -\n"
        "     1  1  .  F b\n"
        "   ...  2 steps without a relevant change\n"
        "     4  .  .  OVERDUE: F b\n"
        "   ...  2 steps without a relevant change\n"
        "     7  .  1  -\n"
        "decided by a at 1; not b at 1-4"
    )
    assert explained("G !a", a=".1.").format() == (
        "bad prefix at step 1\n"
        "  step  a  residual\n"
        "     0  .  -\n"
        "     1  1  BAD PREFIX\n"
        "     2  .  -\n"
        "decided by a at 1"
    )
    assert (
        explained("F a", a="..", profile="paper")
        .format()
        .startswith(
            "still open at the last step 1, after which nothing can meet it, "
            "pending since step 0: F a\n"
        )
    )


@pytest.mark.parametrize("most", [10, 15, 30])
def test_a_long_explanation_is_cut_around_the_violation(most):
    flicker = "1." * 100
    found = explained("G (a -> F (b & F c))", a=flicker, b="." * 200, c="." * 200, deadline_s=9.0)
    text = found.format(most)
    assert len(text.splitlines()) <= most
    assert "lines left out" in text or len(found.excerpt.items) < most
    assert f"{found.violation.first:>6}  " in text
    assert counted(text) == len(found.excerpt.items)


def counted(text):
    """How many lines an excerpt has, with those that it says are left out."""
    rows = [row for row in text.splitlines()[2:] if row[:6].strip() and row[:7] != "decided"]
    left_out = [int(row.split()[1]) for row in rows if row.endswith("lines left out")]
    return len(rows) - len(left_out) + sum(left_out)


@pytest.mark.parametrize("most", [10, 14, 200])
def test_what_is_left_out_after_the_violation_is_counted(most):
    # Forty steps are unsafe, by the one and by the other in turn.
    found = explained("G !(b | c)", b="..." + "1." * 20 + ".", c="..." + ".1" * 20 + ".")
    text = found.format(most)
    assert counted(text) == len(found.excerpt.items) == 42
    assert ("lines left out" in text) == (most < 200)
    assert f"{found.violation.first:>6}  " in text


@pytest.mark.parametrize(
    ("focus", "after_head", "shown", "after"),
    [(20, 14, range(17, 24), 16), (39, 30, range(33, 40), 0), (4, 0, range(3, 10), 30)],
)
def test_a_cut_excerpt_has_the_beginning_and_what_is_around_the_violation(
    focus, after_head, shown, after
):
    rows = tuple(Row(step, (False,), 0, False, "-") for step in range(40))

    def left_out(count):
        return [f"   ...  {count} lines left out"] if count else []

    # Twelve lines below the heading: three of the beginning, and two that count.
    assert Excerpt(("a",), rows, focus).lines(13)[1:] == [
        *(f"{step:>6}  .  -" for step in range(3)),
        *left_out(after_head),
        *(f"{step:>6}  .  -" for step in shown),
        *left_out(after),
    ]
    whole = [f"{step:>6}  .  -" for step in range(40)]
    assert Excerpt(("a",), rows, focus).lines(41)[1:] == whole


def test_arguments_that_do_not_belong_together_are_refused():
    dfa = compile_formula("G !a")
    values = np.array([[False], [True]])
    (verdict,) = Monitor(dfa, dt=0.1).run(values[:, None])
    with pytest.raises(TraceError, match="expected values of shape"):
        explain(dfa, values[:1], verdict, verdict.violations[0])
    (other,) = Monitor(dfa, dt=0.1).run(~values[:, None])
    with pytest.raises(TraceError, match="none of the violations"):
        explain(dfa, values, verdict, other.violations[0])
