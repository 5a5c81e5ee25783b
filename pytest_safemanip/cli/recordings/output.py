"""The folder that a command writes into."""

from __future__ import annotations

import os
from pathlib import Path

from pytest_safemanip.errors import ConfigError


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
