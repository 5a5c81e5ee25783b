from __future__ import annotations

import numpy as np

from pytest_safemanip.report.results import Results, error_data, judged_data
from pytest_safemanip.report.table import header_lines, summary_lines
from tests import toy
from tests.report.conftest import finding, verdict


def add(results, plan, case, outcome, *findings, success=False):
    recording = toy.recording(success=np.full(6, success))
    prop = plan.properties[case.property_id]
    found = verdict(outcome, *findings)
    results.add(judged_data(case, prop, found, recording, plan.settings.out / "x"))


def test_the_table_has_a_row_for_each_category_with_what_was_tested(make):
    plan = make(seeds=(0, 1), properties=("grasp_stability", "enclosure_*"))
    results = Results(plan.tasks)
    results.expect(plan.cases)
    for case in plan.cases:
        if case.property_id == "grasp_stability" and case.seed == 0:
            add(results, plan, case, "VIOLATED", finding(0, 2), success=True)
        elif case.property_id == "grasp_stability":
            add(results, plan, case, "UNRESOLVED")
        else:
            add(results, plan, case, "VACUOUS", success=case.seed == 0)
    assert summary_lines(results) == [
        "hold: 2 complete rollouts",
        "  success    1 of 2 = 50.0 % (9 to 91 %)",
        "  violation  1 of 2 = 50.0 % (9 to 91 %)",
        "  outcomes   0 success and safe, 1 success but unsafe, 1 fail but safe, 0 fail and unsafe",
        "  unsafe successes  1 of 1 = 100.0 % (21 to 100 %)",
        "",
        "  category          triggered  violated         rate (95 %)  exposure  unresolved",
        "  enclosure_access     0 of 2    0 of 2   0.0 % (0 to 66 %)     0.0 %           0",
        "  grasp_stability      2 of 2    1 of 2  50.0 % (9 to 91 %)    25.0 %           1",
    ]


def test_what_has_no_case_is_shown_as_undefined(make):
    plan = make(properties=("grasp_stability",))
    results = Results(plan.tasks)
    add(results, plan, plan.cases[0], "SATISFIED")
    assert "  unsafe successes  undefined (no case)" in summary_lines(results)


def test_errors_and_cases_that_were_not_run_are_counted(make):
    plan = make(("hold", "random"), seeds=(0, 1), properties=("grasp_stability",))
    results = Results(plan.tasks)
    results.expect(plan.cases)
    add(results, plan, plan.cases[0], "SATISFIED", success=True)
    results.add(error_data(plan.cases[1], "lost"))
    results.add(error_data(plan.cases[2], "lost"))
    lines = summary_lines(results)
    assert lines[0] == "hold: 1 complete rollout, 1 with errors"
    assert lines[-3:] == [
        "random: 0 complete rollouts, 1 with errors",
        "",
        "1 of 4 cases were not run",
    ]


def test_the_header_says_what_is_about_to_be_done(make):
    plan = make(("hold", "mine"), seeds=(0, 1), semantics="paper")
    assert header_lines(plan, toy.World.provenance) == [
        "safemanip: 24 cases on 4 rollouts of 1 task, policy hold, mine, paper",
        "safemanip: toy, compact scenes, primitive assets",
    ]
    one = make(properties=("action_onset",))
    assert header_lines(one, None) == [
        "safemanip: 1 case on 1 rollout of 1 task, policy hold, timed"
    ]
