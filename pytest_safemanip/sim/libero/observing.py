"""What policies see of a LIBERO environment."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.libero.robot import (
    CAMERAS,
    EEF_POSITION,
    EEF_ROTATION,
    FINGERS,
    IMAGE_SIZE,
)
from pytest_safemanip.sim.mujoco.drawing import Painter
from pytest_safemanip.sim.mujoco.scratch import Scratch


class Observer:
    """Observes one episode; only reads.

    Args:
        env: its environment.
        context: where to draw, from
            :func:`~pytest_safemanip.sim.mujoco.graphics.open_context`.
    """

    def __init__(self, env: Any, context: Any) -> None:
        model, robot = env.sim.model._model, env.robots[0]
        self._scratch = Scratch(model, env.sim.data._data)
        self._painter = Painter(model, context, IMAGE_SIZE)
        self._site = int(robot.eef_site_id)
        self._body = int(model.body(robot.robot_model.eef_name).id)
        self._fingers = list(robot._ref_gripper_joint_pos_indexes)

    def observe(self) -> dict[str, NDArray[Any]]:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        self._scratch.take()
        data = self._scratch.data
        mujoco.mj_forward(self._scratch.model, data)
        images = {name: self._painter.take(data, name.partition(".")[2]) for name in CAMERAS}
        state = {
            EEF_POSITION: data.site_xpos[self._site],
            EEF_ROTATION: np.roll(data.xquat[self._body], -1),  # wxyz to xyzw
            FINGERS: data.qpos[self._fingers],
        }
        return {**images, **{name: np.array(v, np.float32) for name, v in state.items()}}

    def close(self) -> None:
        """Free what was uploaded for drawing."""
        self._painter.close()
