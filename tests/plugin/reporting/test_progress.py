from __future__ import annotations

import contextlib
import dataclasses
import os
import pty
import re
import subprocess
import sys
from types import SimpleNamespace

import pytest

from pytest_safemanip.plugin.progress import line as progress
from pytest_safemanip.plugin.progress import workers
from pytest_safemanip.plugin.progress.line import ProgressLine
from pytest_safemanip.plugin.read_settings import read_settings
from pytest_safemanip.run.plan import Extensions, make_plan
from pytest_safemanip.run.session import SafetySession
from pytest_safemanip.run.under_way import Pace, UnderWay, span
from tests.plugin.toyfolder import set_up


class Clock:
    now = 100.0

    def monotonic(self):
        return self.now


class Terminal:
    """What pytest writes on: a terminal of 60 columns, or none."""

    def __init__(self, isatty=True, used=0, fullwidth=80):
        self.isatty = self.hasmarkup = isatty
        self.fullwidth, self.width_of_current_line = fullwidth, used
        self.pluginmanager = self

    def getplugin(self, name):
        return self if name == "terminalreporter" else None

    def get_terminal_writer(self):
        return self

    def get_verbosity(self):
        return 0

    def write_line(self, text):
        sys.stdout.write(f"{text}\n")

    def flush(self):
        """Nothing is held back."""


@pytest.fixture
def plan(pytestconfig):
    settings = dataclasses.replace(
        read_settings(pytestconfig), policies=("hold",), tasks=("OpenDrawer",), seeds=(0, 1)
    )
    return make_plan(settings, Extensions({}, (), {}))


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(progress, "time", clock)
    return clock


def shown(capsys):
    """The text between saving the cursor and going back to it."""
    out = capsys.readouterr().out
    assert "\n" not in out
    return [part.split("\x1b8")[0] for part in out.split("\x1b7\x1b[K")[1:]]


def test_the_line_tells_which_rollout_is_at_which_step(plan, clock, capsys):
    line = ProgressLine(Terminal(), plan)
    line.show(plan.cases[-1], 0, 0)
    line.show(plan.cases[-1], 0, 300)
    line.show(plan.cases[-1], 1, 300)
    clock.now += 2.0
    line.show(plan.cases[-1], 50, 300)
    line.done(plan.cases[-1])
    tail = " (OpenDrawer, hold, seed 1)"
    assert shown(capsys) == [
        " 2 of 2: setting up" + tail,
        " 2 of 2: waiting for the first action" + tail,
        " 2 of 2: step 1 of 300" + tail,
        " 2 of 2: step 50 of 300, 25 steps/s" + tail,
        "",
    ]


def test_the_line_tells_how_much_a_script_has_tried(plan, clock, capsys):
    line = ProgressLine(Terminal(), plan)
    for tried in range(3):
        line.show(plan.cases[-1], 0, 300, tried)
        clock.now += 1.0
    line.show(plan.cases[-1], 1, 300)
    assert shown(capsys) == [
        *(
            f" 2 of 2: planning, {tried} steps rehearsed (OpenDrawer, hold, seed 1)"
            for tried in range(3)
        ),
        " 2 of 2: step 1 of 300 (OpenDrawer, hold, seed 1)",
    ]


def test_the_line_is_written_four_times_a_second_at_most(plan, clock, capsys):
    line = ProgressLine(Terminal(), plan)
    for step in range(1, 101):
        line.show(plan.cases[0], step, 300)
        clock.now += 0.0625
    assert len(shown(capsys)) == 25


def test_nothing_is_written_where_there_is_no_terminal(plan, clock, capsys):
    line = ProgressLine(Terminal(isatty=False), plan)
    line.show(plan.cases[0], 0, 0)
    line.done(plan.cases[-1])
    assert capsys.readouterr().out == ""


def test_in_a_log_what_takes_long_is_told_once_a_minute(plan, clock, capsys):
    line = ProgressLine(Terminal(isatty=False), plan)
    for number in range(1, 14):
        clock.now += 10.0
        line.say(f" OpenDrawer, hold: {number} rollouts searched")
        line.say("")
    assert capsys.readouterr().out == (
        "OpenDrawer, hold: 6 rollouts searched\nOpenDrawer, hold: 12 rollouts searched\n"
    )


def test_what_a_worker_says_stands_beside_the_rollouts(plan, tmp_path):
    worker = workers.WorkerProgress(plan, tmp_path / "gw0.json")
    shown = workers.WorkersProgress(Terminal(), tmp_path)
    worker.say(" OpenDrawer, hold: 8 rollouts searched")
    assert shown.text(0.0) == " OpenDrawer, hold: 8 rollouts searched"
    worker.say("")
    assert shown.text(0.0) == ""


@pytest.mark.parametrize("used", [30, 70, 200])
def test_the_line_leaves_room_for_pytests_own_percentage(plan, clock, capsys, used):
    ProgressLine(Terminal(used=used), plan).show(plan.cases[0], 0, 0)
    (text,) = shown(capsys)
    assert len(text) <= max(80 - used - progress.MARGIN, 0)


