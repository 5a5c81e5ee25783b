"""Pillow, which is not there for everybody, and the places where scenes are drawn."""

from __future__ import annotations

import importlib
import os
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, install_command

CAMERAS = ("room", "close", "left", "right", "wrist", "solid")
"""The room over the robot's shoulder, the task's things from near by without the robot, the three
that policies see, and the near things again as what collides."""

Image = NDArray[np.uint8]


def pillow() -> Any:
    """The library that pictures are written with.

    Raises:
        ConfigError: if it is not installed.
    """
    try:
        for module in ("PIL.Image", "PIL.ImageDraw", "PIL.ImageFont"):
            importlib.import_module(module)
        return importlib.import_module("PIL")
    except ImportError as error:
        raise ConfigError(
            f"pictures are written with Pillow: {install_command('robocasa,video')} ({error})"
        ) from error


def check_size(size: int) -> None:
    """Check the edge of a camera's picture, pixels.

    Raises:
        ConfigError: if nobody can want it.
    """
    if not 16 <= size <= 2048:
        raise ConfigError(f"--size: expected 16 to 2048 pixels, found {size}")


def open_studio(
    assets: Literal["auto", "official", "primitive"], size: int, draft: bool = False
) -> Any:
    """Where scenes are drawn.

    Args:
        assets: what the scenes are made of.
        size: of a picture, pixels.
        draft: whether many pictures are wanted soon, rather than good ones.

    Raises:
        ConfigError: if RoboCasa is not installed, or nothing can be drawn on this machine.
    """
    check_size(size)
    # With a GL library named that is not there, MuJoCo cannot be imported; see graphics.py.
    wanted = os.environ.pop("MUJOCO_GL", "")
    from pytest_safemanip.sim.robocasa.rendering.studio import Studio

    return Studio(assets, size, wanted, draft)
