"""How pytest was started: what paths and commands in messages refer to."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path


def relative_path(path: Path, folder: Path) -> Path:
    """A path as somebody in a folder would type it: relative if it is below the folder."""
    return path.relative_to(folder) if path.is_relative_to(folder) else path


@dataclass(frozen=True)
class Invocation:
    """Where and with what pytest was started.

    Attributes:
        folder: the working directory.
        command: the beginning of the command that runs one test case again.
    """

    folder: Path
    command: str

    def relative_path(self, path: Path) -> Path:
        """A path as the user would type it."""
        return relative_path(path, self.folder)

    def reproduce(self, node_id: str) -> str:
        """The command that runs a test case again."""
        return f"{self.command} {shlex.quote(node_id)}"
