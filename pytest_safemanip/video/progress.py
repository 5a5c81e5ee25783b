"""How far the drawing is, for somebody who waits."""

from __future__ import annotations

import shutil
import sys
import time
from types import TracebackType

WIDTH = 24
"""Characters of the bar."""
PERIOD = 0.1
"""Seconds between two changes of the line."""


class Bar:
    """A line on the standard error while pictures are drawn, where that is a terminal; used in a
    ``with`` statement, which erases it.
    """

    def __init__(self) -> None:
        self._what, self._begun, self._shown = "", (0, 0.0), 0.0
        self._live = sys.stderr.isatty()

    def __enter__(self) -> Bar:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.say("")

    def say(self, text: str) -> None:
        """Write something else for a while."""
        if self._live:
            sys.stderr.write(f"\r\x1b[K{text[: shutil.get_terminal_size().columns - 1]}")
            sys.stderr.flush()

    def show(self, what: str, done: int, total: int) -> None:
        """So much of something is drawn, of so much."""
        now = time.monotonic()
        if what != self._what:
            self._what, self._begun, self._shown = what, (done, now), 0.0
        if now - self._shown < PERIOD and done < total:
            return
        self._shown = now
        full = WIDTH * done // total
        drawn, since = done - self._begun[0], now - self._begun[1]
        left = f", {(total - done) * since / drawn:.0f} s left" if drawn else ""
        self.say(f"[{'#' * full}{'.' * (WIDTH - full)}] {done} of {total}{left}: {what}")
