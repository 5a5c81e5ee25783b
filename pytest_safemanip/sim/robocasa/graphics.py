"""A place to draw off screen, opened when the first picture is wanted.

MuJoCo's Python package chooses its GL library while it is imported, by ``MUJOCO_GL``, and cannot be
imported where that library is missing. Most rollouts draw nothing, so it is imported without one,
and the library is looked for here.
"""

from __future__ import annotations

import importlib
import os
import sys
from typing import Any

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.observation import IMAGE_SIZE

PLATFORMS = ("egl", "osmesa")
"""EGL first: with a driver it draws on a GPU; Mesa's newer versions have no OSMesa."""

PACKAGES = {"egl": "libegl1 libgl1-mesa-dri", "osmesa": "libosmesa6"}
"""Debian's and Ubuntu's packages, for drawing without a GPU."""


def open_context(wanted: str) -> Any:
    """Make a GL context, current in this thread.

    Args:
        wanted: ``egl`` or ``osmesa`` for that one alone; anything else for the first that works.

    Returns:
        The context, with ``make_current()`` and ``free()``.

    Raises:
        ConfigError: if none can be had; names the packages to install.
    """
    platforms = (wanted,) if wanted in PLATFORMS else PLATFORMS
    failures = []
    for platform in platforms:
        try:
            return _open(platform)
        except Exception as error:  # a missing library is an AttributeError, a driver a GLError
            failures.append(f"{platform}: {type(error).__name__}: {error}")
            _forget()
    packages = " or ".join(f"`apt-get install {PACKAGES[platform]}`" for platform in platforms)
    asked = f" (MUJOCO_GL={wanted})" if wanted in PLATFORMS else ""
    raise ConfigError(
        f"the scene cannot be rendered: no GL library works{asked}; install one with {packages}; "
        f"policies that need no images run without; {'; '.join(failures)}"
    )


def _open(platform: str) -> Any:
    os.environ["PYOPENGL_PLATFORM"] = platform
    context = importlib.import_module(f"mujoco.{platform}").GLContext(IMAGE_SIZE, IMAGE_SIZE)
    context.make_current()
    return context


def _forget() -> None:
    """PyOpenGL binds one platform for as long as it is imported."""
    os.environ.pop("PYOPENGL_PLATFORM", None)
    roots = ("OpenGL", *(f"mujoco.{platform}" for platform in PLATFORMS))
    for name in list(sys.modules):
        if name.startswith(tuple(f"{root}." for root in roots)) or name in roots:
            del sys.modules[name]
