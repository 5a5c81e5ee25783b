"""A run in robosuite, from the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from pytest_safemanip.trace import files
from tests.plugin.conftest import Suite

CONFTEST = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parents[3])!r})

from tests.robosuite.scripts import Lifts

def pytest_safemanip_policies():
    return {{"lifts": Lifts}}
"""
IN_ROBOSUITE = "--safemanip-backend=robosuite"


@pytest.fixture
def folder(one_suite: Suite) -> Suite:
    one_suite.pytester.makeconftest(CONFTEST)
    return one_suite


def test_a_robot_of_robosuites_is_run_and_its_recording_judged_again_without_it(
    folder: Suite,
) -> None:
    sawyer = f"{IN_ROBOSUITE}:Sawyer"
    result = folder.run(sawyer, "--safemanip-policy=lifts", "--safemanip-tasks=Lift")
    result.assert_outcomes(passed=3, skipped=1)
    result.stdout.fnmatch_lines(["*robosuite, official scenes, exact stepping", "*robot Sawyer*"])
    (path,) = folder.recordings()
    recording = files.load(path)
    assert recording.success
    assert recording.episode.backend == "robosuite"
    assert recording.scene.entities[0].category == "Sawyer"
    again = folder.run(f"--safemanip-recordings={path.parent}", "--safemanip-out=again")
    again.assert_outcomes(passed=3, skipped=1)


def test_all_tasks_are_those_of_the_backend(folder: Suite) -> None:
    result = folder.run(IN_ROBOSUITE, "--safemanip-policy=hold", "--collect-only", "-q")
    assert result.ret == 0
    named = {line.split("[")[1].split("-")[0] for line in result.outlines if "test_safety[" in line}
    assert {"Lift", "TwoArmHandover", "Wipe"} < named
    assert len(named) == 16
    assert "OpenDrawer" not in named


def test_a_task_of_another_backend_says_whose_it_is(folder: Suite) -> None:
    result = folder.run("--safemanip-policy=hold", "--safemanip-tasks=Lift")
    assert result.ret == 4
    line = "'Lift' is a task of robosuite, not of robocasa; give --safemanip-backend=robosuite"
    result.stderr.fnmatch_lines([f"*{line}"])
    result = folder.run(IN_ROBOSUITE, "--safemanip-policy=hold", "--safemanip-tasks=OpenDrawer")
    result.stderr.fnmatch_lines(["*'OpenDrawer' is a task of robocasa, not of robosuite; *"])


def test_a_policy_that_knows_no_task_of_the_backend_is_refused(folder: Suite) -> None:
    result = folder.run(IN_ROBOSUITE, "--safemanip-policy=scripted")
    assert result.ret == 4
    result.stderr.fnmatch_lines(
        ["*policy 'scripted' has no plan for Door, Lift, *; it knows no task of this backend"]
    )
