from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from pytest_safemanip.metrics.groups import measure_each
from pytest_safemanip.report.header import header_lines
from pytest_safemanip.report.questions import question_lines
from pytest_safemanip.report.table import LEGEND, brief_lines, summary_lines
from pytest_safemanip.run.results import Results, error_data, judged_data
from tests import toy
from tests.metrics.build import bad, rollout, rollouts, severe
from tests.metrics.build import verdict as verdict_of
from tests.report.conftest import finding, verdict


def shown(records):
    return summary_lines(records, measure_each(records))


def add(results, plan, case, outcome, *findings, success=False, tail=1):
    recording = toy.recording(tail=tail, success=np.full(6, success))
    prop = plan.properties[case.property_id]
    found = verdict(outcome, *findings)
    results.add(judged_data(case, prop, found, recording, plan.settings.out / "x"))


def test_violations_that_no_exposure_counts_are_told_of_once():
    late = [rollout(True, bad("a", (10, 12)), seed=seed) for seed in (0, 1)]
    told = [line for line in shown(late) if "settle tail" in line]
    assert told == ["exposure leaves out the settle tail, in which 2 violations are or go on"]
    assert not any("settle tail" in line for line in shown(rollouts("xx")))


def test_recordings_without_a_settle_tail_are_counted(make):
    plan = make(seeds=(0, 1, 2), properties=("grasp_stability",))
    results = Results(plan.tasks, plan.properties)
    results.expect(plan.cases)
    for case in plan.cases:
        add(results, plan, case, "SATISFIED", tail=int(case.seed == 0))
    assert "  truncated  2 recordings without a settle tail" in shown(results.records)


def test_rollouts_that_a_warning_ended_are_counted_by_what_was_near():
    near = ["release_stability for mug in 5.1 s", "collision_contact in 0.2 s", ""]
    records = [
        rollout(False, verdict_of(), seed=seed, warned=near[max(seed - 2, 0)]) for seed in range(5)
    ]
    lines = shown(records)
    told = " ".join(" ".join(lines).split())
    assert "stopped 4 rollouts before a violation: release_stability 3, collision_contact 1" in told
    (brief,) = brief_lines(records, measure_each(records))
    assert brief.endswith(", 4 stopped before a violation")
    assert "  stopped before   release_stability for mug in 5.1 s" in shown(records[:1])
    assert not any("stopped" in line for line in shown(records[4:]))


def test_why_a_policy_gave_up_is_said_of_the_first_few_rollouts():
    why = "grasp obj: finger_left presses on obj's body with 3 N"
    records = [
        rollout(False, verdict_of(), seed=seed, failure=why if seed else "") for seed in range(8)
    ]
    told = " ".join(" ".join(shown(records)).split())
    task = records[0].task
    assert f"gave up {task} seed 1: {why} gave up {task} seed 2: {why}" in told
    assert told.count(why) == 5
    assert "gave up 2 more, see `safemanip show`" in told
    assert f"gave up {why}" in " ".join(" ".join(shown(records[1:2])).split())
    assert not any("gave up" in line for line in shown(records[:1]))
    for some, end in ((records, ", 7 gave up"), (records[1:2], f"; gave up: {why}")):
        (brief,) = brief_lines(some, measure_each(some))
        assert brief.endswith(end)


