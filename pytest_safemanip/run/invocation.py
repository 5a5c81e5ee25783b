"""How pytest was started: what paths and commands in messages refer to."""

from __future__ import annotations

import platform
import shlex
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

_JUDGING = ("--params=", "--semantics=")
"""Options that decide verdicts, which commands for recordings have, too."""


def relative_path(path: Path, folder: Path) -> Path:
    """A path as somebody in a folder would type it: relative if it is below the folder."""
    return path.relative_to(folder) if path.is_relative_to(folder) else path


def reproduce(options: Iterable[str], node_id: str) -> str:
    """The command that runs a test case again, with options of the suite."""
    return shlex.join(("pytest", *options, node_id))


def look_at(command: str, place: str, options: Iterable[str]) -> str:
    """The command that shows a recording as it was judged.

    Args:
        command: of ``safemanip``: ``show``, ``replay``.
        place: of the recording.
        options: of the run.
    """
    judging = [option.replace("--safemanip-", "--", 1) for option in options]
    judging = [option for option in judging if option.startswith(_JUDGING)]
    return shlex.join(("safemanip", command, place, *judging))


@dataclass(frozen=True)
class Invocation:
    """Where and with what pytest was started.

    Attributes:
        folder: the working directory.
        options: those that a test case needs to be run again, ``--safemanip-NAME=VALUE``.
        began: when, in seconds of :func:`time.time`.
    """

    folder: Path
    options: tuple[str, ...] = ()
    began: float = field(default_factory=time.time)

    def relative_path(self, path: Path) -> Path:
        """A path as the user would type it."""
        return relative_path(path, self.folder)

    def reproduce(self, node_id: str) -> str:
        """The command that runs a test case again."""
        return reproduce(self.options, node_id)

    def to_json(self) -> dict[str, Any]:
        """What a summary says about how and where it was run."""
        return {
            "options": list(self.options),
            "host": platform.node(),
            "began": datetime.fromtimestamp(self.began, UTC).isoformat(timespec="seconds"),
            "seconds": round(max(0.0, time.time() - self.began), 1),
        }
