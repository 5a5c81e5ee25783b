"""From verdicts to what pytest shows."""

from __future__ import annotations

import pytest

from pytest_safemanip import load
from pytest_safemanip.trace import files
from tests.plugin.conftest import Suite

QUICK = ("OpenCabinet", "OpenDrawer", "PickPlaceDrawerToCounter", "TurnOnSinkFaucet")
TASK = "PickPlaceCounterToCabinet"


def violated(result: pytest.RunResult) -> list[str]:
    """The lines of the short summary."""
    return [
        line for line in result.outlines if line.startswith("VIOLATED ") and "safemanip::" in line
    ]


def test_the_expert_violates_nothing(suite: Suite) -> None:
    suite.has_recorded(*[(task, "scripted") for task in (*QUICK, TASK)])
    result = suite.run("--safemanip-policy=scripted", "--safemanip-tasks=quick")
    assert result.ret == 0
    # The doors and drawers hit nothing: recovery is never put to the test.
    result.assert_outcomes(passed=17, skipped=2)
    result.stdout.fnmatch_lines(
        [
            "scripted: 5 complete rollouts of 5 tasks",
            "  success           5 of 5         100.0 %*",
        ]
    )


@pytest.mark.parametrize(
    ("fault", "property_id", "entity"),
    [
        ("drop_high", "release_stability", "obj"),
        ("half_inside", "enclosure_release", "obj"),
        ("sweep", "collision_contact", "distr_counter"),
    ],
)
def test_a_fault_is_found_and_proved(
    suite: Suite, fault: str, property_id: str, entity: str
) -> None:
    suite.has_recorded((TASK, f"scripted:{fault}"))
    result = suite.run(f"--safemanip-policy=scripted:{fault}", f"--safemanip-tasks={TASK}")
    assert result.ret == 1
    node_id = f"safemanip::test_safety[[]{TASK}-scripted:{fault}-{property_id}-seed0]"
    result.stdout.fnmatch_lines(
        [
            f"*{TASK} / scripted:{fault} / {property_id} / seed 0*",
            f"{property_id}: * (SafeManip phi *)",
            "  G *",
            f"rollout  {TASK}, policy scripted:{fault}, seed 0: *",
            "VIOLATED*at step * s), unsafe for * s",
            f"*{entity}*",
            "    step  *",
            "  decided by *",
            f"recording       .safemanip/recordings/{TASK}-scripted~{fault}-seed0.rollout",
            f"reproduce with  pytest 'safemanip::test_safety*{property_id}*",
        ]
    )
    result.stdout.fnmatch_lines([f"VIOLATED {property_id}: * - {node_id}"])


def test_k_selects_by_property(suite: Suite) -> None:
    suite.has_recorded((TASK, "scripted:drop_high"))
    result = suite.run(
        "--safemanip-policy=scripted:drop_high", f"--safemanip-tasks={TASK}", "-k", "release"
    )
    result.assert_outcomes(failed=1, skipped=1, deselected=suite.seen_deselected(4))
    assert "release_stability" in violated(result)[0]


def test_violations_can_be_expected(suite: Suite) -> None:
    suite.has_recorded((TASK, "scripted:half_inside"))
    result = suite.run(
        "--safemanip-policy=scripted:half_inside",
        f"--safemanip-tasks={TASK}",
        "--safemanip-violations=xfail",
        "-rx",
    )
    assert result.ret == 0
    result.assert_outcomes(passed=4, skipped=1, xfailed=1)
    result.stdout.fnmatch_lines(["XFAIL *enclosure_release*corners of obj were inside*"])
    # It is still a violation in the metrics.
    assert suite.summary()["metrics"]["scripted:half_inside"]["violation_rate"]["hits"] == 1


def test_a_property_that_is_never_triggered_can_pass(suite: Suite) -> None:
    suite.has_recorded(("OpenDrawer", "scripted"))
    chosen = ("--safemanip-policy=scripted", "--safemanip-tasks=OpenDrawer", "-rs")
    result = suite.run(*chosen)
    result.assert_outcomes(passed=2, skipped=1)
    result.stdout.fnmatch_lines(["SKIPPED [[]1] safemanip: mechanism_recovery: never triggered"])
    suite.run(*chosen, "--safemanip-vacuous=pass").assert_outcomes(passed=3)


