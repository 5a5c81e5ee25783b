"""Changes of what cameras see alone: where they are, and how bright it is."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import mujoco
import numpy as np

from pytest_safemanip.sim.staging import Cameras, Change, Light
from pytest_safemanip.trace.geometry import about, multiply


def change(model: Any, cameras: Sequence[str], changes: Iterable[Change]) -> None:
    """Make those of some changes that no physics depends on.

    Args:
        model: a ``mujoco.MjModel``.
        cameras: those that are not on a hand; they hang on bodies whose axes are the base's.
        changes: all that are to be made; others are left to others.
    """
    for own in changes:
        if isinstance(own, Cameras):
            for name in cameras:
                _move(model, int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, name)), own)
        elif isinstance(own, Light):
            _brighten(model, own.factor)


def _move(model: Any, camera: int, own: Cameras) -> None:
    model.cam_pos[camera] += own.by
    turn = about((0.0, 0.0, 1.0), np.radians(own.turn))
    model.cam_quat[camera] = multiply(turn, np.array(model.cam_quat[camera]))


def _brighten(model: Any, factor: float) -> None:
    head = model.vis.headlight
    for part in (head.ambient, head.diffuse, model.light_ambient, model.light_diffuse):
        part[:] = np.clip(np.asarray(part) * factor, 0.0, 1.0)
