"""A live line about the rollout that is running, where somebody can see it."""

from __future__ import annotations

import time

import pytest

from pytest_safemanip.cases import Case
from pytest_safemanip.plan import Plan

PERIOD = 0.25
"""Seconds between two updates."""
MARGIN = 10
"""Columns that pytest keeps for its own percentage."""


class ProgressLine:
    """Text right of the cursor that is rewritten in place and leaves nothing behind.

    Nothing is written where the output is no terminal.
    """

    def __init__(self, config: pytest.Config, plan: Plan) -> None:
        self._config = config
        self._order = {r: n for n, r in enumerate(dict.fromkeys(c.rollout for c in plan.cases), 1)}
        self._shown = self._started = 0.0

    def show(self, case: Case, step: int, horizon: int) -> None:
        """See :class:`~pytest_safemanip.session.Progress`."""
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

    def done(self) -> None:
        """Erase the line."""
        self._write("")

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