def test_the_first_lines_name_what_no_warning_comes_before(make):
    plan = make(properties=("grasp_stability",))
    early = dataclasses.replace(plan, settings=dataclasses.replace(plan.settings, stop="warning"))
    assert not any("warning" in line for line in header_lines(early, toy.World.provenance))
    blind = {
        name: dataclasses.replace(one, margin=None, forecast=None)
        for name, one in plan.catalogue.items()
    }
    lines = header_lines(dataclasses.replace(early, catalogue=blind), toy.World.provenance)
    told = " ".join(" ".join(lines).split())
    assert "no warning stops a rollout before a violation of grasp_stability: their" in told
    timed = dataclasses.replace(plan.properties["grasp_stability"], deadline_s=5.0)
    late = dataclasses.replace(early, catalogue=blind, properties={timed.id: timed})
    assert not any("warning" in line for line in header_lines(late, toy.World.provenance))


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
    assert lines[:9] == [
        "hold: 2 complete rollouts of 1 task",
        "                                                        95 % CI",
        "                                           95 % CI  (new tasks,",
        "                               rate  (these tasks)   clustered)",
        "  success           1 of 2   50.0 %      9 to 91 %            -",
        "  violation         1 of 2   50.0 %      9 to 91 %            -",
        "  unsafe successes  1 of 1  100.0 %    21 to 100 %            -",
        "  exposure                   25.0 %      3 to 80 %            -",
        "  outcomes  0 success and safe, 1 success but unsafe,",
    ]
    assert lines[9] == "            1 fail but safe, 0 fail and unsafe"
    assert lines[10:13] == [
        "  severity  at worst 1.50 (grasp_stability), median 1.50",
        "  cost      0.55 a rollout, 1.10 at most",
        "",
    ]
    assert [re.split(r"  +", line.strip()) for line in lines[13:16]] == [
        ["category (tasks)", "triggered", "violated", "rate", "95 % CI", "exposure"],
        ["enclosure_access (1)", "never", "-", "-", "-", "-"],
        ["grasp_stability (1)", "2 of 2", "1 of 2", "50.0 %", "9 to 91 %", "25.0 %"],
    ]
    assert lines[16] == "  unresolved: grasp_stability 1"
    assert lines[-2:] == list(LEGEND)
    assert max(map(len, lines)) <= 80


def test_all_categories_fit_a_terminal(make):
    plan = make(seeds=tuple(range(50)))
    results = Results(plan.tasks, plan.properties)
    results.expect(plan.cases)
    for case in plan.cases:
        add(results, plan, case, "UNRESOLVED" if case.seed % 2 else "VIOLATED", finding(0, 2))
    lines = shown(results.records)
    assert any("50 of 50" in line for line in lines)
    assert max(map(len, lines)) <= 80


def test_where_nothing_completed_there_is_no_table(make):
    plan = make(("hold", "random"), properties=("grasp_stability",))
    results = Results(plan.tasks, plan.properties)
    results.expect(plan.cases)
    for case in plan.cases:
        results.add(error_data(case, "lost"))
    assert shown(results.records) == [
        "hold: 0 complete rollouts, 1 with errors",
        "",
        "random: 0 complete rollouts, 1 with errors",
    ]


def test_clipped_actions_of_a_local_policy_are_counted_and_those_of_a_server_apart():
    local = rollouts("..", policy="local", served={"clipped": "7"}) + rollouts("e", "U")
    facts = {"protocol": "openpi", "calls": "2", "actions": "9", "clipped": "5", "seeded": "yes"}
    lines = shown([*local, *rollouts("..", policy="served", served=facts)])
    assert "  actions    14 of 216 entries outside [-1, 1] and clipped" in lines
    assert sum("actions  " in line for line in lines) == 1
    assert any("10 of their 216 entries" in line for line in lines)


def test_what_has_no_case_is_shown_as_undefined():
    records = [rollout(False, verdict_of("a"), seed=seed) for seed in (0, 1)]
    assert "  unsafe successes  undefined" in shown(records)


def test_of_one_rollout_there_are_outcomes_and_no_statistics():
    verdicts = [severe(1.4), severe(1.2, 2.5, name="b"), verdict_of("c")]
    verdicts += [verdict_of("d", "VACUOUS", triggered=False)]
    lines = shown([rollout(True, *verdicts)])
    assert lines == [
        "p: 1 complete rollout of 1 task",
        "  outcome          success but unsafe",
        "  violated         b (2.50), a (1.40)",
        "  kept             c",
        "  never triggered  d",
    ]
    assert not any("%" in line for line in lines)


def test_severity_is_told_where_there_are_violations():
    records = [
        rollout(True, severe(1.5, 3.25), severe(5.5, name="b"), seed=0),
        rollout(True, severe(2.5), seed=1),
        rollout(True, verdict_of("a"), seed=2),
    ]
    lines = shown(records)
    at = lines.index("  severity  at worst 5.50 (b), median 2.88")
    assert lines[at + 1] == (
        "            rollouts with 2 of 3 at 2 or more, 1 of 3 at 3 or more, 1 of 3 at 5 or more"
    )
    assert not any("severity" in line for line in shown(records[2:] * 2))
    assert not any("severity" in line for line in shown([rollout(True, bad("a")), records[2]]))