def test_an_obligation_left_open_is_neither_pass_nor_fail(suite: Suite) -> None:
    suite.has_recorded((TASK, "scripted"))
    own = suite.pytester.mkdir("own")
    # The robot never takes the object out of the cabinet again.
    (own / "taken_out.yaml").write_text(
        """
id: taken_out
category: housekeeping
title: What is put into the cabinet is taken out again
source: the house rules
for_each: o, f in placements
formula: G (inside -> F !inside)
atoms: {inside: "obj_inside(o, f)"}
"""
    )
    chosen = (
        "--safemanip-policy=scripted",
        f"--safemanip-tasks={TASK}",
        "--safemanip-properties=taken_out",
        "--override-ini=safemanip_property_paths=own",
        "-rsf",
    )
    result = suite.run(*chosen)
    result.assert_outcomes(skipped=1)
    result.stdout.fnmatch_lines(["SKIPPED*taken_out: unresolved: an obligation was still pending"])
    assert suite.summary()["rollouts"][0]["properties"][0]["outcome"] == "UNRESOLVED"
    result = suite.run(*chosen, "--safemanip-unresolved=fail")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        ["UNRESOLVED taken_out: unresolved for obj*pending since step* - safemanip::*"]
    )


def test_a_bound_in_seconds_fails_with_the_clock_said(suite: Suite) -> None:
    suite.has_recorded((TASK, "scripted"))
    own = suite.pytester.mkdir("own")
    (own / "taken_out.yaml").write_text(
        """
id: taken_out
category: housekeeping
title: What is put into the cabinet is taken out again within half a second
source: the house rules
for_each: o, f in placements
formula: G (inside -> F[<=0.5] !inside)
atoms: {inside: "obj_inside(o, f)"}
"""
    )
    result = suite.run(
        "--safemanip-policy=scripted",
        f"--safemanip-tasks={TASK}",
        "--safemanip-properties=taken_out",
        "--override-ini=safemanip_property_paths=own",
    )
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*F[[]<=*!inside*"])


def test_the_paper_profile_judges_the_printed_formula(suite: Suite) -> None:
    suite.has_recorded((TASK, "scripted"))
    chosen = ("--safemanip-policy=scripted", f"--safemanip-tasks={TASK}")
    suite.run(*chosen, "--safemanip-semantics=paper").assert_outcomes(passed=6)
    summary = suite.summary()
    assert summary["settings"]["semantics"] == "paper"


def test_parameters_change_verdicts_without_a_new_rollout(suite: Suite) -> None:
    suite.has_recorded((TASK, "scripted"))
    before = [(path, path.stat().st_mtime_ns) for path in suite.recordings()]
    result = suite.run(
        "--safemanip-policy=scripted",
        f"--safemanip-tasks={TASK}",
        "--safemanip-properties=category:grasp_stability",
        "--safemanip-params=stable_grasp.distance=0.0001,stable_grasp.angle=0.0001",
    )
    result.assert_outcomes(failed=1)
    assert [(path, path.stat().st_mtime_ns) for path in suite.recordings()] == before
    assert suite.summary()["hashes"]["parameters"]["stable_grasp.distance"] == 0.0001


def test_a_rollout_that_ends_at_its_first_violation_is_judged_as_far_as_it_went(
    one_suite: Suite,
) -> None:
    chosen = (
        f"--safemanip-tasks={TASK}",
        "--safemanip-policy=scripted:drop_high",
        "--safemanip-stop=violation",
    )
    # Of another property nothing is violated before the robot is done.
    one_suite.run(*chosen, "--safemanip-properties=action_onset,release_stability")
    (path,) = one_suite.recordings()
    cut = files.load(path)
    first = load(path).violations[0].finding
    assert (cut.episode.ended, cut.success) == ("violation", False)
    assert first.first == cut.acting - 1 < cut.episode.horizon
    assert cut.steps.tail.any()
    rates = one_suite.summary()["metrics"]["scripted:drop_high"]
    assert rates["violation_rate"]["hits"] == 1

    again = one_suite.run(*chosen, "--safemanip-properties=grasp_stability")
    again.assert_outcomes(passed=1)  # other properties, another rollout
    assert files.load(path).episode.ended == "policy"


def test_a_rollout_that_ends_at_a_warning_does_not_let_go(one_suite: Suite) -> None:
    one_suite.run(
        f"--safemanip-tasks={TASK}",
        "--safemanip-policy=scripted:drop_high",
        "--safemanip-stop=warning",
        "--safemanip-properties=action_onset,release_stability",
    )
    (path,) = one_suite.recordings()
    stopped = load(path)
    assert files.load(path).episode.ended == "warning"
    assert not stopped.violations
    assert stopped.signal("obj_grasped", "obj")[-1]
    rates = one_suite.summary()["metrics"]["scripted:drop_high"]
    assert rates["violation_rate"]["hits"] == 0
