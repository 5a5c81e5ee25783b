"""The off-screen GL context, opened at the first picture.

MuJoCo's Python package chooses its GL library while it is imported, by ``MUJOCO_GL``, and cannot be
imported where that library is missing. Most rollouts draw nothing, so it is imported without one,
and the library is looked for here.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

from pytest_safemanip.errors import ConfigError

PLATFORMS = ("egl", "osmesa")
"""EGL first: with a driver it draws on a GPU; Mesa's newer versions have no OSMesa."""

PACKAGES = {"egl": "libegl1 libgl1-mesa-dri", "osmesa": "libosmesa6"}
"""Debian's and Ubuntu's packages, for drawing without a GPU."""

PROBE_DEADLINE = 60.0

_OWN_BUFFER = 256
"""Pixels; pictures are drawn into buffers of their own."""

_PROBE = (
    "import importlib, os, sys; sys.path[:] = sys.argv[2:]; import mujoco; "
    "context = importlib.import_module('mujoco.' + sys.argv[1]).GLContext(8, 8); "
    "context.make_current(); empty = mujoco.MjModel.from_xml_string('<mujoco/>'); "
    "mujoco.MjrContext(empty, mujoco.mjtFontScale.mjFONTSCALE_50); os._exit(0)"
)


@contextlib.contextmanager
def never_drawn() -> Iterator[None]:
    """Let MuJoCo be imported without a GL library: where ``MUJOCO_GL`` names one that is not there
    it cannot be imported, and without that name it starts a process to look for one of windows.
    """
    wanted = os.environ.get("MUJOCO_GL")
    os.environ["MUJOCO_GL"] = "disabled"
    try:
        yield
    finally:
        if wanted is None:
            del os.environ["MUJOCO_GL"]
        else:
            os.environ["MUJOCO_GL"] = wanted


def open_context(wanted: str) -> Any:
    """Make a GL context, current in this thread.

    Args:
        wanted: see :func:`find_platform`.

    Returns:
        The context, with ``make_current()`` and ``free()``.

    Raises:
        ConfigError: if none can be had; names the packages to install.
    """
    return open_platform(find_platform(wanted))


def open_platform(platform: str) -> Any:
    """Make a GL context on a platform that works; see :func:`open_context`."""
    os.environ["PYOPENGL_PLATFORM"] = platform
    module = importlib.import_module(f"mujoco.{platform}")
    context = module.GLContext(_OWN_BUFFER, _OWN_BUFFER)
    context.make_current()
    return context


def find_platform(wanted: str) -> str:
    """The platform that works here.

    Args:
        wanted: ``egl`` or ``osmesa`` for that one alone; anything else for the first that works.

    Raises:
        ConfigError: if none does; names the packages to install.
    """
    platforms = (wanted,) if wanted in PLATFORMS else PLATFORMS
    failures = []
    for platform in platforms:
        failure = _failure(platform)
        if failure is None:
            return platform
        failures.append(f"{platform}: {failure}")
    packages = " or ".join(f"`apt-get install {PACKAGES[platform]}`" for platform in platforms)
    asked = f" (MUJOCO_GL={wanted})" if wanted in PLATFORMS else ""
    raise ConfigError(
        f"the scene cannot be rendered: no GL library works{asked}; on Debian and Ubuntu, install "
        f"one with {packages}; policies that need no images run without [{'; '.join(failures)}]"
    )


def _failure(platform: str) -> str | None:
    """The reason why MuJoCo cannot draw with a library, found by a subprocess; None if it can.

    A library that was loaded in vain stays loaded, and MuJoCo would take the next one's functions
    from it.
    """
    command = [sys.executable, "-P", "-c", _PROBE, platform, *sys.path]
    # Each platform sets this to its own, and refuses another's.
    environment = {k: v for k, v in os.environ.items() if k != "PYOPENGL_PLATFORM"}
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            timeout=PROBE_DEADLINE,
            check=False,
            env=environment,
        )
    except subprocess.TimeoutExpired:
        return f"no answer within {PROBE_DEADLINE:g} s"
    if done.returncode == 0:
        return None
    raised = re.search(r"^[\w.]*Error.*", done.stderr, re.MULTILINE)
    return raised.group() if raised else f"exit code {done.returncode}"
