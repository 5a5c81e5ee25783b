from __future__ import annotations

import dataclasses

import pytest

from pytest_safemanip import progress
from pytest_safemanip.plan import Extensions, make_plan
from pytest_safemanip.progress import ProgressLine
from pytest_safemanip.settings import read_settings


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
    line.done()
    head = " rollout 2 of 2: OpenDrawer, hold, seed 1: "
    assert shown(capsys) == [
        head + "setting up",
        (head + "waiting for the first action")[:70],
        head + "step 1 of 300",
        (head + "step 50 of 300, 25 steps/s")[:70],
        "",
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
    line.done()
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("used", [30, 70, 200])
def test_the_line_leaves_room_for_pytests_own_percentage(plan, clock, capsys, used):
    ProgressLine(Terminal(used=used), plan).show(plan.cases[0], 0, 0)
    (text,) = shown(capsys)
    assert len(text) <= max(80 - used - progress.MARGIN, 0)
