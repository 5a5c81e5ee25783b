"""Temporary patches while robosuite and RoboCasa are imported.

Both print, set environment variables and want a display library.
"""

from __future__ import annotations

import contextlib
import gc
import importlib.abc
import importlib.machinery
import io
import logging
import os
import sys
import types
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

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


@contextlib.contextmanager
def quiet() -> Iterator[None]:
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
def uncollected() -> Iterator[None]:
    """Let the garbage collector pass over all that is imported, now and later: it stays until the
    process ends, and each time to look through it takes as long as five control steps.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if enabled:
            gc.enable()


@contextlib.contextmanager
def robosuite_settings() -> Iterator[None]:
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
def stand_ins() -> Iterator[None]:
    """Stand-ins for what is imported and never called: OpenCV, which needs libGL and serves the
    on-screen viewer, MuJoCo's own viewer, which starts a process to look for a library of windows,
    and Numba, which is switched off and takes a tenth of a second.
    """
    absent = [name for name in ("cv2", "numba", "mujoco.viewer") if name not in sys.modules]
    sys.modules.update({name: types.ModuleType(name) for name in absent})
    try:
        yield
    finally:
        for name in absent:
            del sys.modules[name]


@contextlib.contextmanager
def assets_root(folder: Path) -> Iterator[None]:
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
