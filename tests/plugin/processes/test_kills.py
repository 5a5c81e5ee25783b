"""Processes that are killed, and clocks that jump: errors in our words, and nothing is lost."""

from __future__ import annotations

import textwrap

import pytest

from tests.plugin.conftest import MODES, Suite
from tests.plugin.toyfolder import set_up

KILLED = """
class Killed:
    '''Its process is killed in one rollout, the first time.'''
    fingerprint = "1"
    def reset(self, episode):
        self.seed = episode.seed
    def act(self, observation):
        import os, pathlib, signal
        place = pathlib.Path("killed")
        if self.seed == 1 and observation.index == 3 and not place.exists():
            place.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return np.zeros(12)

def pytest_safemanip_policies():
    return {"killed": Killed}
"""
JUMPS = """
import random
import time
clock = time.time
time.time = lambda: clock() + random.uniform(-1e8, 1e8)
"""
KEPT = ("--safemanip-policy=killed", "--safemanip-seeds=4")


def with_killed(suite: Suite) -> None:
    set_up(suite)
    with (suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(textwrap.dedent(KILLED))


def test_a_worker_that_dies_is_an_error_and_no_failure(one_suite: Suite) -> None:
    with_killed(one_suite)
    chosen = (*KEPT, *MODES["-n 2"])
    result = one_suite.run_apart(*chosen, "--junitxml=found.xml")
    assert result.ret == 10
    counted = result.parseoutcomes()
    assert counted["errors"] == 2  # the rollout's cases
    assert "failed" not in counted
    result.stdout.fnmatch_lines(
        [
            "_* ERROR at setup of Reach / killed / * / seed 1 _*",
            "worker gw? died at this case: it was killed, as for memory, or *",
            "killed: 3 complete rollouts of 1 task, 1 with errors (1 for failures of the*",
            "INFRASTRUCTURE *",
        ]
    )
    assert "FAILED" not in result.stdout.str()
    assert "crashed while running" not in result.stdout.str()
    xml = (one_suite.pytester.path / "found.xml").read_text()
    assert (xml.count("<error "), xml.count("<failure")) == (2, 0)
    errors = [rollout["error"] for rollout in one_suite.summary()["rollouts"]]
    assert [bool(error) for error in errors] == [False, True, False, False]
    again = one_suite.run_apart(*chosen)
    assert again.ret == 0
    again.stdout.fnmatch_lines(["safemanip: 3 of 4 rollouts reused from *"])
    assert len(one_suite.recordings()) == 4


def test_a_main_process_that_is_killed_loses_the_rollout_it_was_at_and_no_other(
    one_suite: Suite,
) -> None:
    with_killed(one_suite)
    chosen = (*KEPT, *MODES["without xdist"])
    assert one_suite.run_apart(*chosen).ret == -9
    assert [path.stem[-1] for path in one_suite.recordings()] == ["0"]
    again = one_suite.run_apart(*chosen)
    assert again.ret == 0
    again.stdout.fnmatch_lines(["safemanip: 1 of 4 rollouts reused from *"])
    assert len(one_suite.recordings()) == 4


@pytest.mark.parametrize("mode", [MODES["-n 2"], ("--safemanip-jobs=2",)], ids=" ".join)
def test_a_clock_that_jumps_changes_nothing(one_suite: Suite, mode: tuple[str, ...]) -> None:
    set_up(one_suite)
    chosen = ("--safemanip-policy=random", "--safemanip-seeds=3", *mode)
    expected = one_suite.run_apart(*chosen).parseoutcomes()
    before = {path.name: path.read_bytes() for path in one_suite.recordings()}
    assert len(before) == 3
    conftest = one_suite.pytester.path / "conftest.py"
    conftest.write_text(JUMPS + conftest.read_text())
    for more in ((), ("--safemanip-fresh",)):
        assert one_suite.run_apart(*chosen, *more).parseoutcomes() == expected
        assert {path.name: path.read_bytes() for path in one_suite.recordings()} == before
    rollouts = one_suite.summary()["rollouts"]
    assert [rollout["error"] for rollout in rollouts] == [""] * 3
