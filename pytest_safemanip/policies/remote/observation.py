"""The observation of RoboCasa365's own gym wrapper, checked before it is sent to a model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pytest_safemanip.errors import RolloutError
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


def checked(observation: Observation) -> dict[str, Any]:
    """The entries that models read, with the types they are sent in.

    Raises:
        RolloutError: if one is missing, or has another shape; names it.
    """
    found: dict[str, Any] = {}
    for key in CAMERAS:
        image = np.asarray(_entry(observation, key))
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
            raise RolloutError(
                f"the observation's {key!r} is {image.dtype} of shape {image.shape}, expected "
                f"uint8 of shape ({IMAGE_SIZE}, {IMAGE_SIZE}, 3)"
            )
        found[key] = np.ascontiguousarray(image)
    for key, size in STATE.items():
        values = np.asarray(_entry(observation, key), np.float32)
        if values.shape != (size,) or not np.isfinite(values).all():
            raise RolloutError(f"the observation's {key!r} is {values}, expected {size} numbers")
        found[key] = values
    found[INSTRUCTION] = str(_entry(observation, INSTRUCTION))
    return found


def blank() -> dict[str, Any]:
    """An observation to try a server with: noise in its images, the arm before the base."""
    noise = np.random.default_rng(0).integers(0, 256, (IMAGE_SIZE, IMAGE_SIZE, 3), np.uint8)
    zeros = {key: np.zeros(size, np.float32) for key, size in STATE.items()}
    zeros[EEF_ROTATION][3] = zeros[BASE_ROTATION][3] = 1.0
    return {**dict.fromkeys(CAMERAS, noise), **zeros, INSTRUCTION: "open the drawer"}


def _entry(observation: Observation, key: str) -> Any:
    try:
        return observation[key]
    except KeyError:
        raise RolloutError(f"the observation has no {key!r}, which models read") from None
