"""Rollouts side by side from one process: the same run, sooner."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.plugin.conftest import MODES, Suite
from tests.plugin.toyfolder import INI, set_up

FAILS = """
class Fails:
    def reset(self, episode):
        self.seed = episode.seed
    def act(self, observation):
        if self.seed == 1:
            raise ValueError("the network exploded")
        return np.zeros(12)

class Dies:
    '''Ends its process as a crash does: with jobs nothing of it runs elsewhere.'''
    def act(self, observation):
        raise SystemExit(3)

def pytest_safemanip_policies():
    return {"rises": Rises, "fails": Fails, "dies": Dies}
"""
REAL = ("--safemanip-policy=scripted", "--safemanip-tasks=OpenDrawer,TurnOnSinkFaucet")


def outcomes(suite: Suite) -> dict[str, Any]:
    """What the summary says of every rollout."""
    found = suite.summary()
    return {key: found[key] for key in ("rollouts", "metrics", "tables", "cases")}


def recorded(suite: Suite) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in suite.recordings()}


def test_verdicts_and_recordings_are_those_of_any_other_number(
    one_suite: Suite, make_suite: Callable[[tuple[str, ...]], Suite]
) -> None:
    set_up(one_suite)
    seen = {}
    for name, mode in {**MODES, "jobs": ("--safemanip-jobs=3",)}.items():
        suite = make_suite(mode)
        result = suite.run(
            "--safemanip-policy=random,hold", "--safemanip-seeds=4", f"--safemanip-out={name}"
        )
        suite.out = suite.pytester.path / name
        assert result.parseoutcomes()["failed"] == 1
        seen[name] = outcomes(suite), recorded(suite)
    assert len(seen["jobs"][1]) == 8
    for found in seen.values():
        assert found == seen["without xdist"]


def test_real_simulators_side_by_side_record_the_same_bit_for_bit(one_suite: Suite) -> None:
    one_suite.has_recorded(("OpenDrawer", "scripted"), ("TurnOnSinkFaucet", "scripted"))
    before = recorded(one_suite)
    result = one_suite.run(*REAL, "--safemanip-jobs=2", "--safemanip-fresh")
    assert result.ret == 0
    assert recorded(one_suite) == before
    assert not list((one_suite.out / "logs").iterdir())  # of simulators that ended badly


def test_a_rollout_that_fails_fails_its_own_cases_only(one_suite: Suite) -> None:
    set_up(one_suite)
    with (one_suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(FAILS)
    result = one_suite.run(
        "--safemanip-policy=fails,dies,hold", "--safemanip-seeds=3", "--safemanip-jobs=3", "-rE"
    )
    errors = one_suite.summary()["cases"]["errors"]
    assert {text.split(": ")[-1] for text in errors.values()} == {"the network exploded", "3"}
    assert len(errors) == 2 * (1 + 3)
    result.stdout.fnmatch_lines(["*ValueError: the network exploded*"])
    assert one_suite.summary()["metrics"]["hold"]["rollouts"] == 3


OWN = """
from pytest_safemanip.plugin.simulation import simulation_of

def test_between_cases(pytestconfig, safemanip_rollout):
    simulation = simulation_of(pytestconfig)
    found = safemanip_rollout("Reach", policy="hold", seed=7).recording
    assert [request.seed for request in simulation.own_backend.requests] == [7]
    assert (simulation.own_backend is simulation.backend) == (simulation.settings.jobs == 1)
"""


@pytest.mark.parametrize("jobs", [1, 3])
def test_a_test_that_asks_for_a_rollout_has_a_simulator_that_runs_nothing_else(
    one_suite: Suite, jobs: int
) -> None:
    set_up(one_suite)
    one_suite.pytester.makepyfile(test_own=OWN)
    result = one_suite.run(
        "--safemanip-seeds=6", f"--safemanip-jobs={jobs}", "-k", "between or near"
    )
    assert result.parseoutcomes() == {"passed": 1, "failed": 6, "deselected": 6}


def test_nothing_is_run_that_was_deselected(one_suite: Suite) -> None:
    set_up(one_suite)
    one_suite.run("--safemanip-seeds=5", "--safemanip-jobs=3", "-k", "seed1 or seed3")
    assert [path.stem[-1] for path in one_suite.recordings()] == ["1", "3"]


def test_early_stopping_decides_on_the_same_cases(one_suite: Suite) -> None:
    set_up(one_suite)
    gate = ["--safemanip-gate=violation_rate <= 10 %", "--safemanip-early-stop=0.05"]
    found = []
    for jobs in ("1", "3"):
        out = one_suite.out = one_suite.pytester.path / f"jobs{jobs}"
        one_suite.run(
            *gate, "--safemanip-seeds=60", f"--safemanip-jobs={jobs}", f"--safemanip-out={out}"
        )
        summary = one_suite.summary()
        decided = [record["seed"] for record in summary["rollouts"]]
        found.append((decided, summary["release"], summary["cases"]["skipped_rollouts"]))
        assert len(decided) < 20
        # What was under way when it was decided is all that is recorded beyond.
        assert len(one_suite.recordings()) <= len(decided) + 4 * int(jobs)
    assert found[0] == found[1]


def test_the_first_failure_can_end_the_run(one_suite: Suite) -> None:
    set_up(one_suite)
    result = one_suite.run("--safemanip-seeds=50", "--safemanip-jobs=2", "-x")
    assert result.parseoutcomes()["failed"] == 1
    assert len(one_suite.recordings()) <= 10


@pytest.mark.parametrize("jobs", ["0", "many", "-2", "1.5", "1001"])
def test_a_number_that_is_none_is_refused(one_suite: Suite, jobs: str) -> None:
    set_up(one_suite)
    result = one_suite.run(f"--safemanip-jobs={jobs}")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"ERROR: --safemanip-jobs: expected auto or a number *{jobs}'"])


def test_workers_run_one_each_and_say_so(make_suite: Callable[..., Suite]) -> None:
    suite = make_suite(MODES["-n 2"])
    set_up(suite)
    suite.pytester.makeini(INI + "safemanip_jobs = auto\n")
    result = suite.run("--safemanip-seeds=2", "-k", "near")
    result.stdout.fnmatch_lines(["safemanip: each worker runs one rollout at a time; *"])
    assert result.parseoutcomes()["failed"] == 2


def test_a_case_is_reproduced_without_the_others(one_suite: Suite) -> None:
    set_up(one_suite)
    other = "--safemanip-report=markdown", "--safemanip-ci=off", "--safemanip-gate=exposure <= 1"
    result = one_suite.run("--safemanip-jobs=2", *other, "-k", "near", "--xfail-tb", "-rx")
    result.stdout.fnmatch_lines(["reproduce with  pytest 'safemanip::test_safety*"])
    path: Path = one_suite.out / "summary.json"
    assert json.loads(path.read_text())["rollouts"]
