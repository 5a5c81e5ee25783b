from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.fuzz.formulas import formulas
from pytest_safemanip.ltlf import (
    Monitor,
    Outcome,
    StateClass,
    compile_formula,
    parse,
    worst,
)

from .bruteforce import holds

SETTLES = compile_formula("G (released -> F settled)")
HOLDS = compile_formula("G (grasped -> (stable W released))")


def values(dfa, **steps):
    """bool[T, 1, atoms] from strings such as released='.1..'."""
    columns = [[mark == "1" for mark in steps[atom]] for atom in dfa.atoms]
    return np.array(columns).T[:, None, :]


def runs(verdict):
    return [(v.first, v.last, v.reason) for v in verdict.violations]


def same(one, other):
    for field in dataclasses.fields(one):
        x, y = getattr(one, field.name), getattr(other, field.name)
        if isinstance(x, np.ndarray):
            assert x.dtype == y.dtype, field.name
            assert np.array_equal(x, y), field.name
        else:
            assert x == y, field.name
            assert type(x) is type(y), field.name


monitors = st.fixed_dictionaries(
    {
        "deadline_s": st.none() | st.sampled_from([0.05, 0.1, 0.3, 1.0]),
        "discharged_by": st.sampled_from(["robot", "physics"]),
        "profile": st.sampled_from(["timed", "paper"]),
        "trigger": st.none() | st.just(parse("a | b")),
    }
)


@st.composite
def recordings(draw, max_instances=4):
    """bool[T, I, 3] and the step at which the robot stops."""
    steps, instances = draw(st.integers(1, 12)), draw(st.integers(1, max_instances))
    letters = draw(
        st.lists(
            st.lists(st.integers(0, 7), min_size=instances, max_size=instances),
            min_size=steps,
            max_size=steps,
        )
    )
    array = np.array(letters)[..., None] >> np.arange(3) & 1 == 1
    return array, np.arange(steps) < draw(st.integers(0, steps))


@pytest.mark.parametrize(
    ("marks", "found"),
    [
        # A bad prefix at the first step; what opens at the last one is open at the end.
        (
            {"a": "...1", "b": "....", "c": "1..."},
            [(0, 0, "bad prefix", False), (3, 3, "overdue", True)],
        ),
        # Open since step 1 for two steps: overdue at step 3, the end or not.
        ({"a": ".1..", "b": "....", "c": "...."}, [(3, 3, "overdue", False)]),
        ({"a": "..1.", "b": "....", "c": "...."}, [(3, 3, "overdue", True)]),
    ],
)
def test_only_what_is_within_its_deadline_is_decided_by_the_end(marks, found):
    dfa = compile_formula("G (!c & (a -> F b))")
    monitor = Monitor(dfa, dt=0.1, deadline_s=0.2, discharged_by="physics")
    trace = values(dfa, **marks)
    acting = np.arange(4) < 3
    for step, acts in zip(trace, acting, strict=True):
        monitor.step(step, bool(acts))
    (live,), (at_once,) = monitor.verdicts(), monitor.run(trace, acting)
    same(live, at_once)
    assert [(v.first, v.last, v.reason, v.at_end) for v in live.violations] == found


@settings(max_examples=400, deadline=None)
@given(formulas(3), recordings(), monitors)
def test_online_and_batch_agree(formula, recording, options):
    array, acting = recording
    monitor = Monitor(
        compile_formula(formula, atoms=("a", "b", "c")), array.shape[1], dt=0.1, **options
    )
    live = [monitor.step(step, bool(acts)) for step, acts in zip(array, acting, strict=True)]
    online, batch = monitor.verdicts(), monitor.run(array, acting)
    for i, (one, other) in enumerate(zip(online, batch, strict=True)):
        same(one, other)
        seen = [step[i].unsafe for step in live]
        assert seen[:-1] == other.unsafe[:-1].tolist()
        assert [step[i].state for step in live] == other.states.tolist()


@settings(max_examples=200, deadline=None)
@given(formulas(3), recordings(), monitors, st.integers(0, 12))
def test_some_steps_at_once_are_read_as_one_after_the_other(formula, recording, options, cut):
    array, acting = recording
    dfa = compile_formula(formula, atoms=("a", "b", "c"))
    single, together = (Monitor(dfa, array.shape[1], dt=0.1, **options) for _ in range(2))
    for step, acts in zip(array, acting, strict=True):
        told = single.step(step, bool(acts))
    for part in (slice(None, cut), slice(cut, None)):
        if len(array[part]):
            told_at_once = together.steps(array[part], acting[part].tolist())
    assert told_at_once == told
    for one, other in zip(single.verdicts(), together.verdicts(), strict=True):
        same(one, other)