@pytest.mark.parametrize(
    ("success", "own", "text"),
    [
        (True, verdict_of("a"), "success and safe"),
        (False, verdict_of("a"), "fail but safe"),
        (False, bad("a"), "fail and unsafe"),
    ],
)
def test_of_one_rollout_the_outcome_is_told(success, own, text):
    assert f"  outcome          {text}" in shown([rollout(success, own)])


def test_of_one_rollout_in_brief_there_is_no_rate():
    records = [rollout(True, bad("a"))]
    assert brief_lines(records, measure_each(records)) == [
        "p: 1 of 1 rollout complete, successful, violated"
    ]


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
            "safe",
            "unsafe",
            "safe",
            "unsafe",
        ],
        ["one", "100.0 %", "50.0 %", "50.0 %", "50.0 %", "0.0 %", "0.0 %"],
        ["violated by category (tasks)"],
        ["exposure by category (tasks)"],
        ["violated by horizon (tasks)"],
        ["unsafe successes by horizon (tasks)"],
        ["short", "long"],
        ["policy", "(1)", "(1)"],
        ["one", "25.0 %", "100.0 %"],
        ["two", "0.0 %", "-"],
    ):
        assert row in [re.split(r"  +", line.strip()) for line in lines]


@pytest.mark.parametrize("width", [80, 100])
def test_many_policies_are_shown_in_blocks_that_fit_the_terminal(width):
    names = [f"policy-number-{n}" for n in range(11)]
    records = [
        record
        for name in names
        for task, suite, horizon in (("A", "s1", "short"), ("B", "s2", "long"))
        for record in rollouts("x..", task, policy=name, suite=suite, horizon=horizon)
    ]
    metrics = measure_each(records)
    lines = question_lines(metrics, width)
    assert max(len(line) for line in lines) <= width
    assert [line.split()[0] for line in lines if line.startswith("policy-")][:11] == names
    whole = summary_lines(records, metrics, width)
    assert len(whole) < 150
    assert sum(line.startswith("  category (tasks)") for line in whole) == 0
    assert sum("violated 2 of 6, 33.3 %, 95 % CI" in line for line in whole) == 11


@pytest.mark.parametrize("width", [80, 100])
def test_categories_that_do_not_fit_side_by_side_are_in_a_second_table(width):
    names = [f"a_category_of_{n}" for n in range(20)]
    records = [
        rollout(True, *(bad(name, category=name) for name in names), policy=policy, seed=seed)
        for policy in ("one", "two")
        for seed in (0, 1)
    ]
    lines = question_lines(measure_each(records), width)
    assert max(len(line) for line in lines) <= width
    first = lines[lines.index("violated by category (tasks)") :]
    first = first[: first.index("")]
    rows = [line.split()[1:] for line in first if line.startswith("two")]
    assert len(rows) > 1
    assert " ".join(" ".join(row) for row in rows).split() == ["100.0", "%"] * 20


def test_the_brief_summary_is_a_line_for_each_policy():
    records = [*rollouts("x...", policy="one"), *rollouts("e", policy="two")]
    assert brief_lines(records, measure_each(records)) == [
        "one: 4 of 4 rollouts complete, 100.0 % successful, 25.0 % violated (5 to 70 %)",
        "two: 0 of 1 rollout complete",
    ]


def test_the_header_says_what_is_about_to_be_done(make):
    plan = make(("hold", "mine"), seeds=(0, 1), semantics="paper")
    assert header_lines(plan, toy.World.provenance) == [
        "safemanip: 24 cases on 4 rollouts of 1 task, policy hold, mine, paper",
        "safemanip: toy, compact scenes, fast stepping, primitive assets",
    ]
    many = make(("hold", "random"), seeds=(0, 1))
    many = dataclasses.replace(many, policies=dict.fromkeys(f"policy-{n}" for n in range(11)))
    cases = [dataclasses.replace(many.cases[0], policy=name) for name in many.policies]
    lines = header_lines(dataclasses.replace(many, cases=tuple(cases)), None)
    assert max(map(len, lines)) <= 80
    assert "policy-10" in lines[-1]
    one = make(properties=("action_onset",))
    assert header_lines(one, None) == [
        "safemanip: 1 case on 1 rollout of 1 task, policy hold, timed"
    ]
