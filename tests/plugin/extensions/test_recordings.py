"""Judging recordings that were made elsewhere, on a machine without a simulator."""

from __future__ import annotations

import pytest

from tests.plugin.conftest import Suite

TASK = "PickPlaceCounterToCabinet"
CONFTEST = "import sys\nsys.modules.update(robocasa=None, robosuite=None, mujoco=None)\n"


@pytest.fixture
def elsewhere(suite: Suite) -> Suite:
    suite.has_recorded((TASK, "scripted"), (TASK, "scripted:sweep"), ("OpenDrawer", "scripted"))
    (suite.out / "recordings").rename(suite.pytester.path / "brought")
    suite.out.rmdir()
    suite.pytester.makeconftest(CONFTEST)
    return suite


def test_the_same_verdicts_without_a_simulator(elsewhere: Suite) -> None:
    result = elsewhere.run("--safemanip-recordings=brought")
    result.assert_outcomes(passed=13, failed=1, skipped=1)
    result.stdout.fnmatch_lines(["VIOLATED *collision_contact-seed0]*"])
    result.stdout.fnmatch_lines(["safemanip: 15 cases on 3 recordings of 2 tasks, policy *"])
    brought = elsewhere.pytester.path / "brought"
    assert elsewhere.summary()["settings"]["recordings"] == str(brought)
    assert not (elsewhere.out / "recordings").exists()


def test_policies_and_tasks_select_recordings(elsewhere: Suite) -> None:
    chosen = "--safemanip-recordings=brought"
    elsewhere.run(chosen, "--safemanip-tasks=OpenDrawer").assert_outcomes(passed=2, skipped=1)
    result = elsewhere.run(chosen, "--safemanip-policy=scripted:sweep", "-k", "contact")
    result.assert_outcomes(failed=1, deselected=elsewhere.seen_deselected(5))


def test_two_recordings_of_one_rollout_are_refused(elsewhere: Suite) -> None:
    folder = elsewhere.pytester.path / "brought"
    first = next(folder.glob("OpenDrawer*"))
    (folder / "copy.rollout").write_bytes(first.read_bytes())
    result = elsewhere.run("--safemanip-recordings=brought")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["ERROR: *are recordings of the same rollout"])


def test_a_threshold_changes_an_outcome(elsewhere: Suite) -> None:
    forces = "collision.force=10000,bad_contact.force=10000,bad_contact.limit=10000"
    policy, thresholds = "--safemanip-policy=scripted:sweep", f"--safemanip-params={forces}"
    result = elsewhere.run("--safemanip-recordings=brought", policy, thresholds, "-k", "contact")
    result.assert_outcomes(passed=1, deselected=elsewhere.seen_deselected(5))