@settings(max_examples=200, deadline=None)
@given(formulas(3), recordings(max_instances=1), monitors, st.integers(0, 49))
def test_one_instance_and_fifty_agree(formula, recording, options, position):
    array, acting = recording
    dfa = compile_formula(formula, atoms=("a", "b", "c"))
    many = np.random.default_rng(0).random((len(array), 50, 3)) < 0.5
    many[:, position] = array[:, 0]
    names = [f"object{i}" for i in range(50)]
    (alone,) = Monitor(dfa, [names[position]], dt=0.1, **options).run(array, acting)
    among = Monitor(dfa, names, dt=0.1, **options).run(many, acting)
    same(alone, among[position])


@settings(max_examples=200, deadline=None)
@given(formulas(3), recordings(max_instances=1))
def test_the_paper_profile_is_acceptance_at_the_last_step(formula, recording):
    array, _ = recording
    letters = (array[:, 0] @ [1, 2, 4]).tolist()
    dfa = compile_formula(formula, atoms=("a", "b", "c"))
    (verdict,) = Monitor(dfa, dt=0.1, profile="paper", deadline_s=0.1).run(array)
    accepted = holds(formula, letters, dfa.atoms)
    assert (verdict.outcome is Outcome.SATISFIED) == accepted
    assert (verdict.outcome is Outcome.VIOLATED) != accepted
    assert len(verdict.violations) == (not accepted)


@settings(max_examples=200, deadline=None)
@given(
    formulas(3),
    recordings(max_instances=1),
    st.sampled_from([0.05, 0.1, 0.25, 0.3]),
    st.sampled_from(["robot", "physics"]),
)
def test_the_timed_profile_step_by_step_from_its_definition(formula, recording, deadline, who):
    array, acting = recording
    letters = (array[:, 0] @ [1, 2, 4]).tolist()
    dfa = compile_formula(formula, atoms=("a", "b", "c"))
    expected, started, last_accepting = [], 0, -1
    for t in range(len(letters)):
        prefix = letters[started : t + 1]
        if dfa.classes[dfa.states(prefix)[-1]] is StateClass.FALSE:
            expected.append(True)
            started, last_accepting = t + 1, t
            continue
        if holds(formula, prefix, dfa.atoms):
            last_accepting = t
        counted = [u for u in range(last_accepting + 1, t + 1) if acting[u] or who == "physics"]
        expected.append(len(counted) * 0.1 > deadline + 1e-6)
    unresolved = last_accepting < len(letters) - 1
    if who == "physics" and not acting[-1]:
        expected[-1] |= unresolved
    monitor = Monitor(dfa, dt=0.1, deadline_s=deadline, discharged_by=who)
    (verdict,) = monitor.run(array, acting)
    assert verdict.unsafe.tolist() == expected
    assert (verdict.outcome is Outcome.VIOLATED) == any(expected)
    assert (verdict.outcome is Outcome.UNRESOLVED) == (unresolved and not any(expected))
    assert verdict.open_since == (last_accepting + 1 if unresolved else None)
    assert verdict.exposed_steps == sum(e and a for e, a in zip(expected, acting, strict=True))
    assert sum(v.last - v.first + 1 for v in verdict.violations) == sum(expected)


def test_the_deadline_is_counted_from_the_last_accepting_step():
    array = values(SETTLES, released=".1........", settled=".........1")
    (verdict,) = Monitor(SETTLES, dt=0.1, deadline_s=0.3).run(array)
    assert runs(verdict) == [(4, 8, "overdue")]  # last accepting at 0; 0.4 s later is too late
    assert verdict.violations[0].duration_s == pytest.approx(0.5)
    assert verdict.outcome is Outcome.VIOLATED
    assert verdict.open_since is None


@pytest.mark.parametrize(("dt", "steps"), [(0.1, 3), (0.15, 2), (0.2, 1), (0.3, 1), (0.31, 0)])
def test_a_deadline_is_seconds_whatever_the_control_period(dt, steps):
    array = values(SETTLES, released="1......", settled=".......")
    (verdict,) = Monitor(SETTLES, dt=dt, deadline_s=0.3).run(array)
    assert verdict.violations[0].first == steps


def test_a_bad_prefix_is_followed_by_a_restart_that_forgets():
    array = values(HOLDS, grasped="1.......1.", stable="1.......11", released="..........")
    (verdict,) = Monitor(HOLDS, dt=0.1).run(array)
    assert runs(verdict) == [(1, 1, "bad prefix")]
    assert verdict.outcome is Outcome.VIOLATED
    assert verdict.exposed_steps == 1


