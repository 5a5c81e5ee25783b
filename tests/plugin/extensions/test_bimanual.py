"""A simulator with another robot: two hands, another action, other scenes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.policies.base import PolicyLike
from pytest_safemanip.policies.simple import Hold, Random
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace import Recording, files
from tests import bimanual
from tests.plugin.conftest import Suite
from tests.propositions.stage import BINDING, true_at

CONFTEST = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parents[3])!r})

from tests.bimanual import SIMULATOR, HandsOver
from tests.toy import World, simulator

def pytest_safemanip_policies():
    return {{"hands_over": HandsOver}}

def pytest_safemanip_backends():
    toy = simulator(lambda options: World())
    return {{"bench": SIMULATOR, "toy": toy, "broken": lambda options: None}}
"""
INI = """
[pytest]
safemanip_backend = bench
safemanip_tasks = HandOver
safemanip_task_paths = tasks
"""
TASK = """
task: HandOver
sets: [mine]
suite: mine
horizon: atomic
objects: [obj]
properties: [grasp_stability, release_stability]
supports: {obj: [counter]}
"""


@pytest.fixture
def bench(one_suite: Suite) -> Suite:
    one_suite.pytester.makeconftest(CONFTEST)
    one_suite.pytester.makeini(INI)
    path = one_suite.pytester.path / "tasks" / "own.yaml"
    path.parent.mkdir()
    path.write_text(TASK)
    return one_suite


def values(recording: Recording, name: str) -> list[int]:
    """Steps at which a proposition about the mug is true."""
    catalogue = Catalogue()
    view = View(recording.trace, BINDING, catalogue.parameters({}), catalogue)
    return true_at(view(name, "mug"))


def test_what_one_hand_gives_to_the_other_was_held_all_the_time(bench: Suite) -> None:
    bench.run("--safemanip-policy=hands_over").assert_outcomes(passed=2)
    (path,) = bench.recordings()
    recording = files.load(path)
    held, released = values(recording, "obj_grasped"), values(recording, "obj_released")
    assert held == list(range(held[0], held[-1] + 1))
    assert released == [held[-1] + 1]
    # The right hand let go long before, when the left one had it.
    assert recording.steps.commands[released[0] - 10].tolist() == [1.0, -1.0]
    assert recording.episode.scenes == "bench"
    assert recording.episode.stepping == "whole"


def test_what_slips_out_of_the_second_hand_is_dropped(bench: Suite) -> None:
    bench.run("--safemanip-policy=hands_over:yanks").assert_outcomes(failed=1, skipped=1)


@pytest.mark.parametrize("policy", [Hold, Random])
def test_simple_policies_know_the_robot(bench: Suite, policy: PolicyLike) -> None:
    bench.run(f"--safemanip-policy={policy.__name__.lower()}", "--safemanip-vacuous=pass")
    (path,) = bench.recordings()
    actions = files.load(path).steps.action[1:61]
    low, high = np.array([(e.low, e.high) for e in bimanual.ENTRIES], np.float32).T
    assert ((actions >= low) & (actions <= high)).all()
    if policy is Hold:
        assert (actions == np.float32((0, 0, 0, 0.08, 0, 0, 0, -10))).all()
    else:
        assert (np.ptp(actions, axis=0) > 0.8 * (high - low)).all()


def test_a_policy_with_eyes_needs_what_the_backend_observes(bench: Suite) -> None:
    result = bench.run("--safemanip-policy=openpi", "--safemanip-scenes=bench")
    assert result.ret == 4
    needs = "policy 'openpi' needs 'video.robot0_agentview_left'"
    result.stderr.fnmatch_lines([f"*{needs}, which backend 'bench' does not observe; *nothing"])


@pytest.mark.parametrize(
    ("argument", "line"),
    [
        ("--safemanip-scenes=benhc", "*unknown scenes 'benhc'; did you mean 'bench'?*"),
        ("--safemanip-scenes=compact", "*unknown scenes 'compact'; known: bench, shop floor*"),
        ("--safemanip-backend=broken", "*backend 'broken': the hook gives a function, expected *"),
    ],
)
def test_what_the_backend_does_not_have_is_a_configuration_error(
    bench: Suite, argument: str, line: str
) -> None:
    result = bench.run("--safemanip-policy=hold", argument)
    assert result.ret == 4
    result.stderr.fnmatch_lines([line])


def test_the_recording_of_another_robot_is_not_played_back(bench: Suite) -> None:
    bench.run("--safemanip-policy=hands_over")
    bench.out.rename(bench.pytester.path / "before")
    played = "--safemanip-policy=recording:before"
    bench.run(played).assert_outcomes(passed=2)
    result = bench.run(played, "--safemanip-backend=toy")
    result.stdout.fnmatch_lines(["*its actions are not those of the robot Toy*"])
