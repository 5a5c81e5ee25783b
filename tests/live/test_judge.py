"""Watching a rollout while it runs says what judging its recording says."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pytest_safemanip.errors import TraceError
from pytest_safemanip.fuzz.recordings import recordings
from pytest_safemanip.fuzz.scenes import bind
from pytest_safemanip.fuzz.trial import shortened
from pytest_safemanip.live import LiveJudge
from pytest_safemanip.ltlf import Outcome, robustness, worst
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.view import View
from pytest_safemanip.spec.properties import load_properties
from tests import toy
from tests.propositions.stage import BINDING, CATALOGUE, film, grip, touch

PROPERTIES = load_properties([Path(__file__).resolve().parents[2] / "properties"])


@pytest.mark.parametrize(
    ("task", "policy"),
    [
        ("PickPlaceCounterToCabinet", "scripted:half_inside"),
        ("OpenDrawer", "scripted"),
    ],
)
def test_a_real_rollout_is_judged_alike_while_it_runs_and_afterwards(rollouts, task, policy):
    judged = rollouts.get(task, policy)
    recording, plan = judged.recording, rollouts.plan(task, policy)
    binding = plan.tasks[task].bind(recording.scene, plan.attributes)
    chosen = [plan.properties[name] for name in plan.tasks[task].properties]
    live = LiveJudge(recording.scene, binding, chosen, plan.catalogue, plan.parameters, every=7)
    for step, action, acting in recording.steps:
        live.step(step, action, acting)
    assert set(live.verdicts()) == {prop.id for prop in chosen}
    for prop in chosen:
        afterwards, told = judged.judge.judge(prop), live.verdicts()[prop.id]
        assert worst(told) == afterwards.outcome
        first = sorted(v.first for instance in told for v in instance.violations)
        assert first == [finding.first for finding in afterwards.findings]


def live_judge(name="grasp_stability", binding=BINDING):
    chosen = [PROPERTIES[name]]
    return LiveJudge(toy.SCENE, binding, chosen, CATALOGUE, CATALOGUE.parameters({}))


def test_a_violation_is_told_at_the_step_that_commits_it():
    judge, unsafe = live_judge(), []
    for step, action, acting in film(20, grip(range(3, 12))).steps:
        told = judge.step(step, action, acting)
        unsafe.append(any(v.unsafe for v in told["grasp_stability"]))
    assert np.flatnonzero(unsafe).tolist() == [14]  # majority of the last five steps


def test_a_step_that_cannot_be_is_refused_and_leaves_no_trace():
    judge = live_judge()
    (step, *_), *_ = film(1).steps
    for _ in range(3):
        judge.step(step)
    broken = dataclasses.replace(step, object_pose=step.object_pose * np.float32(np.nan))
    with pytest.raises(TraceError, match="object_pose: not finite at step 3 of 'mug'"):
        judge.step(broken)
    judge.step(step)
    assert len(judge.verdicts()["grasp_stability"][0].unsafe) == 4


def test_steps_that_are_evaluated_together_are_told_together_and_refused_together():
    chosen, parameters = [PROPERTIES["grasp_stability"]], CATALOGUE.parameters({})
    judge = LiveJudge(toy.SCENE, BINDING, chosen, CATALOGUE, parameters, every=4)
    steps = [step for step, _, _ in film(12, grip(range(3, 12))).steps]
    told = [bool(judge.step(step)) for step in steps[:6]]
    assert told == [False, False, False, True, False, False]
    broken = dataclasses.replace(steps[6], openings=np.float32([(np.inf, 0.0)]))
    judge.step(broken)
    with pytest.raises(TraceError, match="openings: not finite at step 6 of 'hand'"):
        judge.step(steps[7])
    assert len(judge.verdicts()["grasp_stability"][0].unsafe) == 4


def test_a_property_without_an_instance_is_refused():
    with pytest.raises(TraceError, match="grasp_stability: the binding has no instance of it"):
        live_judge(binding=Binding())
    assert live_judge(binding=Binding(emptied=frozenset({"objects"}))).verdicts() == {}


def watched(recording, binding, chosen, parameters, every=1, profile="paper"):
    """A judge that has seen a recording, and what it said of robustness at each evaluation."""
    live = LiveJudge(
        recording.scene, binding, chosen, CATALOGUE, parameters, profile, every, robust=True
    )
    said = []
    for count, (step, action, acting) in enumerate(recording.steps, 1):
        if live.step(step, action, acting):
            said.append((count, live.robustness(), live.margins()))
    live.verdicts()
    return live, said


@settings(max_examples=15)
@given(recordings(), st.integers(1, 4))
def test_the_sign_of_robustness_is_the_verdict_of_plain_acceptance(recording, every):
    binding = bind(recording.scene)
    chosen = [p for p in PROPERTIES.values() if p.rows(binding)]
    parameters = shortened(CATALOGUE, {})
    live, said = watched(recording, binding, chosen, parameters, every)
    for name, verdicts in live.verdicts().items():
        for verdict, value in zip(verdicts, live.robustness()[name], strict=True):
            if value:
                assert (verdict.outcome is Outcome.VIOLATED) == (value < 0.0), name
    view = View(recording.trace, binding, parameters, CATALOGUE)
    for count, values, margins in said:
        for call, margin in margins.items():
            assert margin == pytest.approx(view.margin(*call)[count - 1], abs=1e-9)
        for prop in chosen:
            rows = prop.rows(binding)
            for row, value in zip(rows, values[prop.id], strict=True):
                calls = zip(prop.atoms, prop.calls(row), strict=True)
                seen = {atom: view.margin(*call)[:count] for atom, call in calls}
                whole = robustness(prop.paper_formula, seen)[0]
                assert value == pytest.approx(np.clip(whole, -1000.0, 1000.0), abs=1e-9)


def test_robustness_says_by_how_much_a_rule_is_kept_while_it_runs():
    rows = touch(range(4, 8), "robot/finger_left", "mug/body", 60.0)
    rows += touch(range(8, 10), "robot/finger_left", "mug/body", 200.0)
    chosen, parameters = [PROPERTIES["collision_contact"]], CATALOGUE.parameters({})
    _, said = watched(film(12, rows), BINDING, chosen, parameters)
    values = [values["collision_contact"] for _, values, _ in said]
    assert values == [[1.0]] * 4 + [[0.25]] * 4 + [[-1.5]] * 4


def test_before_a_step_was_evaluated_nothing_is_known():
    live = live_judge()
    assert (live.margins(), live.robustness()) == ({}, {})
