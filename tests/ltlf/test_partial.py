"""A verdict is known exactly if nothing that is unknown can change it."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pytest_safemanip.errors import TraceError
from pytest_safemanip.fuzz.formulas import formulas
from pytest_safemanip.ltlf import Monitor, Outcome, StateClass, compile_formula
from pytest_safemanip.ltlf.partial import PartialVerdict, label

from .test_monitor import monitors

ATOMS = ("a", "b", "c")
REACH = compile_formula("G (reach -> open)")
REACHES, OPENS = (1 << REACH.atoms.index(name) for name in ("reach", "open"))


@st.composite
def partly_known(draw, most=7):
    """Letters, which bits of them are unknown (at most some in all), and when the robot stops."""
    letters = draw(st.lists(st.integers(0, 7), min_size=1, max_size=6))
    bits = st.tuples(st.integers(0, len(letters) - 1), st.sampled_from((1, 2, 4)))
    unknown = [0] * len(letters)
    for step, bit in draw(st.sets(bits, max_size=most)):
        unknown[step] |= bit
    return letters, unknown, draw(st.integers(0, len(letters)))


def completions(letters, unknown):
    """All that the letters may have been."""
    choices = [
        sorted({(letter & ~mask) | (fill & mask) for fill in range(8)})
        for letter, mask in zip(letters, unknown, strict=True)
    ]
    return itertools.product(*choices)


def judged(dfa, options, letters, stops):
    """Verdict on known letters, and the class and the safety of each of its prefixes."""
    watching = Monitor(dfa, dt=0.1, **options)
    steps = [watching.step([one], t < stops)[0] for t, one in enumerate(letters)]
    (verdict,) = watching.verdicts()
    return verdict, [(step.state_class, step.unsafe) for step in steps]


@settings(max_examples=300, deadline=None)
@given(formulas(3), partly_known(), monitors)
def test_a_verdict_is_known_exactly_if_all_completions_agree(formula, steps, options):
    letters, unknown, stops = steps
    dfa = compile_formula(formula, atoms=ATOMS)
    told, partial = [], Monitor(dfa, dt=0.1, **options).partial()
    for t, (letter, mask) in enumerate(zip(letters, unknown, strict=True)):
        told += partial.step([letter], [mask], t < stops)
    (verdict,) = partial.verdicts()
    all_of = [judged(dfa, options, one, stops) for one in completions(letters, unknown)]

    def agreed(values):
        found = set(values)
        return found.pop() if len(found) == 1 else None

    assert verdict.outcome is agreed(v.outcome for v, _ in all_of)
    assert verdict.vacuous is agreed(v.vacuous for v, _ in all_of)
    for t, step in enumerate(told):
        assert step.state_class is agreed(steps[t][0] for _, steps in all_of)
        assert step.unsafe is agreed(steps[t][1] for _, steps in all_of)
        assert verdict.unsafe[t] is agreed(bool(v.unsafe[t]) for v, _ in all_of)


def test_what_was_not_seen_is_neither_safe_nor_a_violation():
    partial = Monitor(REACH, ["cab"], dt=0.1).partial()
    (unseen,) = partial.step([REACHES], [OPENS])
    assert (unseen.label, unseen.unsafe) == ("UNKNOWN", None)
    (open_,) = partial.step([REACHES | OPENS], [0])
    assert open_.state_class is StateClass.CURRENTLY_TRUE
    assert label(partial.verdicts()) == "UNKNOWN"
    partial.step([REACHES], [0])
    (verdict,) = partial.verdicts()
    assert (verdict.outcome, verdict.unsafe) == (Outcome.VIOLATED, (None, False, True))


def test_what_cannot_matter_may_be_unknown():
    partial = Monitor(REACH, ["cab"], dt=0.1).partial()
    (step,) = partial.step([0], [OPENS])
    assert (step.unsafe, label(partial.verdicts())) == (False, "VACUOUS")


def test_a_violation_that_was_at_one_of_two_steps_is_one():
    dfa = compile_formula("G (a -> !X a)")
    partial = Monitor(dfa, dt=0.1).partial()
    for unknown in (0, 1, 0):  # seen, perhaps, seen: safe; then three times in a row
        partial.step([1], [unknown])
    (verdict,) = partial.verdicts()
    assert verdict.outcome is None
    partial.step([1], [0])
    (verdict,) = partial.verdicts()
    assert verdict.outcome is Outcome.VIOLATED


@pytest.mark.parametrize(
    ("labels", "whole"),
    [
        ("SV", "VIOLATED"),
        ("S?V", "VIOLATED"),
        ("S?U", "UNKNOWN"),
        ("SU", "UNRESOLVED"),
        ("S-", "SATISFIED"),
        ("--", "VACUOUS"),
    ],
)
def test_a_property_is_what_its_worst_instance_is_and_unknown_is_not_safe(labels, whole):
    outcomes = {"S": Outcome.SATISFIED, "V": Outcome.VIOLATED, "U": Outcome.UNRESOLVED}
    verdicts = [
        PartialVerdict(n, None if x == "?" else outcomes.get(x, Outcome.SATISFIED), x == "-", ())
        for n, x in enumerate(labels)
    ]
    assert label(verdicts) == whole


def test_the_settle_tail_ends_the_trace():
    partial = Monitor(REACH, dt=0.1).partial()
    with pytest.raises(TraceError, match="no step was read"):
        partial.verdicts()
    partial.step([0], [0], acting=False)
    with pytest.raises(TraceError, match="acts after it stopped"):
        partial.step([0], [0])
    assert np.array_equal(partial.verdicts()[0].unsafe, [False])
