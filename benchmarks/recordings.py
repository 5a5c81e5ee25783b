"""Recordings that a benchmark is given: in a line, what is wrong with a folder or a file."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from pytest_safemanip.errors import TraceError
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording


def below(places: Sequence[Path]) -> list[Path]:
    """The recordings anywhere below some folders, sorted by folder.

    Raises:
        SystemExit: if one has none.
    """
    found = []
    for place in places:
        paths = sorted(place.rglob(f"*{files.SUFFIX}"))
        if not paths:
            sys.exit(f"{place}: {'no recordings there' if place.exists() else 'does not exist'}")
        found += paths
    return found


def load(path: Path) -> Recording:
    """A recording.

    Raises:
        SystemExit: if it cannot be read.
    """
    try:
        return files.load(path)
    except TraceError as error:
        sys.exit(str(error))
