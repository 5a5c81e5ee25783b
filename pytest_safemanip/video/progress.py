"""How far the drawing is, for somebody who waits."""

from __future__ import annotations

import sys
import time
from types import TracebackType

WIDTH = 24
"""Characters of the bar."""
PERIOD = 0.1
"""Seconds between two changes of the line."""


class Bar:
    """A bar on the standard error while pictures are drawn, where that is a terminal; elsewhere one
    line at the end.

    Args:
        what: is done, in words.
    """

    def __init__(self, what: str) -> None:
        self._what, self._begun, self._shown = what, time.monotonic(), 0.0
        self._first: tuple[int, float] | None = None
        self._done = 0
        self._live = sys.stderr.isatty()

    def __enter__(self) -> Bar:
        self._write(f"{self._what}: setting up the scene")
        return self

    def show(self, done: int, total: int) -> None:
        """So many pictures are drawn, of so many."""
        now = time.monotonic()
        self._done = done
        self._first = self._first or (done, now)
        if now - self._shown < PERIOD and done < total:
            return
        self._shown = now
        full = WIDTH * done // total
        drawn, since = done - self._first[0], now - self._first[1]
        left = f", {(total - done) * since / drawn:.0f} s left" if drawn else ""
        self._write(f"{self._what} [{'#' * full}{'.' * (WIDTH - full)}] {done} of {total}{left}")

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._write("")
        if kind is None and not self._live:
            seconds = time.monotonic() - self._begun
            print(f"{self._what}: {self._done} pictures, {seconds:.1f} s", file=sys.stderr)

    def _write(self, text: str) -> None:
        if self._live:
            sys.stderr.write(f"\r\x1b[K{text}")
            sys.stderr.flush()
