"""Folders of the shipped properties, tasks and spaces: in the wheel, or in a checkout."""

from __future__ import annotations

from pathlib import Path

from pytest_safemanip.errors import ConfigError

_PACKAGE = Path(__file__).resolve().parent


def folder(name: str) -> Path:
    """The folder of shipped ``properties``, ``tasks`` or ``searches``.

    Raises:
        ConfigError: if the installation lacks it.
    """
    for place in (_PACKAGE / "data" / name, _PACKAGE.parent / name):
        if place.is_dir():
            return place
    raise ConfigError(f"the shipped {name} are missing from {_PACKAGE}; install the package again")