def test_a_condition_that_lasts_is_seen_again_after_the_restart():
    array = values(HOLDS, grasped="1111.", stable="1..1.", released="....1")
    (verdict,) = Monitor(HOLDS, dt=0.1).run(array)
    assert runs(verdict) == [(1, 2, "bad prefix")]


def test_adjacent_reasons_make_one_violation_named_after_its_first_step():
    dfa = compile_formula("G (a -> F b) & G !c")
    array = values(dfa, a="1....", b=".....", c="...1.")
    (verdict,) = Monitor(dfa, dt=0.1, deadline_s=0.1).run(array)
    assert runs(verdict) == [(1, 3, "overdue")]


@pytest.mark.parametrize(
    ("who", "outcome", "violations"),
    [
        ("robot", Outcome.UNRESOLVED, []),
        ("physics", Outcome.VIOLATED, [(7, 9, "overdue")]),
    ],
)
def test_in_the_settle_tail_the_clock_stands_for_the_robot_only(who, outcome, violations):
    array = values(SETTLES, released="..1.......", settled="..........")
    acting = np.arange(10) < 4
    monitor = Monitor(SETTLES, dt=0.1, deadline_s=0.5, discharged_by=who)
    (verdict,) = monitor.run(array, acting)
    assert verdict.outcome is outcome
    assert runs(verdict) == violations
    assert verdict.exposed_steps == 0
    assert verdict.open_since == 2


def test_what_is_overdue_before_the_tail_stays_so_in_it():
    array = values(SETTLES, released="1.......", settled="......1.")
    (verdict,) = Monitor(SETTLES, dt=0.1, deadline_s=0.2).run(array, np.arange(8) < 4)
    assert runs(verdict) == [(2, 5, "overdue")]
    assert verdict.exposed_steps == 2


def test_what_physics_leaves_open_in_the_tail_is_a_violation_at_the_last_step():
    array = values(SETTLES, released="..1..", settled=".....")
    monitor = Monitor(SETTLES, dt=0.1, deadline_s=5.0, discharged_by="physics")
    (verdict,) = monitor.run(array, np.arange(5) < 4)
    assert runs(verdict) == [(4, 4, "overdue")]
    assert verdict.violations[0].at_end


@pytest.mark.parametrize(
    ("deadline", "outcome", "violations"),
    [(5.0, Outcome.UNRESOLVED, []), (0.2, Outcome.VIOLATED, [(4, 4, "overdue")])],
)
def test_without_a_tail_only_what_is_overdue_is_held_against_physics(deadline, outcome, violations):
    array = values(SETTLES, released="..1..", settled=".....")
    monitor = Monitor(SETTLES, dt=0.1, deadline_s=deadline, discharged_by="physics")
    for step in array:
        monitor.step(step)
    (live,), (at_once,) = monitor.verdicts(), monitor.run(array)
    same(live, at_once)
    assert (live.outcome, live.open_since, runs(live)) == (outcome, 2, violations)


def test_a_bad_prefix_in_the_tail_is_a_violation_without_exposure():
    array = values(HOLDS, grasped="11...", stable="11...", released=".....")
    (verdict,) = Monitor(HOLDS, dt=0.1).run(array, np.arange(5) < 2)
    assert runs(verdict) == [(2, 2, "bad prefix")]
    assert verdict.exposed_steps == 0


def test_the_paper_profile_neither_restarts_nor_counts():
    array = values(HOLDS, grasped="11....", stable="1.....", released="......")
    (verdict,) = Monitor(HOLDS, dt=0.1, profile="paper").run(array)
    assert runs(verdict) == [(1, 5, "bad prefix")]
    array = values(SETTLES, released="1.....", settled="......")
    (verdict,) = Monitor(SETTLES, dt=0.1, deadline_s=0.1, profile="paper").run(array)
    assert runs(verdict) == [(5, 5, "overdue")]
    assert verdict.violations[0].at_end


@pytest.mark.parametrize(
    ("formula", "trigger", "steps"),
    [
        ("G (a -> F b)", None, 2),
        ("G (a & !b -> F b)", None, 1),
        ("G !a", None, 4),  # no antecedent: always put to the test
        ("G (X a -> b)", None, 4),  # an antecedent about two steps says nothing about one
        ("G (a -> F b)", "b", 1),
        ("G !a", "a & b", 1),
    ],
)
def test_the_trigger_is_the_antecedent_or_what_is_given(formula, trigger, steps):
    dfa = compile_formula(formula, atoms=("a", "b"))
    array = values(dfa, a=".11.", b=".1..")
    monitor = Monitor(dfa, dt=0.1, trigger=parse(trigger) if trigger else None)
    (verdict,) = monitor.run(array)
    assert verdict.triggered_steps == steps
    assert not verdict.vacuous


