"""A live line about the rollouts that are running, where somebody can see it."""

from __future__ import annotations

import threading
import time

import pytest

from pytest_safemanip.metrics.records import RolloutKey
from pytest_safemanip.run.cases import Case
from pytest_safemanip.run.plan import Plan

PERIOD = 0.25
"""Seconds between two updates."""
MARGIN = 10
"""Columns that pytest keeps for its own percentage."""


class ProgressLine:
    """Text right of the cursor that is rewritten in place and leaves nothing behind.

    Nothing is written where the output is no terminal. Of rollouts in other threads it is told by
    them, and written by the one that waits: pytest's capturing is not for several.
    """

    def __init__(self, config: pytest.Config, plan: Plan) -> None:
        self._config = config
        self._order = {r: n for n, r in enumerate(dict.fromkeys(c.rollout for c in plan.cases), 1)}
        self._shown = self._started = 0.0
        self._total, self._several = len(self._order), False
        self._changing = threading.Lock()
        self._running: dict[RolloutKey, tuple[int, int]] = {}
        self._done = self._steps = self._run = 0

    def expect(self, rollouts: int, jobs: int) -> None:
        """See :class:`~pytest_safemanip.run.session.Progress`."""
        self._total, self._several = rollouts, jobs > 1

    def show(self, case: Case, step: int, horizon: int) -> None:
        """See :class:`~pytest_safemanip.run.session.Progress`."""
        if self._several:
            self._note(case, step, horizon)
            return
        now = time.monotonic()
        if step <= 1:
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
        self._write(
            f" rollout {self._order[case.rollout]} of {len(self._order)}: {case.task}, "
            f"{case.policy}, seed {case.seed}: {where}"
        )

    def done(self, case: Case) -> None:
        """Erase the line; of several, it goes on without this one."""
        with self._changing:
            self._done += 1
            self._run += self._running.pop(case.rollout, None) is not None
        if not self._several:
            self._write("")

    def refresh(self, waiting: bool) -> None:
        """See :class:`~pytest_safemanip.run.session.Progress`."""
        now = time.monotonic()
        if not waiting:
            self._write("")
            self._shown = 0.0
        elif self._started and now - self._shown >= PERIOD:
            self._shown = now
            with self._changing:
                text = self._state(now - self._started)
            self._write(text)

    def _note(self, case: Case, step: int, horizon: int) -> None:
        with self._changing:
            self._started = self._started or time.monotonic()
            self._running[case.rollout] = step, horizon
            self._steps += step > 0

    def _state(self, elapsed: float) -> str:
        """Of several: how many are done and running, how fast, and how long it will take if the
        others are like these; those that end at success before their horizon make it shorter.
        """
        begun = sum(step / horizon for step, horizon in self._running.values() if horizon)
        left = self._total - self._done - begun
        text = f" {self._done} of {self._total} rollouts, {len(self._running)} running"
        if elapsed > 1.0 and self._steps:
            text += f", {self._steps / elapsed:.0f} steps/s"
            text += f", {_span(left * elapsed / (self._run + begun))} left"
        return text

    def _write(self, text: str) -> None:
        reporter = self._config.pluginmanager.getplugin("terminalreporter")
        writer = self._config.get_terminal_writer()
        if reporter is None or not (reporter.isatty and writer.hasmarkup):
            return
        room = writer.fullwidth - writer.width_of_current_line - MARGIN
        capture = self._config.pluginmanager.getplugin("capturemanager")
        line = f"\x1b7\x1b[K{text[: max(room, 0)]}\x1b8"
        if capture is None:
            print(line, end="", flush=True)  # noqa: T201
            return
        with capture.global_and_fixture_disabled():
            print(line, end="", flush=True)  # noqa: T201


def _span(seconds: float) -> str:
    """A time that is left, in the unit that one thinks in."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400.0 else f"{seconds / 3600:.1f} h"