def test_of_several_rollouts_the_line_tells_how_many_and_how_long_it_will_take(plan, clock, capsys):
    line = ProgressLine(Terminal(fullwidth=100), plan)
    first, second = plan.cases[0], plan.cases[-1]
    line.expect(8, 2)
    line.show(first, 0, 0)
    line.show(second, 0, 0)
    line.refresh(True)
    clock.now += 8.0  # no rate comes of what is no step yet
    line.refresh(True)
    for step in range(1, 31):
        line.show(first, step, 100)
        line.show(second, step, 300)
    clock.now += 4.0
    line.refresh(True)
    clock.now += 0.1
    line.refresh(True)
    line.done(first)  # at success, before its horizon
    clock.now += 6.0
    line.refresh(True)
    line.refresh(False)
    assert shown(capsys) == [
        " 0 of 8 rollouts, 2 setting up",
        " 0 of 8 rollouts, 2 setting up, 8 s",
        " 0 of 8 rollouts, 2 running, 15 steps/s, 76 s left",
        " 1 of 8 rollouts, 1 running, 0 steps/s, 63 s left",
        "",
    ]


def test_what_an_earlier_run_recorded_is_done_and_says_nothing_of_the_speed(plan, clock, capsys):
    line = ProgressLine(Terminal(fullwidth=100), plan)
    line.expect(8, 2)
    line.show(plan.cases[0], 0, 0)
    line.done(plan.cases[-1])
    line.refresh(True)
    clock.now += 10.0
    line.show(plan.cases[0], 50, 100)
    line.refresh(True)
    assert shown(capsys)[1:] == [" 1 of 8 rollouts, 1 running, 0 steps/s, 2 min left"]


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.4, "0 s"), (89, "89 s"), (90, "2 min"), (5400, "1.5 h")]
)
def test_a_time_is_in_the_unit_that_one_thinks_in(seconds, text):
    assert span(seconds) == text


def test_a_rollout_that_makes_no_step_is_said_to_wait_for_its_server():
    state = UnderWay()
    state.note("a", 0, 0, 0.0, True)  # set up
    state.note("b", 5, 100, 0.0, True)
    state.note("c", 5, 100, 0.0, False)  # a slow simulator
    assert state.text(4, Pace(), 0.5) == " 0 of 4 rollouts, 2 running, 1 setting up"
    assert state.text(4, Pace(), 2.0).endswith(", 1 at the server")
    state.note("b", 6, 100, 2.1, True)
    assert "server" not in state.text(4, Pace(), 2.2)


def test_rollouts_whose_script_plans_make_no_steps():
    state, pace = UnderWay(), Pace()
    for second in range(4):
        state.note("a", 0, 100, float(second), False, 50 * second)
        state.note("b", 2, 100, float(second), False, 1)
        text = state.text(4, pace, float(second))
    assert text == " 0 of 4 rollouts, 2 running, 2 planning (151 steps rehearsed), 3 s"


def test_the_speed_is_that_of_the_last_seconds():
    state, pace = UnderWay(), Pace()
    for second in range(60):
        for step in range(10 if second < 40 else 50):
            state.note("a", step + 1, 100, float(second), False)
        text = state.text(2, pace, float(second))
    assert ", 50 steps/s" in text
    assert len(pace.looks) < 10


def test_ctrl_c_removes_the_line(plan, clock, capsys):
    line = ProgressLine(Terminal(), plan)
    line.show(plan.cases[0], 0, 0)
    SafetySession(plan, None, None, "run", line).leave()
    assert shown(capsys)[-1] == ""


ASSETS = "--override-ini=safemanip_assets=primitive"
SLOW = """
class Slow(Rises):
    def act(self, observation):
        import time
        time.sleep(0.2)
        return super().act(observation)

def pytest_safemanip_policies():
    return {"slow": Slow}
"""


@pytest.mark.parametrize("arguments", [["-n", "2"], ["-p", "no:xdist", "--safemanip-jobs=2"]])
def test_a_terminal_shows_how_the_run_gets_on_without_colours_too(one_suite, arguments):
    set_up(one_suite)
    folder = one_suite.pytester.path
    with (folder / "conftest.py").open("a") as conftest:
        conftest.write(SLOW)
    command = [sys.executable, "-m", "pytest", "--safemanip-policy=slow", "--safemanip-seeds=3"]
    screen, terminal = pty.openpty()
    environ = {**os.environ, "NO_COLOR": "1", "TERM": "xterm", "COLUMNS": "100"}
    with subprocess.Popen(
        [*command, *arguments, "-p", "no:hypothesispytest", ASSETS],
        cwd=folder,
        stdout=terminal,
        env=environ,
    ) as run:
        os.close(terminal)
        output = b""
        with contextlib.suppress(OSError):  # the terminal is closed
            while part := os.read(screen, 65536):
                output += part
        assert run.wait(30) == pytest.ExitCode.TESTS_FAILED
    os.close(screen)
    text = output.decode()
    assert re.search(r"\x1b7\x1b\[K 0 of 3 rollouts, 2 running, \d+ steps/s, \d+ s left\x1b8", text)
    assert re.search(r"[12] of 3 rollouts, 1 running", text)
    assert not re.search(r"\x1b\[[0-9;]*m", text)
    # Nothing is left behind: what follows a line about progress is its removal, or another.
    assert text.rindex("\x1b7\x1b[K\x1b8") > text.rindex("rollouts, ")
    assert not (one_suite.out / "progress").exists()


def test_workers_write_nothing_where_nobody_looks(one_suite, monkeypatch):
    set_up(one_suite)
    monkeypatch.setattr(workers, "shutil", SimpleNamespace(rmtree=lambda *_, **__: None))
    one_suite.mode = ("-n", "2")
    one_suite.run().assert_outcomes(failed=1, skipped=1)
    assert not (one_suite.out / "progress").exists()