def test_never_triggered_is_vacuous():
    (verdict,) = Monitor(SETTLES, dt=0.1).run(values(SETTLES, released="...", settled="1.."))
    assert verdict.vacuous
    assert verdict.outcome is Outcome.SATISFIED


def test_each_instance_has_its_own_state():
    cup = values(SETTLES, released="1...", settled="..1.")
    mug = values(SETTLES, released="1...", settled="....")
    monitor = Monitor(SETTLES, ["cup", "mug"], dt=0.1)
    verdicts = monitor.run(np.concatenate([cup, mug], axis=1))
    assert [(v.instance, v.outcome) for v in verdicts] == [
        ("cup", Outcome.SATISFIED),
        ("mug", Outcome.UNRESOLVED),
    ]


def test_a_live_monitor_answers_after_each_step_and_can_be_reset():
    monitor = Monitor(SETTLES, ["cup"], dt=0.1, deadline_s=0.1)
    steps = [
        {"released": r, "settled": s} for r, s in ((True, False), (False, False), (False, True))
    ]
    answers = [monitor.step([step])[0] for step in steps]
    assert [a.state_class for a in answers] == [
        StateClass.CURRENTLY_FALSE,
        StateClass.CURRENTLY_FALSE,
        StateClass.CURRENTLY_TRUE,
    ]
    assert [a.overdue for a in answers] == [False, True, False]
    assert runs(monitor.verdicts()[0]) == [(1, 1, "overdue")]
    monitor.reset()
    monitor.step([0b10])
    assert monitor.verdicts()[0].outcome is Outcome.SATISFIED


def test_judging_arrays_gives_what_the_verdicts_say():
    array = np.random.default_rng(1).random((40, 60, 2)) < 0.1
    monitor = Monitor(SETTLES, 60, dt=0.1, deadline_s=1.0, discharged_by="physics")
    found, verdicts = monitor.judge(array), monitor.run(array)
    assert found.violated.tolist() == [v.outcome is Outcome.VIOLATED for v in verdicts]
    assert found.triggered_steps.tolist() == [v.triggered_steps for v in verdicts]
    assert [None if x < 0 else x for x in found.open_since] == [v.open_since for v in verdicts]
    assert np.array_equal(found.unsafe, np.stack([v.unsafe for v in verdicts], axis=1))


@pytest.mark.parametrize(
    ("patterns", "label"),
    [
        (["1.", "..", "11"], "UNRESOLVED"),
        (["..", ".."], "VACUOUS"),
        ([".s", ".."], "SATISFIED"),
        (["1...", "1s..", "...."], "VIOLATED"),
    ],
)
def test_the_worst_instance_decides(patterns, label):
    columns = [
        values(
            SETTLES,
            released=pattern.replace("s", "1"),
            settled="".join("1" if mark == "s" else "." for mark in pattern),
        )
        for pattern in patterns
    ]
    monitor = Monitor(SETTLES, len(patterns), dt=0.1, deadline_s=0.2)
    assert worst(monitor.run(np.concatenate(columns, axis=1))).label == label


def test_many_instances_of_a_large_automaton_are_judged_as_each_alone():
    # Six atoms and more than four states: a table of more entries than a byte can number.
    dfa = compile_formula("G (a -> X (b | X (c | X (d | X (e | X f)))))")
    array = np.random.default_rng(0).random((20, 40, 6)) < 0.3
    assert len(dfa) << 6 > 256
    together = Monitor(dfa, 40, dt=0.1).run(array)
    alone = [Monitor(dfa, 1, dt=0.1).run(array[:, [n]])[0] for n in range(40)]
    assert [v.states.tolist() for v in together] == [v.states.tolist() for v in alone]


def test_no_instances_have_no_outcome():
    with pytest.raises(ValueError, match="without instances"):
        worst([])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"dt": 0.0}, "control period dt: expected a positive number"),
        ({"dt": float("nan")}, "control period dt"),
        ({"dt": 0.1, "deadline_s": -1.0}, "deadline_s: expected a positive"),
        ({"dt": 0.1, "deadline_s": float("inf")}, "deadline_s"),
        ({"dt": 0.1, "discharged_by": "robots"}, "did you mean 'robot'"),
        ({"dt": 0.1, "profile": "strict"}, "profile: unknown 'strict'"),
        ({"dt": 0.1, "instances": 0}, "at least one instance"),
        ({"dt": 0.1, "instances": ["cup", "cup"]}, "named twice"),
        ({"dt": 0.1, "trigger": parse("F settled")}, "without temporal operators"),
        ({"dt": 0.1, "trigger": parse("setled")}, "did you mean 'settled'"),
    ],
)
def test_a_monitor_that_makes_no_sense_is_refused(options, message):
    with pytest.raises(ConfigError, match=message):
        Monitor(SETTLES, **options)


