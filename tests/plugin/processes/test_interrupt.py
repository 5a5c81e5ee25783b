"""Ctrl-C keeps what was recorded and says what is missing."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.plugin.conftest import MODES, Suite
from tests.plugin.toyfolder import set_up

SLOW = """
class Waits:
    fingerprint = "1"
    def reset(self, episode):
        self.seed = episode.seed
    def act(self, observation):
        import pathlib, time
        if self.seed == 2 and observation.index == 3:
            pathlib.Path("waiting").touch()
            time.sleep(60)
        return np.zeros(12)

def pytest_safemanip_policies():
    return {"waits": Waits}
"""


STUBBORN = """
import pathlib, time
def pytest_sessionfinish():
    pathlib.Path("ending").touch()
    time.sleep(10)
"""

LINELESS = """
import sys, types
class Interrupted:
    fingerprint = "1"
    def reset(self, episode): ...
    def act(self, observation):
        with open(__file__):
            pass
        frame = sys._getframe()
        offset = next(begin for begin, _, line in frame.f_code.co_lines() if line is None)
        entry = types.TracebackType(None, frame, offset, -1)
        raise KeyboardInterrupt().with_traceback(entry)

def pytest_safemanip_policies():
    return {"interrupted": Interrupted}
"""
JOBS = "--safemanip-jobs=2"


@pytest.mark.parametrize("mode", ["without xdist", JOBS, "-n 2"])
def test_what_was_recorded_is_kept_and_summarised(one_suite: Suite, mode: str) -> None:
    set_up(one_suite)
    folder = one_suite.pytester.path
    with (folder / "conftest.py").open("a") as conftest:
        conftest.write(SLOW)
    command = [sys.executable, "-m", "pytest", "--safemanip-policy=waits", "--safemanip-seeds=4"]
    several = mode != "without xdist"
    with started([*command, *MODES.get(mode, (mode,))], folder) as run:
        wait_for(folder / "waiting", run)
        if several:
            wait_for(one_suite.out / "recordings" / "Reach-waits-seed3.rollout", run)
        os.killpg(run.pid, signal.SIGINT)  # as a terminal does: the workers hear it too
        began = time.monotonic()
        output = run.communicate(timeout=30)[0].decode()
        assert time.monotonic() - began < 15  # the policy would have slept for a minute
    assert run.returncode == pytest.ExitCode.INTERRUPTED, output
    summary = one_suite.summary()
    done = {0, 1, 3} if several else {0, 1}
    assert {r["seed"] for r in summary["rollouts"]} >= {0, 1}
    assert {int(p.stem[-1]) for p in one_suite.recordings()} == done
    assert any("seed2" in node_id for node_id in summary["cases"]["missing"])
    assert "cases were not run; the same command goes on where this one stopped" in output
    # The interrupted rollout is no known failure: the next run runs it.
    subprocess.run([*command[:-1], "--safemanip-seeds=0,1,3"], cwd=folder, check=True, timeout=60)


@pytest.mark.parametrize("mode", ["without xdist", JOBS])
def test_a_second_ctrl_c_ends_the_run_at_once_without_a_traceback(
    one_suite: Suite, mode: str
) -> None:
    set_up(one_suite)
    folder = one_suite.pytester.path
    with (folder / "conftest.py").open("a") as conftest:
        conftest.write(SLOW + STUBBORN)
    command = [sys.executable, "-m", "pytest", "--safemanip-policy=waits", "--safemanip-seeds=4"]
    with started([*command, *MODES.get(mode, (mode,))], folder) as run:
        wait_for(folder / "waiting", run)
        os.killpg(run.pid, signal.SIGINT)
        wait_for(folder / "ending", run)
        began = time.monotonic()
        os.killpg(run.pid, signal.SIGINT)
        output = run.communicate(timeout=30)[0].decode()
        assert time.monotonic() - began < 2.0  # and not the ten seconds that ending takes
    assert run.returncode == pytest.ExitCode.INTERRUPTED
    assert output.endswith("safemanip: interrupted again, ended at once; recordings are kept\n")
    assert "Traceback" not in output
    assert len(one_suite.recordings()) >= 2


def test_an_interrupted_run_writes_the_reports_that_were_asked_for(one_suite: Suite) -> None:
    set_up(one_suite)
    folder = one_suite.pytester.path
    with (folder / "conftest.py").open("a") as conftest:
        conftest.write(SLOW)
    command = [sys.executable, "-m", "pytest", "--safemanip-policy=waits", "--safemanip-seeds=4"]
    with started([*command, "--safemanip-report=markdown"], folder) as run:
        wait_for(folder / "waiting", run)
        os.killpg(run.pid, signal.SIGINT)
        output = run.communicate(timeout=30)[0].decode()
    assert "report markdown: .safemanip/summary.md" in output
    assert "conftest.py" in output.split("KeyboardInterrupt")[1]  # the line that was interrupted
    assert (
        "0 of 2 complete rollouts violated, 2 rollouts incomplete"
        in (one_suite.out / "summary.md").read_text()
    )


def test_ctrl_c_where_python_knows_no_line_ends_as_elsewhere(one_suite: Suite) -> None:
    set_up(one_suite)
    with (one_suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(LINELESS)
    result = one_suite.run_apart("--safemanip-policy=interrupted")
    assert result.ret == pytest.ExitCode.INTERRUPTED
    result.stdout.fnmatch_lines(["*KeyboardInterrupt*", "*conftest.py*"])
    result.stdout.no_fnmatch_line("*INTERNALERROR*")


@contextlib.contextmanager
def started(command: list[str], folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A run in a session of its own, that hears Ctrl-C even if this one was started deaf to it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    run = subprocess.Popen(
        command,
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    signal.signal(signal.SIGINT, before)
    with run:
        try:
            yield run
        finally:
            if run.poll() is None:
                os.killpg(run.pid, signal.SIGKILL)


def wait_for(path: Path, run: subprocess.Popen[bytes]) -> None:
    end = time.monotonic() + 30
    while not path.exists():
        assert run.poll() is None, run.communicate()[0].decode()
        assert time.monotonic() < end
        time.sleep(0.05)
