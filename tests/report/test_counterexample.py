from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pytest_safemanip.report.counterexample import (
    MAX_CHARACTERS,
    MAX_FINDINGS,
    counterexample,
    headline,
)
from tests import toy
from tests.report.conftest import finding, severity, verdict

PATH = Path("out/recordings/one.rollout")
WATCH = "safemanip replay x.rollout --params=settled.speed=0.01"
COMMAND = "pytest --safemanip-policy=hold 'safemanip::test_safety[a]'"


@pytest.fixture
def text(make):
    properties = make().properties

    def text(*findings, name="grasp_stability"):
        found = verdict("VIOLATED", *findings)
        return counterexample(properties[name], found, toy.recording(), PATH, WATCH, COMMAND)

    return text


def test_a_counterexample_tells_the_rule_the_rollout_the_step_and_the_way_back(text):
    assert text(finding(3, 4)).splitlines() == [
        "grasp_stability: A grasped object is held firmly until it is released (SafeManip phi 2)",
        "  G a",
        "",
        "rollout  PickPlaceCounterToCabinet, policy toy, seed 0: no success up to step 5 (0.25 s)",
        "  'put the mug into the cabinet'",
        "",
        "VIOLATED for mug (mug) at step 3 (0.15 s), unsafe for 0.10 s",
        "  severity 1.50: margin 1",
        "  mug moved 40 mm",
        "  step 3 breaks it",
        "",
        f"recording       {PATH}",
        f"watch           {WATCH}",
        f"reproduce with  {COMMAND}",
    ]


def test_a_brief_counterexample_has_the_first_violation_and_the_command(make):
    found = verdict("VIOLATED", finding(3, 4), finding(9))
    prop = make().properties["grasp_stability"]
    text = counterexample(prop, found, toy.recording(), PATH, WATCH, COMMAND, brief=True)
    assert text.splitlines() == [
        "grasp_stability: A grasped object is held firmly until it is released (SafeManip phi 2)",
        "VIOLATED for mug (mug) at step 3 (0.15 s), unsafe for 0.10 s",
        "  severity 1.50: margin 1",
        "  mug moved 40 mm",
        "and 1 more",
        f"reproduce with  {COMMAND}",
    ]


@pytest.mark.parametrize("brief", [False, True])
@pytest.mark.parametrize(
    ("last", "line"), [(23, "  cost 10: 5, and 5 a second for 1.00 s"), (3, "  cost 5")]
)
def test_what_a_violation_costs_is_told_where_its_property_says_a_cost(make, brief, last, line):
    prop = make().properties["grasp_stability"]
    found = verdict("VIOLATED", finding(3, last, cost=5.0 * (1.0 + 0.05 * (last - 3))))
    about = found, toy.recording(), PATH, WATCH, COMMAND, brief
    lines = counterexample(replace(prop, cost=5.0, says_cost=True), *about).splitlines()
    assert lines[lines.index("  severity 1.50: margin 1") + 1] == line
    assert "  mug moved 40 mm" in lines
    assert "cost" not in counterexample(prop, *about)


def test_a_deadline_is_told_with_who_has_to_meet_it(text):
    assert "   within 5 s, discharged by physics" in text(finding(), name="release_stability")


def test_a_property_without_entities_names_none(text):
    assert "\nVIOLATED at step 3 (0.15 s)" in text(finding(entities=()))


def test_the_worst_violation_is_told_first_whenever_it_was(text):
    fell = finding(9, 9, entities=("apple",), severity=severity(fall=0.9))
    found = text(finding(3), fell)
    assert found.index("at step 9") < found.index("at step 3")
    assert "  severity 5.70: margin 1, fell 0.90 m\n" in found
    assert headline(verdict("VIOLATED", finding(3), fell), toy.recording()) == (
        "grasp_stability: mug moved 40 mm, at step 9 (0.45 s) (and 1 more)"
    )


def test_only_the_first_violations_are_told_in_full_and_the_others_by_step(text):
    found = text(*(finding(step, step) for step in range(20)))
    assert found.count("VIOLATED for") == MAX_FINDINGS
    assert "and 17 more, from steps 3, 4, 5, 6, 7, 8, 9, 10, ..." in found
    assert "and 1 more, from step 3" in text(*(finding(step, step) for step in range(4)))
    assert "more, from" not in text(*(finding(step, step) for step in range(MAX_FINDINGS)))


def test_the_text_stays_below_its_limit_as_long_as_the_first_violation_does(text):
    proof = "\n".join(["x" * 60] * 30)
    found = text(*(finding(step, step, proof=proof) for step in range(3)))
    assert len(found) <= MAX_CHARACTERS
    assert found.endswith(COMMAND)
    assert "more, from step" in found


@pytest.mark.parametrize(
    ("findings", "line"),
    [
        ([finding(3)], "grasp_stability: mug moved 40 mm, at step 3 (0.15 s)"),
        (
            [finding(3, evidence=()), finding(9)],
            "grasp_stability: bad prefix for mug (mug), at step 3 (0.15 s) (and 1 more)",
        ),
        (
            [finding(3, evidence=(), entities=("pick", "apple"), reason="overdue")],
            "grasp_stability: overdue for pick, apple (apple), at step 3 (0.15 s)",
        ),
        ([finding(3, evidence=(), entities=())], "grasp_stability: bad prefix, at step 3 (0.15 s)"),
    ],
)
def test_the_headline_is_the_worst_violation_in_one_line(findings, line):
    assert headline(verdict("VIOLATED", *findings), toy.recording()) == line


def test_the_counterexample_of_a_real_fault_says_what_happened(rollouts):
    judged = rollouts.get("PickPlaceCounterToCabinet", "scripted:half_inside")
    plan = rollouts.plan("PickPlaceCounterToCabinet", "scripted:half_inside")
    prop = plan.properties["enclosure_release"]
    found = judged.judge.judge(prop)
    text = counterexample(prop, found, judged.recording, judged.path, WATCH, COMMAND)
    assert len(text) <= MAX_CHARACTERS
    assert "of 8 corners of obj were inside" in text
    assert f"VIOLATED for obj ({judged.recording.scene.entity['obj'].category})" in text
    assert "of 8 corners of obj were inside" in headline(found, judged.recording)
