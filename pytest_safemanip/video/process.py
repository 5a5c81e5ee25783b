"""Drawing in a process of its own, as seen from the one that asks."""

from __future__ import annotations

import contextlib
import json
import os
import select
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

from pytest_safemanip.errors import ConfigError, RolloutError, printable
from pytest_safemanip.video.film import Progress
from pytest_safemanip.video.storyboard import Storyboard

DEADLINE = 600.0
"""Seconds for the next sign of life: a scene whose placement fails is set up again and again."""
CLOSE_DEADLINE = 5.0
_BOOT = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from pytest_safemanip.video.worker import main; main()"
)


class CannotDraw(ConfigError):
    """Nothing can be drawn on this machine, whatever the recording."""


class Drawer:
    """Draws videos one after the other; used in a ``with`` statement, which ends the process.

    Args:
        size: of a camera's picture, pixels.
        cameras: names of those that stand side by side.
        log: what the process prints is written there.

    Attributes:
        assets: what scenes are made of; may be set before the first video.
    """

    def __init__(self, size: int, cameras: Sequence[str], log: Path) -> None:
        self.assets = "auto"
        self._size, self._cameras, self._log = size, list(cameras), log
        self._process: subprocess.Popen[bytes] | None = None
        self._buffer, self._ready = b"", False

    def __enter__(self) -> Drawer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._close()

    def draw(self, recording: Path, board: Storyboard, target: Path, progress: Progress) -> None:
        """Write one video.

        Raises:
            CannotDraw: if nothing can be drawn on this machine.
            ConfigError: if this recording can never be drawn.
            RolloutError: if this one failed.
        """
        self._start()
        job = {"recording": str(recording), "board": board.to_json(), "target": str(target)}
        self._send(job)
        while "written" not in (reply := self._receive()):
            if "failed" in reply:
                kind = ConfigError if reply.get("asked") else RolloutError
                raise kind(str(reply["failed"]))
            progress(int(reply["drawn"]), int(reply["of"]))

    def _start(self) -> None:
        """Say what to draw with, if that has not been said."""
        if self._ready:
            return
        self.launch()
        self._send({"assets": self.assets, "size": self._size, "cameras": self._cameras})
        reply = self._receive()
        if "unavailable" in reply:
            self._close()
            raise CannotDraw(str(reply["unavailable"]))
        self._ready = True

    def launch(self) -> None:
        """Start the process, if it is not there: it begins with its imports.

        Raises:
            CannotDraw: if the log cannot be written.
        """
        if self._process is not None:
            return
        self._buffer = b""
        try:
            self._log.parent.mkdir(parents=True, exist_ok=True)
            log = self._log.open("wb")
        except OSError as error:
            raise CannotDraw(f"{self._log}: cannot be written ({error.strerror})") from error
        with log:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", _BOOT, json.dumps(sys.path)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
            )

    def _send(self, message: dict[str, Any]) -> None:
        try:
            with open(self._pipe("stdin"), "wb", closefd=False) as target:
                target.write(json.dumps(message).encode() + b"\n")
        except OSError:
            raise self._died() from None

    def _receive(self) -> dict[str, Any]:
        source = self._pipe("stdout")
        while b"\n" not in self._buffer:
            ready, _, _ = select.select([source], [], [], DEADLINE)
            found = os.read(source, 1 << 16) if ready else b""
            if not found:
                raise self._died()
            self._buffer += found
        line, _, self._buffer = self._buffer.partition(b"\n")
        reply: dict[str, Any] = json.loads(line)
        return reply

    def _pipe(self, name: Literal["stdin", "stdout"]) -> int:
        """Number of a pipe to the process."""
        pipe = getattr(self._process, name)
        if pipe is None:
            raise RolloutError("the process that draws is not running")
        number: int = pipe.fileno()
        return number

    def _died(self) -> RolloutError:
        self._close()
        lines = self._log.read_text(errors="replace").strip().splitlines()
        said = f": {printable(lines[-1])}" if lines else ""
        return RolloutError(f"the process that draws died or hangs{said}")

    def _close(self) -> None:
        """End the process; its fork ends with it."""
        process, self._process, self._ready = self._process, None, False
        if process is None or process.stdin is None or process.stdout is None:
            return
        with contextlib.suppress(OSError):
            process.stdin.close()
        process.terminate()
        try:
            process.wait(CLOSE_DEADLINE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()
