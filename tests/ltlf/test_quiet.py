"""What is not looked up cannot change a verdict; and little is looked up."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from pytest_safemanip.errors import TraceError
from pytest_safemanip.ltlf import Monitor, compile_formula

FORMULAS = (
    "G (a -> b)",
    "G (a -> F (b & c))",
    "G (a -> b W c)",
    "G (a & c -> X !b)",
    "G (a -> WX (!b W c))",
    "G !(a | b | c)",
    "G !(a & b & c)",
    "G !(b & (a | c))",
    "G !(a & b) & F c",
    "F a & G (b -> c)",
    "a U (b | last & c)",
)


@pytest.mark.parametrize("profile", ["timed", "paper"])
@pytest.mark.parametrize("formula", FORMULAS)
@given(data=st.data(), together=st.integers(1, 4))
def test_what_is_not_looked_up_changes_no_verdict(formula, profile, data, together):
    dfa = compile_formula(formula, atoms=("a", "b", "c"))
    shape = data.draw(st.tuples(st.integers(1, 90), st.integers(1, 3), st.just(3)))
    # Mostly false, as triggers are.
    fill = st.just(False)
    values = data.draw(arrays.arrays(np.bool_, shape, elements=st.booleans(), fill=fill))
    options = {"dt": 0.5, "deadline_s": 1.0, "profile": profile}
    whole, lazy = (Monitor(dfa, shape[1], **options) for _ in range(2))
    wanted = [_told(v) for v in whole.run(values)]
    assert [_told(v) for v in lazy.run(_gathered(lazy, values))] == wanted
    for first in range(0, shape[0], together):
        part = values[first : first + together]
        lazy.steps(_gathered(lazy, part), [True] * len(part))
    assert [_told(v) for v in lazy.verdicts()] == wanted


def test_only_the_trigger_is_looked_up_until_it_holds():
    monitor = Monitor(compile_formula("G (a -> F b)", atoms=("b", "a")), 2, dt=0.1)
    values = np.zeros((100, 2, 2), bool)
    values[3, 1, 1] = values[7, 1, 0] = values[50, 1, 1] = True
    asked = []

    def value_of(instance, atom, first, stop):
        asked.append((instance, atom, first, stop))
        return values[first:stop, instance, atom]

    found = monitor.gather(100, value_of)
    assert asked == [(0, 1, 0, 100), (1, 1, 0, 100), (1, 0, 3, 35), (1, 0, 50, 100)]
    monitor.steps(found, [True] * 100)
    asked.clear()
    monitor.gather(5, value_of)  # the obligation is open now
    assert asked == [(0, 1, 0, 5), (1, 1, 0, 5), (1, 0, 0, 5)]


def test_of_what_never_holds_together_the_rest_is_looked_up_where_the_first_does():
    monitor = Monitor(compile_formula("G !(a & b)", atoms=("a", "b")), 1, dt=0.1)
    values = np.zeros((100, 1, 2), bool)
    values[40:50, 0, 0] = values[45, 0, 1] = True
    asked = []

    def value_of(instance, atom, first, stop):
        asked.append((atom, first, stop))
        return values[first:stop, instance, atom]

    monitor.steps(monitor.gather(100, value_of), [True] * 100)
    assert asked == [(0, 0, 100), (1, 40, 72)]
    (verdict,) = monitor.verdicts()
    assert [(v.first, v.last) for v in verdict.violations] == [(45, 45)]


@pytest.mark.parametrize(
    "letters",
    [
        np.zeros((3, 1), np.uint8),
        np.zeros((0, 2), np.uint8),
        np.zeros(3, np.uint8),
        np.full((3, 2), 4, np.uint8),
    ],
)
def test_letters_that_are_none_of_these_instances_are_refused(letters):
    monitor = Monitor(compile_formula("G (a -> F b)"), 2, dt=0.1)
    for read in (monitor.run, monitor.judge, lambda x: monitor.steps(x, [True] * len(x))):
        with pytest.raises(TraceError, match=r"letters of shape .* 2 instances .* 2 bits: a, b"):
            read(letters)


def _gathered(monitor, values):
    return monitor.gather(len(values), lambda k, atom, a, b: values[a:b, k, atom])


def _told(verdict):
    return (
        verdict.outcome,
        verdict.vacuous,
        verdict.triggered_steps,
        verdict.states.tolist(),
        verdict.unsafe.tolist(),
        verdict.violations,
        verdict.open_since,
    )
