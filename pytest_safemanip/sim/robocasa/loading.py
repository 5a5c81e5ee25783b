"""Imports robosuite and RoboCasa quietly, headless, and with chosen assets."""

from __future__ import annotations

import atexit
import functools
import gc
import importlib
import importlib.util
import os
import sys
from pathlib import Path

from pytest_safemanip.errors import ConfigError, install_command
from pytest_safemanip.sim.robocasa.patches import compat, importing, memo, order, registry
from pytest_safemanip.sim.robocasa.patches.table import active


def package_assets() -> Path:
    """The assets folder of the installed RoboCasa, found without importing it.

    Raises:
        ConfigError: if RoboCasa or robosuite is not installed.
    """
    override = os.environ.get("ROBOCASA_ASSETS_PATH")
    folders = {}
    for name in ("robosuite", "robocasa", "mujoco"):
        spec = importlib.util.find_spec(name)
        if spec is None or not spec.submodule_search_locations:
            raise ConfigError(f"{name} is not installed; {how_to_install()}")
        folders[name] = Path(next(iter(spec.submodule_search_locations)))
    return Path(override) if override else folders["robocasa"] / "models" / "assets"


def how_to_install(python: tuple[int, ...] = sys.version_info[:2]) -> str:
    """End of an error about a missing package, for a version of Python."""
    if python >= (3, 13):
        return "use Python 3.11 or 3.12: robosuite 1.5.2 needs NumPy 1, which Python 3.13 lacks"
    checkout = "a checkout of robocasa and robosuite on the path serves too"
    return f"install it with: {install_command('robocasa')} ({checkout})"


def load(assets_root: Path) -> tuple[str, ...]:
    """Import robosuite and RoboCasa once per process.

    Args:
        assets_root: the folder that RoboCasa is to read all of its assets from.

    Returns:
        Names of the patches that are made in them.

    Raises:
        ConfigError: if they are not installed, or were already imported with other assets.
    """
    loaded = sys.modules.get("robocasa.models")
    if loaded is not None and Path(loaded.assets_root) != assets_root:
        raise ConfigError(
            f"robocasa was already imported with the assets in {loaded.assets_root}; "
            f"use a fresh process for {assets_root}"
        )
    return _imported(assets_root)


@functools.cache
def _imported(assets_root: Path) -> tuple[str, ...]:
    with (
        importing.uncollected(),
        importing.quiet(),
        importing.robosuite_settings(),
        importing.stand_ins(),
        importing.assets_root(assets_root),
    ):
        try:
            importlib.import_module("robosuite")
            supplied = compat.install()
            importlib.import_module("robocasa")
        except ModuleNotFoundError as error:
            raise ConfigError(f"{error.name} is not installed; {how_to_install()}") from error
    # To look through all that scenes are made of takes 0.1 s when the process ends.
    atexit.register(gc.freeze)
    memo.install()
    order.keep()
    registry.cache_yaml()
    return active(supplied)