@pytest.mark.parametrize(
    ("array", "acting", "message"),
    [
        (np.zeros((0, 1, 2), bool), None, "empty trace"),
        (np.zeros((3, 1, 2)), None, "expected a boolean array .* found an array of float64"),
        ([[[True, False]]], None, "expected a boolean array"),
        (np.zeros((3, 2, 2), bool), None, r"expected values of shape \(any, 1, 2\)"),
        (np.zeros((3, 1, 3), bool), None, "the last axis is the atoms: released, settled"),
        (np.zeros((3, 2), bool), None, "expected values of shape"),
        (np.zeros((3, 1, 2), bool), np.ones(2, bool), r"acting: expected .* shape \(3,\)"),
        (np.zeros((3, 1, 2), bool), np.ones(3), "acting: expected a boolean array"),
        (np.zeros((3, 1, 2), bool), np.array([True, False, True]), "acts at step 2 after"),
    ],
)
def test_a_recording_that_makes_no_sense_is_refused(array, acting, message):
    with pytest.raises(TraceError, match=message):
        Monitor(SETTLES, dt=0.1).run(array, acting)


@pytest.mark.parametrize(
    ("step", "message"),
    [
        ([], "0 values for 1 instances"),
        ([{"released": True}], "step 0, instance 'cup': no value for atom 'settled'"),
        ([{"released": True, "settled": "no"}], "expected a boolean, found 'no'"),
        ([4], "bitmask 4 does not fit"),
        (np.zeros((2, 2), bool), r"expected values of shape \(1, 2\)"),
    ],
)
def test_a_live_step_that_makes_no_sense_is_refused(step, message):
    monitor = Monitor(SETTLES, ["cup"], dt=0.1)
    with pytest.raises(TraceError, match=message):
        monitor.step(step)
    with pytest.raises(TraceError, match="no step was read"):
        monitor.verdicts()


def test_steps_at_once_have_to_fit_and_end_with_the_tail():
    monitor = Monitor(compile_formula("G a"), dt=0.1)
    with pytest.raises(TraceError, match="acting for 1 of 2 steps"):
        monitor.steps(np.ones((2, 1, 1), bool), [True])
    with pytest.raises(TraceError, match="acts at step 2 after it stopped"):
        monitor.steps(np.ones((3, 1, 1), bool), [True, False, True])
    with pytest.raises(TraceError, match="no step was read"):
        monitor.verdicts()


def test_the_robot_cannot_act_again_after_the_tail_began():
    monitor = Monitor(SETTLES, dt=0.1)
    monitor.step([0], acting=False)
    with pytest.raises(TraceError, match="acts at step 1 after it stopped"):
        monitor.step([0])


@pytest.mark.parametrize("instances", [1, 3, 12])
def test_atoms_beyond_the_eighth_are_read_whatever_the_number_of_instances(instances):
    names = "abcdefghij"
    dfa = compile_formula("G !(a & j)", atoms=tuple(names))
    trace = np.zeros((3, instances, 10), bool)
    trace[1, 0, [0, 9]] = True
    monitor = Monitor(dfa, instances, dt=0.1)
    found = [runs(verdict) for verdict in monitor.run(trace)]
    assert found == [[(1, 1, "bad prefix")]] + [[]] * (instances - 1)
    for step in trace:
        monitor.step(step)
    assert [runs(verdict) for verdict in monitor.verdicts()] == found


@pytest.mark.parametrize(
    ("trigger", "steps"),
    [
        ("a", 2),
        ("!a", 2),
        ("a & b", 2),
        ("a | b", 3),
        ("a -> b", 4),
        ("b -> a", 3),
        ("a <-> b", 3),
        ("true", 4),
        ("false", 0),
    ],
)
def test_at_how_many_steps_a_trigger_holds(trigger, steps):
    dfa = compile_formula("G (a | !a) & G (b | !b)", atoms=("a", "b"))
    trace = values(dfa, a="..11", b=".111")
    monitor = Monitor(dfa, dt=0.1, trigger=parse(trigger))
    (verdict,) = monitor.run(trace)
    assert (verdict.triggered_steps, verdict.vacuous) == (steps, steps == 0)
