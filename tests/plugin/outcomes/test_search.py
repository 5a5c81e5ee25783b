"""Searches and the failures that they keep, as pytest runs them."""

from __future__ import annotations

import os
import shutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.plugin.conftest import MODES, Suite
from tests.plugin.processes.test_interrupt import started, wait_for
from tests.plugin.toyfolder import set_up

WEAK = """
class Weak:
    '''Rises too far where its hand seems to be 12 mm ahead and 8 mm to the right.'''
    fingerprint = 1
    def reset(self, episode):
        self.rises = None
    def act(self, observation):
        if self.rises is None:
            x, y = observation.step.eef_poses[0, :2]
            self.rises = x > 0.0115 and y + 0.5 < -0.0075
        action = np.zeros(12)
        action[2] = 0.5 if self.rises else 0.1
        return action

class Firm(Weak):
    def reset(self, episode):
        self.rises = False

class Slow(Weak):
    def act(self, observation):
        import pathlib, time
        x = observation.step.eef_poses[0, 0]
        if x != 0.0:
            pathlib.Path("waiting").touch()
            time.sleep(60)
        return super().act(observation)

class Breaks(Weak):
    def act(self, observation):
        if abs(observation.step.eef_poses[0, 1] + 0.5) > 0.001:
            raise ValueError("out of reach")
        return super().act(observation)

def pytest_safemanip_policies():
    return {"weak": Weak, "firm": Firm, "slow": Slow, "breaks": Breaks}
"""
SPACE = """
dimensions:
  forward: {calibration: hand, along: forward, limits: [-30 mm, 30 mm], price: 5 mm}
  left: {calibration: hand, along: left, limits: [-30 mm, 30 mm], price: 5 mm}
  noise: {noise: actions, limits: [0 %, 5 %], price: 1 %}
"""
REGRESSION = """task: Reach
property: stays_near
seed: 0
backend: toy
scenes: compact
changes: [{noise: actions, size: 3 %}]"""
KEPT = (".safemanip", "regressions")
SEARCH = ("--safemanip-search=48", "--safemanip-spaces=space.yaml")
TOLD = "stays_near when the hand seems 12 mm farther from the robot than it is and the hand seems"


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where what the search of the weak policy left is, once a test needed it."""
    return tmp_path_factory.mktemp("search") / "kept"


@pytest.fixture
def suite(make_suite: Callable[..., Suite]) -> Suite:
    """A folder with policies that can be searched."""
    suite = make_suite(MODES["without xdist"])
    set_up(suite)
    with (suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(WEAK)
    (suite.pytester.path / "space.yaml").write_text(SPACE)
    return suite


@pytest.fixture
def searched(suite: Suite, kept: Path) -> Suite:
    """An earlier run has searched the weak policy there."""
    here = suite.pytester.path
    if not kept.exists():
        suite.run("--safemanip-policy=weak", "-k", "test_search", *SEARCH)
        for folder in KEPT:
            shutil.copytree(here / folder, kept / folder)
        return suite
    for folder in KEPT:
        shutil.copytree(kept / folder, here / folder)
    return suite


def of(suite: Suite, name: str = "stays_near") -> dict[str, Any]:
    """What the summary says about the search for a property."""
    (own,) = [s for s in suite.summary()["searches"] if s["property"] == name]
    found: dict[str, Any] = own
    return found


def test_a_failure_is_found_kept_and_tried_again(suite: Suite) -> None:
    result = suite.run("--safemanip-policy=weak", *SEARCH)
    result.assert_outcomes(passed=1, failed=1, skipped=2)
    result.stdout.fnmatch_lines(
        [
            "safemanip: searches: 2, up to 48 rollouts each",
            "*_ search / Reach / weak / stays_near _*",
            f"fails {TOLD} 8 mm farther right than it is (every time)",
            "VIOLATED for mug *",
            "reproduce with *-search=48*safemanip::test_search[[]Reach-weak-stays_near]*",
            "=* searches =*",
            "weak in Reach: * rollouts, 3 dimensions",
            "    undecided: triggered with a change in none of * rollouts",
            "    forward: survives 11 mm, fails at 12 mm",
            "    kept in regressions/Reach-weak-stays_near.yaml",
        ]
    )
    failure = of(suite)["failure"]
    assert (suite.out / failure["recording"]).is_file()
    assert (failure["exact"], failure["failed"]) == (True, 1)
    kept = yaml.safe_load((suite.pytester.path / failure["kept"]).read_text())
    assert [change["size"] for change in kept["changes"]] == ["12 mm", "-8 mm"]

    result = suite.run("--safemanip-policy=weak")
    result.assert_outcomes(passed=1, failed=1, skipped=1)
    result.stdout.fnmatch_lines(
        [
            "safemanip: 1 kept failure of regressions/ tried again",
            "*_ regression / Reach-weak-stays_near / weak _*",
            f"still fails {TOLD} 8 mm farther right than it is: stays_near: bad prefix*",
        ]
    )
    node = "safemanip::test_regression[Reach-weak-stays_near-weak]"
    suite.run("--safemanip-policy=weak", node).assert_outcomes(failed=1)
    suite.run("--safemanip-policy=firm", "-k", "regression").assert_outcomes(passed=1)


def test_a_kept_failure_that_shows_nothing_is_skipped(suite: Suite) -> None:
    folder = suite.pytester.path / "regressions"
    folder.mkdir()
    (folder / "held.yaml").write_text(REGRESSION.replace("stays_near", "grasp_stability"))
    result = suite.run("--safemanip-policy=firm", "-k", "regression", "-rs")
    result.assert_outcomes(skipped=1)
    result.stdout.fnmatch_lines(["*grasp_stability: never triggered*"])


def test_a_kept_failure_that_is_unresolved_fails_where_that_is_wanted(suite: Suite) -> None:
    own = suite.pytester.path / "mine" / "properties"
    strays = (own / "own.yaml").read_text().replace("stays_near", "strays_once")
    (own / "other.yaml").write_text(strays.replace("G !straying", "F straying"))
    folder = suite.pytester.path / "regressions"
    folder.mkdir()
    (folder / "held.yaml").write_text(REGRESSION.replace("stays_near", "strays_once"))
    chosen = "--safemanip-policy=firm", "-k", "regression"
    suite.run(*chosen).assert_outcomes(skipped=1)
    result = suite.run(*chosen, "--safemanip-unresolved=fail")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*strays_once: unresolved*"])


def test_side_by_side_it_is_the_same_search(searched: Suite) -> None:
    alone = of(searched)
    for mode in (*MODES["without xdist"], "--safemanip-jobs=3"), MODES["-n 2"]:
        shutil.rmtree(searched.out)
        searched.mode = mode
        searched.run("--safemanip-policy=weak", "-k", "test_search", *SEARCH)
        assert of(searched) == alone


def test_a_later_run_goes_on_from_what_is_known(suite: Suite) -> None:
    suite.run("--safemanip-policy=weak", "--safemanip-search=8", *SEARCH[1:])
    assert of(suite)["reused"] == 0
    first = of(suite)["margins"]
    suite.run("--safemanip-policy=weak", "--safemanip-search=16", *SEARCH[1:])
    assert of(suite)["margins"][: len(first)] == first
    assert of(suite)["reused"] == len(first) < len(of(suite)["margins"])


def test_tolerance_decides_a_gate(searched: Suite) -> None:
    bounds = ("7 mm", "0.75 cm", "9 mm", "1 deg")
    gates = [f"--safemanip-gate=tolerance[stays_near] >= {bound}" for bound in bounds]
    result = searched.run("--safemanip-policy=weak", *SEARCH, *gates)
    result.stdout.fnmatch_lines(
        [
            "  PASS          tolerance[[]stays_near] >= 7 mm, weak: 7 mm; survives 7 mm, fails*",
            "  INCONCLUSIVE  tolerance[[]stays_near] >= 0.75 cm, weak: 0.7 cm; *",
            "  FAIL          tolerance[[]stays_near] >= 9 mm, weak: 7 mm; *",
            "  INCONCLUSIVE  tolerance[[]stays_near] >= 1 deg, weak: undefined; no rollout that*",
        ]
    )
    result = searched.run("--safemanip-policy=weak", gates[0])
    result.stdout.fnmatch_lines(["  INCOMPLETE  tolerance*undefined; no search that it"])
    never = "--safemanip-gate=tolerance[grasp_stability] >= 1 mm"
    result = searched.run("--safemanip-policy=weak", *SEARCH, never)
    result.stdout.fnmatch_lines(["  INCONCLUSIVE  tolerance*undefined; *"])


def test_a_gate_is_not_left_out_where_searches_alone_are_run(searched: Suite) -> None:
    gate = "--safemanip-gate=tolerance[stays_near] >= 7 mm"
    result = searched.run("--safemanip-policy=weak", "-k", "grasp and search", *SEARCH, gate)
    result.stdout.fnmatch_lines(["  INCOMPLETE  tolerance*"])
    assert result.ret == pytest.ExitCode.TESTS_FAILED


def test_what_breaks_is_no_verdict(suite: Suite) -> None:
    result = suite.run(
        "--safemanip-policy=breaks", "-k", "test_search", "--safemanip-search=16", SEARCH[1]
    )
    result.assert_outcomes(errors=2)
    found = of(suite)
    assert found["refused"] > 5
    assert "out of reach" in found["errors"][0]
    result.stdout.fnmatch_lines(["*could not be begun*", "  a rollout failed: *out of reach*"])


def test_ctrl_c_keeps_what_was_found(suite: Suite) -> None:
    folder = suite.pytester.path
    words = ["--safemanip-policy=slow,weak", *SEARCH, "-p", "no:xdist", "-k", "test_search"]
    with started([sys.executable, "-m", "pytest", *words], folder) as run:
        wait_for(folder / "waiting", run)
        os.killpg(run.pid, signal.SIGINT)
        output = run.communicate(timeout=30)[0].decode()
    assert "KeyboardInterrupt" in output
    assert "slow in Reach: 1 rollout, 3 dimensions" in output
    assert "nothing found in 1 rollout so far" in output
    assert (suite.out / "searches" / "Reach-slow.jsonl").read_text().count("\n") >= 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--safemanip-search=0",), "--safemanip-search: expected a number from 1 to*"),
        (("--safemanip-search=9", "--safemanip-spaces=no.yaml"), "*no.yaml*"),
        (("--safemanip-spaces=near.yaml",), "--safemanip-spaces says what to search: *search=200*"),
        (("--safemanip-search=9", "--safemanip-shard=1/2"), "*a search is no part of a shard*"),
        (("safemanip::test_regression[near-weak]",), "unknown node id: *near-weak*"),
        (("--safemanip-gate=tolerance[x] >= 3 cm",), "*no property 'x' in this run*"),
    ],
)
def test_what_cannot_be_searched_is_refused(
    suite: Suite, arguments: tuple[str, ...], message: str
) -> None:
    result = suite.run("--safemanip-policy=weak", *arguments)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"ERROR: {message}"])


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("property: stay_near", "unknown property 'stay_near'; did you mean 'stays_near'?"),
        ("task: Reech", "unknown task 'Reech'; did you mean 'Reach'?"),
        ("backend: robocassa", "backend: unknown backend 'robocassa'; did you mean 'robocasa'?"),
        ("scenes: compct", "unknown scenes 'compct'; did you mean 'compact'?"),
        ("changes: []", "*key 'changes': expected 1 to 40, found 0"),
        ("changes: [{push: cup, size: 1 N s, at: 1 s, towards: 0 deg}]", "*no 'cup' to change*"),
        ("changes: [{nois: actions, size: 3 %}]", "*one key that is a kind*did you mean 'noise'?"),
    ],
)
def test_a_kept_failure_that_could_never_be_tried_is_refused(
    suite: Suite, line: str, message: str
) -> None:
    lines = {own.partition(":")[0]: own for own in (*REGRESSION.split("\n"), line)}
    (suite.pytester.path / "regressions").mkdir()
    (suite.pytester.path / "regressions" / "near.yaml").write_text("\n".join(lines.values()))
    result = suite.run("--safemanip-policy=weak")
    result.stderr.fnmatch_lines([f"ERROR: *near.yaml:*{message}"])


def test_a_search_that_another_version_has_kept_is_an_error_with_the_remedy(suite: Suite) -> None:
    (suite.out / "searches").mkdir(parents=True)
    (suite.out / "searches" / "Reach-weak.jsonl").write_text('{"key": "a"}\n')
    result = suite.run("--safemanip-policy=weak", "-k", "test_search", *SEARCH)
    result.assert_outcomes(errors=2)
    result.stdout.fnmatch_lines(["*Reach-weak.jsonl: not of this version of *; delete the file*"])
