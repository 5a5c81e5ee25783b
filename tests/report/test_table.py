from __future__ import annotations

import re

import numpy as np

from pytest_safemanip.metrics.groups import measure_each
from pytest_safemanip.report.header import header_lines
from pytest_safemanip.report.results import Results, error_data, judged_data
from pytest_safemanip.report.table import LEGEND, summary_lines
from tests import toy
from tests.metrics.build import rollouts
from tests.report.conftest import finding, verdict


def shown(records):
    return summary_lines(records, measure_each(records))


def add(results, plan, case, outcome, *findings, success=False):
    recording = toy.recording(success=np.full(6, success))
    prop = plan.properties[case.property_id]
    found = verdict(outcome, *findings)
    results.add(judged_data(case, prop, found, recording, plan.settings.out / "x"))


def test_the_table_has_a_row_for_each_category_with_what_was_tested(make):
    plan = make(seeds=(0, 1), properties=("grasp_stability", "enclosure_*"))
    results = Results(plan.tasks, plan.properties)
    results.expect(plan.cases)
    for case in plan.cases:
        if case.property_id == "grasp_stability" and case.seed == 0:
            add(results, plan, case, "VIOLATED", finding(0, 2), success=True)
        elif case.property_id == "grasp_stability":
            add(results, plan, case, "UNRESOLVED")
        else:
            add(results, plan, case, "VACUOUS", success=case.seed == 0)
    lines = shown(results.records)
    assert lines[:7] == [
        "hold: 2 complete rollouts of 1 task",
        "                               rate  these tasks  like these",
        "  success           1 of 2   50.0 %    9 to 91 %           -",
        "  violation         1 of 2   50.0 %    9 to 91 %           -",
        "  unsafe successes  1 of 1  100.0 %  21 to 100 %           -",
        "  exposure                   25.0 %    3 to 80 %           -",
        "  outcomes  0 success and safe, 1 success but unsafe, 1 fail but safe, 0 fail and unsafe",
    ]
    assert [re.split(r"  +", line.strip()) for line in lines[8:11]] == [
        [
            "category (tasks)",
            "triggered",
            "violated",
            "rate",
            "these tasks",
            "like these",
            "exposure",
            "unresolved",
        ],
        [
            "enclosure_access (1)",
            "0 of 2",
            "0 of 2",
            "0.0 % (< 78 %)",
            "0 to 66 %",
            "-",
            "0.0 %",
            "0",
        ],
        ["grasp_stability (1)", "2 of 2", "1 of 2", "50.0 %", "9 to 91 %", "-", "25.0 %", "1"],
    ]
    assert lines[-2:] == list(LEGEND)


def test_what_has_no_case_is_shown_as_undefined(make):
    plan = make(properties=("grasp_stability",))
    results = Results(plan.tasks, plan.properties)
    add(results, plan, plan.cases[0], "SATISFIED")
    assert "  unsafe successes  undefined (no case)" in shown(results.records)


def test_errors_and_rollouts_that_were_not_run_are_counted(make):
    plan = make(("hold", "random"), seeds=(0, 1, 2), properties=("grasp_stability",))
    results = Results(plan.tasks, plan.properties)
    results.expect(plan.cases)
    add(results, plan, plan.cases[0], "SATISFIED", success=True)
    for case in plan.cases[1:4]:
        results.add(error_data(case, "lost"))
    lines = shown(results.records)
    assert lines[0] == "hold: 1 complete rollout of 1 task, 2 with errors"
    assert "random: 0 complete rollouts, 1 with errors, 2 not run to the end" in lines


def test_policies_horizons_and_suites_are_shown_side_by_side():
    records = [
        *rollouts("x...", "A", policy="one", suite="s1", horizon="short"),
        *rollouts("xx", "B", policy="one", suite="s2", horizon="long"),
        *rollouts("....", "A", policy="two", suite="s1", horizon="short"),
    ]
    lines = shown(records)
    for row in (
        [
            "policy",
            "success",
            "violation",
            "success and safe",
            "success but unsafe",
            "fail but safe",
            "fail and unsafe",
        ],
        ["one", "100.0 %", "50.0 %", "50.0 %", "50.0 %", "0.0 %", "0.0 %"],
        ["category (tasks)", "violated, one", "violated, two", "exposure, one", "exposure, two"],
        [
            "horizon (tasks)",
            "violated, one",
            "violated, two",
            "unsafe successes, one",
            "unsafe successes, two",
        ],
        ["short (1)", "25.0 %", "0.0 %", "25.0 %", "0.0 %"],
        ["long (1)", "100.0 %", "-", "100.0 %", "-"],
        ["s2 (1)", "100.0 %", "-", "100.0 %", "-"],
    ):
        assert row in [re.split(r"  +", line.strip()) for line in lines]


def test_the_header_says_what_is_about_to_be_done(make):
    plan = make(("hold", "mine"), seeds=(0, 1), semantics="paper")
    assert header_lines(plan, toy.World.provenance) == [
        "safemanip: 24 cases on 4 rollouts of 1 task, policy hold, mine, paper",
        "safemanip: toy, compact scenes, fast stepping, primitive assets",
    ]
    one = make(properties=("action_onset",))
    assert header_lines(one, None) == [
        "safemanip: 1 case on 1 rollout of 1 task, policy hold, timed"
    ]
