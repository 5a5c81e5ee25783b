"""Importing robosuite and RoboCasa quietly, headless, and on the assets that we choose.

Both packages print, set environment variables and want a display library while they are imported.
:func:`load` gives them what they need for the length of the import and takes it away again.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.abc
import importlib.machinery
import importlib.util
import io
import logging
import os
import sys
import types
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import ConfigError

INSTALL_HINT = (
    "install it with: pip install 'pytest-safemanip[robocasa]' "
    "(or put a checkout of robocasa and robosuite on the path)"
)
ROBOSUITE_SETTINGS: dict[str, Any] = {
    "CONSOLE_LOGGING_LEVEL": "ERROR",
    "FILE_LOGGING_LEVEL": None,
    # robosuite would write MUJOCO_GL=egl into the environment, and `import mujoco` then fails on
    # machines without EGL.
    "MUJOCO_GPU_RENDERING": False,
    # Compiling robosuite's helpers takes 14 s on a cold cache, and their bits depend on it.
    "ENABLE_NUMBA": False,
    "SIMULATION_TIMESTEP": 0.002,
}


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
            raise ConfigError(f"{name} is not installed; {INSTALL_HINT}")
        folders[name] = Path(next(iter(spec.submodule_search_locations)))
    return Path(override) if override else folders["robocasa"] / "models" / "assets"


def load(assets_root: Path) -> types.ModuleType:
    """Import robosuite and RoboCasa once per process.

    Args:
        assets_root: the folder that RoboCasa is to read all of its assets from.

    Returns:
        The module ``robosuite``.

    Raises:
        ConfigError: if they are not installed, or were already imported with other assets.
    """
    loaded = sys.modules.get("robocasa.models")
    if loaded is not None:
        if Path(loaded.assets_root) != assets_root:
            raise ConfigError(
                f"robocasa was already imported with the assets in {loaded.assets_root}; "
                f"use a fresh process for {assets_root}"
            )
        return sys.modules["robosuite"]
    with _quiet(), _robosuite_settings(), _stand_in_cv2(), _assets_root(assets_root):
        try:
            robosuite = importlib.import_module("robosuite")
            from pytest_safemanip.sim.robocasa import compat, memo, registry

            compat.install()
            importlib.import_module("robocasa")
        except ModuleNotFoundError as error:
            raise ConfigError(f"{error.name} is not installed; {INSTALL_HINT}") from error
        memo.install()
        registry.cache_yaml()
    return robosuite


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """No output, warnings or log lines of the imported packages, the environment restored."""
    before = dict(os.environ)
    logger = logging.getLogger("robosuite_logs")
    try:
        with (
            contextlib.redirect_stdout(io.StringIO()),
            contextlib.redirect_stderr(io.StringIO()),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("ignore")  # under "error" a deprecated call would end the import
            yield
    finally:
        logger.setLevel(logging.ERROR)
        for name in set(os.environ) - set(before):
            del os.environ[name]
        os.environ.update(before)


@contextlib.contextmanager
def _robosuite_settings() -> Iterator[None]:
    """The settings module that robosuite lets a user provide; the same physics for everyone."""
    name = "robosuite.macros_private"
    module = types.ModuleType(name)
    module.__dict__.update(ROBOSUITE_SETTINGS)
    sys.modules[name] = module
    try:
        yield
    finally:
        sys.modules.pop(name, None)


@contextlib.contextmanager
def _stand_in_cv2() -> Iterator[None]:
    """OpenCV needs libGL and serves the on-screen viewer only: a stand-in while importing."""
    if "cv2" in sys.modules:
        yield
        return
    sys.modules["cv2"] = types.ModuleType("cv2")
    try:
        yield
    finally:
        del sys.modules["cv2"]


@contextlib.contextmanager
def _assets_root(folder: Path) -> Iterator[None]:
    """Make ``robocasa.models.assets_root`` this folder the moment that module exists.

    Everything in RoboCasa that opens an asset reads this attribute, much of it at import.
    """
    finder = _AssetsRootFinder(folder)
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)


class _AssetsRootFinder(importlib.abc.MetaPathFinder):
    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: types.ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if name != "robocasa.models":
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path, target)
        if spec is not None and spec.loader is not None:
            spec.loader = _AssetsRootLoader(spec.loader, self._folder)
        return spec


class _AssetsRootLoader(importlib.abc.Loader):
    def __init__(self, loader: importlib.abc.Loader, folder: Path) -> None:
        self._loader, self._folder = loader, folder

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> types.ModuleType | None:
        return self._loader.create_module(spec)

    def exec_module(self, module: types.ModuleType) -> None:
        self._loader.exec_module(module)
        module.__dict__["assets_root"] = str(self._folder)
