"""Watching a rollout while it runs says what judging its recording says."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.errors import TraceError
from pytest_safemanip.live import LiveJudge
from pytest_safemanip.ltlf import worst
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.spec.properties import load_properties
from tests import toy
from tests.propositions.stage import BINDING, CATALOGUE, film, grip

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
