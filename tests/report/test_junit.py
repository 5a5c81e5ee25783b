from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from pytest_safemanip.report.junit import (
    attachment_lines,
    case_properties,
    trim,
    verdict_properties,
)
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
        "safemanip.severity": 1.5,
        "safemanip.cost": 2.05,
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


def test_a_file_is_shortened_from_what_matters_least(tmp_path):
    path = tmp_path / "all.xml"
    cases = "".join(
        f'<testcase name="{n}"><properties><property name="a" value="{"x" * 100}"/></properties>'
        + (f'<failure message="m{n}">{"long " * 400}</failure>' if n == 3 else "")
        + "</testcase>"
        for n in range(4)
    )
    whole = f"<testsuites><testsuite>{cases}</testsuite></testsuites>"
    for most, properties, details, shortened in (
        (2700, 1, 2000, 3),
        (1200, 1, 504, 4),
        (500, 0, 0, 4),
    ):
        path.write_text(whole)
        assert trim(path, most) == shortened
        assert path.stat().st_size <= most
        found = ET.parse(path)
        assert [case.get("name") for case in found.iter("testcase")] == ["0", "1", "2", "3"]
        assert len(found.findall(".//properties")) == properties
        (failure,) = found.iter("failure")
        assert failure.get("message") == "m3"
        assert len(failure.text or "") == details
    assert list(tmp_path.iterdir()) == [path]


def test_attachments_are_relative_and_no_path_ends_its_own_mark(tmp_path):
    files = [tmp_path / "out" / "a b.png", tmp_path / "x]]y", tmp_path / "two\nlines"]
    assert attachment_lines(files, tmp_path / "job") == ["[[ATTACHMENT|../out/a b.png]]"]
