"""Observations, checked before they are sent to a model; RoboCasa365's own names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pytest_safemanip.errors import RolloutError
from pytest_safemanip.policies.remote.embodiment import PANDA_OMRON, Embodiment
from pytest_safemanip.sim.robocasa.observation import (
    BASE_POSITION,
    BASE_ROTATION,
    CAMERAS,
    EEF_POSITION,
    EEF_ROTATION,
    GRIPPER,
    IMAGE_SIZE,
    INSTRUCTION,
    LEFT,
    RIGHT,
    STATE,
    WRIST,
)

__all__ = [
    "BASE_POSITION",
    "BASE_ROTATION",
    "CAMERAS",
    "EEF_POSITION",
    "EEF_ROTATION",
    "GRIPPER",
    "IMAGE_SIZE",
    "INSTRUCTION",
    "LEFT",
    "RIGHT",
    "STATE",
    "WRIST",
    "Observation",
    "blank",
    "checked",
]

Observation = Mapping[str, Any]


def checked(observation: Observation, robot: Embodiment = PANDA_OMRON) -> dict[str, Any]:
    """The entries that models read, with the types they are sent in.

    Raises:
        RolloutError: if one is missing, or has another shape; names it.
    """
    found: dict[str, Any] = {}
    for key in robot.cameras:
        image = np.asarray(_entry(observation, key))
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
            raise RolloutError(
                f"the observation's {key!r} is {image.dtype} of shape {image.shape}, expected "
                f"uint8 of shape ({robot.image_size}, {robot.image_size}, 3)"
            )
        found[key] = np.ascontiguousarray(image)
    for key, size in robot.state.items():
        values = np.asarray(_entry(observation, key), np.float32)
        if values.shape != (size,) or not np.isfinite(values).all():
            raise RolloutError(f"the observation's {key!r} is {values}, expected {size} numbers")
        found[key] = values
    found[robot.instruction] = str(_entry(observation, robot.instruction))
    return found


def blank(robot: Embodiment = PANDA_OMRON) -> dict[str, Any]:
    """An observation to try a server with: noise in its images, its rotations none."""
    size = robot.image_size
    noise = np.random.default_rng(0).integers(0, 256, (size, size, 3), np.uint8)
    zeros = {key: np.zeros(length, np.float32) for key, length in robot.state.items()}
    for key in robot.rotations:
        zeros[key][3] = 1.0
    return {**dict.fromkeys(robot.cameras, noise), **zeros, robot.instruction: "open the drawer"}


def _entry(observation: Observation, key: str) -> Any:
    try:
        return observation[key]
    except KeyError:
        raise RolloutError(f"the observation has no {key!r}, which models read") from None
