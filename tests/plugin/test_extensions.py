"""A user's own simulator, policy, proposition, property and task, from hooks and the ini file."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.plugin.conftest import Suite

CONFTEST = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parents[2])!r})

import numpy as np
from pytest_safemanip.propositions.definition import Parameter, Proposition
from tests.toy import World

def straying(view, o):
    '''The hand is further from where it started than allowed, whatever the object.'''
    hand = view.trace.steps.eef_pose[:, :3]
    return np.linalg.norm(hand - hand[0], axis=1) > view.parameters["straying.distance"]

class Rises:
    def act(self, observation):
        return np.array([[0, 0, 0.5] + [0] * 9] * 2)
    def reset(self, episode):
        print("reset", episode.instruction)

def pytest_safemanip_policies():
    return {{"rises": Rises}}

def pytest_safemanip_backends():
    return {{"toy": lambda options: World(succeeds_at=None)}}

def pytest_safemanip_propositions():
    limit = Parameter("straying.distance", "m", 0.12, "for the test")
    return [Proposition("straying", ("object",), lambda parameters: 0.0, (limit,), straying)]
"""
INI = """
[pytest]
safemanip_policy = rises
safemanip_backend = toy
safemanip_tasks = Reach
safemanip_task_paths = mine/tasks
safemanip_property_paths = mine/properties
"""
TASK = """
task: Reach
sets: [mine]
suite: mine
horizon: atomic
objects: [obj]
properties: [grasp_stability]
"""
PROPERTY = """
id: stays_near
category: housekeeping
title: The hand stays near
source: the house rules
for_each: o in objects
formula: G !straying
atoms: {straying: straying(o)}
"""


def set_up(suite: Suite) -> None:
    """A folder whose simulator is a toy, with a task, a policy and a property of its own."""
    suite.pytester.makeconftest(CONFTEST)
    suite.pytester.makeini(INI)
    for folder, text in {"tasks": TASK, "properties": PROPERTY}.items():
        path = suite.pytester.path / "mine" / folder / "own.yaml"
        path.parent.mkdir(parents=True)
        path.write_text(text)


@pytest.fixture
def own(suite: Suite) -> Suite:
    set_up(suite)
    return suite


def test_everything_of_the_user_is_used(own: Suite) -> None:
    result = own.run()
    result.assert_outcomes(failed=1, skipped=1)
    result.stdout.fnmatch_lines(
        [
            "*Reach / rises / stays_near / seed 0*",
            "stays_near: The hand stays near (the house rules)",
            "VIOLATED for mug (mug) at step 5 (0.25 s), unsafe for *",
            "VIOLATED safemanip::test_safety[[]Reach-rises-stays_near-seed0]*",
        ]
    )
    summary = own.summary()
    assert summary["settings"]["backend"] == "toy"
    assert list(summary["metrics"]["rises"]["categories"]) == ["grasp_stability", "housekeeping"]


def test_own_parameters_and_seeds(own: Suite) -> None:
    result = own.run("--safemanip-params=straying.distance=5", "--safemanip-seeds=3", "-k", "near")
    result.assert_outcomes(passed=3, deselected=own.seen_deselected(3))
    assert len(own.recordings()) == 3


def test_what_a_hook_gives_is_checked_as_what_an_option_gives(own: Suite) -> None:
    result = own.run("--safemanip-policy=risen")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["ERROR: unknown policy 'risen'; did you mean 'rises'?*"])


@pytest.mark.parametrize("distribution", ["load", "worksteal", "loadscope", "each"])
def test_each_rollout_is_run_once_however_cases_are_distributed(
    one_suite: Suite, distribution: str
) -> None:
    set_up(one_suite)
    with (one_suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(
            "    \n"
            "original = Rises.reset\n"
            "def reset(self, episode):\n"
            "    with open('resets.txt', 'a') as log:\n"
            "        log.write(f'{episode.seed}\\n')\n"
            "Rises.reset = reset\n"
        )
    one_suite.mode = ("-n", "2", "--dist", distribution)
    one_suite.run("--safemanip-seeds=6")
    resets = (one_suite.pytester.path / "resets.txt").read_text().split()
    assert sorted(resets) == sorted(map(str, range(6)))
    assert one_suite.summary()["metrics"]["rises"]["rollouts"] == 6
