"""Pictures and films of a rollout that lie beside its recording."""

from __future__ import annotations

import os
from pathlib import Path

PICTURES = (".png", ".jpg", ".gif", ".svg")
FILMS = (".mp4", ".webm", ".gif")
FOLDERS = (".", "../pictures", "../videos")
"""Where they are, seen from the recording."""


def picture_of(recording: Path, seen_from: Path | None = None) -> Path | None:
    """A picture of the rollout, a key frame if there is one; None without any.

    Args:
        recording: its file.
        seen_from: the folder that the answer is relative to; None for the working folder.
    """
    return _beside(recording, PICTURES, seen_from)


def film_of(recording: Path, seen_from: Path | None = None) -> Path | None:
    """A film of the rollout; likewise."""
    return _beside(recording, FILMS, seen_from)


def is_of(picture: Path, recording: Path) -> bool:
    """Whether a picture or a film is there and no older than the recording: what is older shows
    another rollout of the same case.
    """
    if not picture.is_file():
        return False
    return not recording.is_file() or picture.stat().st_mtime >= recording.stat().st_mtime


def _beside(recording: Path, endings: tuple[str, ...], seen_from: Path | None) -> Path | None:
    if not recording.name:
        return None
    for folder in FOLDERS:
        for ending in endings:
            found = recording.parent / folder / f"{recording.stem}{ending}"
            if is_of(found, recording):
                return Path(os.path.relpath(found, seen_from or Path.cwd()))
    return None
