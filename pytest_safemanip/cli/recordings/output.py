"""The paths that a command is given, and the folder that it writes into."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from pytest_safemanip.errors import ConfigError


def given_path(text: str) -> Path:
    """A path on the command line.

    Raises:
        argparse.ArgumentTypeError: if it is empty, as a variable that is not set: it would stand
            for the working folder.
    """
    if not text:
        raise argparse.ArgumentTypeError("expected a path, found an empty text")
    return Path(text)


def check_folder(folder: Path) -> None:
    """Refuse a folder that cannot be written into, before anything is simulated for it.

    Args:
        folder: need not be there yet.

    Raises:
        ConfigError: if it, or the nearest one above it that is there, is none or is read-only.
    """
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not there.is_dir():
        raise ConfigError(f"{folder} cannot be made: {there} is not a folder")
    if not os.access(there, os.W_OK | os.X_OK):
        raise ConfigError(f"{folder} cannot be written: {there} is read-only")
