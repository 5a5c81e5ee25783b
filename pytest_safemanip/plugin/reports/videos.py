"""Draws the videos of a run when it is over, on the main process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pytest_safemanip.report.numbers import counted
from pytest_safemanip.run.invocation import Invocation
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.results import Results
from pytest_safemanip.video.of_run import Drawn, draw_videos, wanted_of
from pytest_safemanip.video.progress import Bar

MOST_FAILED = 10
"""How many are told why they were not drawn."""


class Filming:
    """Draws what ``--safemanip-video`` asks for, and says where it is.

    Args:
        plan: the run.
        results: what it found out.
        invocation: what paths in messages refer to.
    """

    def __init__(self, plan: Plan, results: Results, invocation: Invocation) -> None:
        self._plan, self._results, self._invocation = plan, results, invocation
        self._drawn: Drawn | None = None

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Draw, unless somebody has interrupted the run; what is missing then fails it."""
        if session.exitstatus == pytest.ExitCode.INTERRUPTED:
            return
        wanted = wanted_of(self._results.records, self._plan.settings.video)
        if not wanted:
            return
        reporter: Any = session.config.pluginmanager.getplugin("terminalreporter")
        if reporter is not None:
            reporter.ensure_newline()

        with Bar() as bar:

            def show(number: int, target: Path) -> Any:
                what = f"video {number} of {len(wanted)}, {target.name}"
                return lambda drawn, total: bar.show(what, drawn, total)

            bar.say(f"videos: setting up the scene of the first of {len(wanted)}")
            self._drawn = draw_videos(self._plan, wanted, show)
        if self._drawn.interrupted:
            session.exitstatus = pytest.ExitCode.INTERRUPTED
        elif self._drawn.unavailable or self._drawn.failed:
            session.exitstatus = session.exitstatus or pytest.ExitCode.TESTS_FAILED

    @pytest.hookimpl(trylast=True)
    def pytest_terminal_summary(self, terminalreporter: Any, config: pytest.Config) -> None:
        """Say where they are, and why some are not."""
        if self._drawn is None or config.option.no_summary:
            return
        for line in self._lines(self._drawn):
            terminalreporter.write_line(line)

    def _lines(self, drawn: Drawn) -> list[str]:
        lines = []
        if drawn.written:
            place = self._invocation.relative_path(drawn.written[0].parent)
            several = f"{len(drawn.written)} of {counted(drawn.wanted, 'video')}"
            several += f", {drawn.kept} of them drawn before" if drawn.kept else ""
            stopped = " (interrupted)" if drawn.interrupted else ""
            lines.append(f"videos: {place}, {several}{stopped}")
        elif drawn.interrupted:
            lines.append("videos: interrupted before the first was drawn")
        if drawn.unavailable:
            lines.append(f"no videos: {drawn.unavailable}")
        lines += [f"not drawn: {text}" for text in drawn.failed[:MOST_FAILED]]
        more = len(drawn.failed) - MOST_FAILED
        return lines + ([f"not drawn: {more} more"] if more > 0 else [])
