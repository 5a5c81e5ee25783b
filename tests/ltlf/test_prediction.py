"""When a monitor expects a step to be unsafe, from when its atoms are expected to change."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.ltlf import Monitor, compile_formula

DT = 0.1
FORMULAS = (
    "G !(a | b)",
    "G (a -> b)",
    "G (a -> (b W c))",
    "G (a -> (!c W (b | d)))",
    "G (a -> WX (!b W c))",
    "a U b",
)
TIMES = st.sampled_from((0.1, 0.2, 0.3, math.inf))


@dataclass
class Expected:
    """Atoms with these values, expected to change after these seconds."""

    values: tuple[bool, ...]
    changes: tuple[float, ...]

    def value(self, atom):
        return self.values[atom]

    def change(self, atom):
        return self.changes[atom]


def predict(monitor, values, changes, order=None):
    order = range(len(values)) if order is None else order
    (found,) = monitor.predict(order, [Expected(tuple(values), tuple(changes))])
    return found


@given(st.data(), st.sampled_from(FORMULAS))
def test_the_first_bad_prefix_among_the_letters_that_are_expected_is_predicted(data, formula):
    dfa = compile_formula(formula)
    count = len(dfa.atoms)
    bits = st.lists(st.booleans(), min_size=count, max_size=count)
    monitor = Monitor(dfa, dt=DT)
    for letter in data.draw(st.lists(bits, min_size=1, max_size=4)):
        monitor.step([dict(zip(dfa.atoms, letter, strict=True))])
    values = data.draw(bits)
    changes = data.draw(st.lists(TIMES, min_size=count, max_size=count))
    order = data.draw(st.permutations(range(count)))
    state = monitor.verdicts()[0].states[-1]
    bad = [kind.value == "false" for kind in dfa.classes]

    def leads_to_a_bad_prefix(seconds):
        now = [v != (when <= seconds) for v, when in zip(values, changes, strict=True)]
        return bad[dfa.rows[state][sum(v << k for k, v in enumerate(now))]]

    soonest = 0.0 if bad[state] else math.inf
    for seconds in (0.0, 0.1, 0.2, 0.3):
        if leads_to_a_bad_prefix(seconds):
            soonest = min(soonest, seconds)
    found = predict(monitor, values, changes, order)
    assert found.violation == found.last_chance == soonest
    assert all(changes[k] <= soonest for k in found.atoms)


def let_go(discharged_by="physics"):
    dfa = compile_formula("G (released -> F settled)")
    return Monitor(dfa, dt=DT, deadline_s=1.0, discharged_by=discharged_by)


def test_what_physics_has_to_meet_has_its_last_chance_before_it_is_left_to_physics():
    monitor = let_go()
    monitor.step([{"released": False, "settled": False}])
    found = predict(monitor, (False, False), (0.2, math.inf))
    assert (found.last_chance, found.atoms) == (0.2, (0,))
    assert found.violation == pytest.approx(1.2)
    assert predict(monitor, (False, False), (0.2, 0.5)).violation == math.inf  # it will settle
    assert predict(monitor, (False, False), (0.2, 1.5)).last_chance == 0.2  # too late


def test_what_the_robot_has_to_meet_is_near_when_its_time_runs_out():
    monitor = let_go("robot")
    monitor.step([{"released": False, "settled": False}])
    assert predict(monitor, (False, False), (0.2, math.inf)).last_chance == math.inf
    monitor.step([{"released": True, "settled": False}])
    for _ in range(7):
        monitor.step([{"released": False, "settled": False}])
    found = predict(monitor, (False, False), (math.inf, math.inf))
    assert found.violation == found.last_chance == pytest.approx(0.3)
    steps = [monitor.step([{"released": False, "settled": False}])[0].unsafe for _ in range(3)]
    assert steps == [False, False, True]


def test_what_was_let_go_and_will_not_settle_is_as_near_as_its_deadline():
    monitor = let_go()
    monitor.step([{"released": True, "settled": False}])
    found = predict(monitor, (False, False), (math.inf, math.inf))
    assert found.violation == found.last_chance == pytest.approx(1.0)
    assert predict(monitor, (False, False), (math.inf, 0.4)).violation == math.inf


def test_a_monitor_of_unknown_atoms_expects_what_all_states_that_it_may_be_in_let_it():
    monitor = Monitor(compile_formula("G (a -> (!b W c))"), dt=DT).partial()
    nothing = [Expected((False, False, False), (math.inf, 0.2, math.inf))]
    monitor.step([0], [1])  # nobody knows whether a was true
    assert monitor.predict(range(3), nothing)[0].violation == math.inf
    monitor.step([1], [0])
    assert monitor.predict(range(3), nothing)[0].violation == 0.2
