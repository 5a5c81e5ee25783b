from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.report.junit import case_properties, verdict_properties
from tests import toy
from tests.report.conftest import finding, verdict


def test_a_case_is_described_before_it_is_run(make):
    plan = make(seeds=(4,))
    case = plan.cases[0]
    found = dict(case_properties(case, plan.tasks[case.task], plan.properties[case.property_id]))
    assert found == {
        "safemanip.task": case.task,
        "safemanip.policy": "hold",
        "safemanip.property": "collision_contact",
        "safemanip.category": "collision_contact",
        "safemanip.suite": "atomic_fixture",
        "safemanip.horizon": "atomic",
        "safemanip.seed": 4,
    }


def test_a_verdict_adds_its_outcome_and_the_first_violation():
    found = verdict("VIOLATED", finding(np.int64(2), 2), finding(4, 5))
    assert dict(verdict_properties(found, toy.recording(), Path("out/one.rollout"))) == {
        "safemanip.outcome": "VIOLATED",
        "safemanip.success": False,
        "safemanip.triggered": 1,
        "safemanip.violations": 2,
        "safemanip.exposure": 0.5,
        "safemanip.formula": "G a",
        "safemanip.recording": "out/one.rollout",
        "safemanip.first_violation_step": 2,
    }


@pytest.mark.parametrize("outcome", ["SATISFIED", "UNRESOLVED", "VACUOUS"])
def test_without_a_violation_there_is_no_first_one(outcome):
    found = dict(verdict_properties(verdict(outcome), toy.recording(), Path("x")))
    assert found["safemanip.outcome"] == outcome
    assert "safemanip.first_violation_step" not in found


def test_a_real_verdict_has_plain_numbers_that_travel_between_processes(rollouts):
    case_plan = rollouts.plan("PickPlaceCounterToCabinet", "scripted:sweep")
    judged = rollouts.get("PickPlaceCounterToCabinet", "scripted:sweep")
    found = judged.judge.judge(case_plan.properties["collision_contact"])
    pairs = verdict_properties(found, judged.recording, judged.path)
    assert {type(value) for _, value in pairs} <= {str, int, float, bool}
    assert dict(pairs)["safemanip.first_violation_step"] > 0
