"""A live line about the rollouts that are running, where somebody can see it."""

from __future__ import annotations

import os
import threading
import time
from contextlib import AbstractContextManager, nullcontext

import pytest

from pytest_safemanip.run.cases import Case
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.under_way import Pace, UnderWay

PERIOD = 0.25
"""Seconds between two updates."""
MARGIN = 10
"""Columns that pytest keeps for its own percentage."""
LOG_PERIOD = 60.0
"""Seconds between two lines of what takes long, in a log."""


class ProgressLine:
    """Text right of the cursor that is rewritten in place and leaves nothing behind.

    Where the output is no terminal, nothing is written of rollouts, of which pytest has its own
    letters, and of what takes longer than that a line now and then. Of rollouts in other threads
    it is told by them, and written by the one that waits: pytest's capturing is not for several.
    """

    def __init__(self, config: pytest.Config, plan: Plan) -> None:
        self._config, self._plan = config, plan
        self._order = {r: n for n, r in enumerate(dict.fromkeys(c.rollout for c in plan.cases), 1)}
        self._shown = self._started = 0.0
        self._logged = time.monotonic()
        self._total, self._several = len(self._order), False
        self._changing = threading.Lock()
        self._state, self._pace = UnderWay(), Pace()

    def expect(self, rollouts: int, jobs: int) -> None:
        """See :class:`~pytest_safemanip.run.session.Progress`."""
        self._total, self._several = rollouts, jobs > 1

    def show(self, case: Case, step: int, horizon: int, rehearsed: int | None = None) -> None:
        """See :class:`~pytest_safemanip.run.session.Progress`."""
        if self._several:
            self._note(case, step, horizon, rehearsed)
            return
        now = time.monotonic()
        if step <= 1 and not rehearsed:
            self._started = now
        elif now - self._shown < PERIOD:
            return
        self._shown = now
        elapsed = now - self._started
        speed = f", {step / elapsed:.0f} steps/s" if elapsed > 1.0 else ""
        where = f"step {step} of {horizon}{speed}"
        if step == 0:
            # A model on a server may be compiled on its first call, which takes half a minute.
            where = "waiting for the first action" if horizon else "setting up"
        if rehearsed is not None:
            where = f"planning, {rehearsed} steps rehearsed"
        self._write(
            f" {self._order[case.rollout]} of {len(self._order)}: {where} "
            f"({case.task}, {case.policy}, seed {case.seed})"
        )

    def done(self, case: Case) -> None:
        """Erase the line; of several, it goes on without this one."""
        with self._changing:
            self._state.end(case.rollout)
        if not self._several:
            self._write("")

    def say(self, text: str) -> None:
        """See :class:`~pytest_safemanip.run.session.Progress`."""
        if is_seen(self._config):
            self._write(text)
        elif text and time.monotonic() - self._logged >= LOG_PERIOD:
            self._logged = time.monotonic()
            self._log(text.strip())

    def refresh(self, waiting: bool) -> None:
        """See :class:`~pytest_safemanip.run.session.Progress`."""
        now = time.monotonic()
        if not waiting:
            self._write("")
            self._shown = 0.0
        elif self._started and now - self._shown >= PERIOD:
            self._shown = now
            with self._changing:
                text = self._state.text(self._total, self._pace, now)
            self._write(text)

    def _note(self, case: Case, step: int, horizon: int, rehearsed: int | None) -> None:
        served = bool(self._plan.server(case.rollout))
        with self._changing:
            now = time.monotonic()
            self._started = self._started or now
            self._state.note(case.rollout, step, horizon, now, served, rehearsed)

    def _write(self, text: str) -> None:
        line = rewritten(self._config, text)
        if line:
            with self._uncaptured():
                print(line, end="", flush=True)  # noqa: T201

    def _log(self, text: str) -> None:
        reporter = self._config.pluginmanager.getplugin("terminalreporter")
        if reporter is not None and self._config.get_verbosity() >= 0:
            with self._uncaptured():
                reporter.write_line(text)
                reporter.flush()

    def _uncaptured(self) -> AbstractContextManager[None]:
        """While this lasts, what is written is not captured."""
        capture = self._config.pluginmanager.getplugin("capturemanager")
        return nullcontext() if capture is None else capture.global_and_fixture_disabled()


def is_seen(config: pytest.Config) -> bool:
    """Whether there is a terminal whose line can be rewritten, in colours or not."""
    reporter = config.pluginmanager.getplugin("terminalreporter")
    return reporter is not None and bool(reporter.isatty) and os.environ.get("TERM") != "dumb"


def rewritten(config: pytest.Config, text: str) -> str:
    """What puts a text right of the cursor, and the cursor back; empty where nobody sees it."""
    if not is_seen(config):
        return ""
    writer = config.get_terminal_writer()
    room = writer.fullwidth - writer.width_of_current_line - MARGIN
    return f"\x1b7\x1b[K{text[: max(room, 0)]}\x1b8"
