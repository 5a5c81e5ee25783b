"""Observations as RoboCasa's gym wrapper gives them, of the present state.

The wrapper's own are taken before the last physics substep has moved anything: 2 ms old.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.mujoco.scratch import Scratch
from pytest_safemanip.sim.robocasa import observation as names
from pytest_safemanip.sim.robocasa.rendering.drawing import Painter


class Observer:
    """Observes one episode.

    Args:
        env: a RoboCasa environment, after its reset.
        context: where to draw, from
            :func:`~pytest_safemanip.sim.robocasa.rendering.graphics.open_context`; must
            outlive the observer.
    """

    def __init__(self, env: Any, context: Any) -> None:
        self._env, self._copy = env, Scratch(env.sim.model._model, env.sim.data._data)
        self._model, self._scratch = self._copy.model, self._copy.data
        self._pictures = Painter(self._model, context)

    def observe(self) -> dict[str, NDArray[Any]]:
        """Images and state; see :meth:`pytest_safemanip.sim.backend.Backend.observe`.

        Raises:
            RolloutError: if the scene has more geoms than are drawn.
        """
        self._copy.take()
        mujoco.mj_forward(self._model, self._scratch)
        images = {
            key: self._pictures.take(self._scratch, key.removeprefix("video."))
            for key in names.CAMERAS
        }
        return {**images, **self._proprioception()}

    def close(self) -> None:
        """Free what was uploaded for drawing."""
        self._pictures.close()

    def _proprioception(self) -> dict[str, NDArray[np.float32]]:
        """The robot's own state.

        robosuite's conversions are called: where a rotation by half a turn leaves a quaternion's
        sign to rounding, and the hand points down by half a turn, a model knows their choice.
        """
        import robosuite.utils.transform_utils as transform

        d, robot = self._scratch, self._env.robots[0]
        base_site = self._model.site(robot.robot_model.base.correct_naming("center")).id
        base_turn = d.site_xmat[base_site].reshape(3, 3)
        hand = transform.convert_quat(d.body(robot.robot_model.eef_name["right"]).xquat, to="xyzw")
        base = transform.make_pose(d.site_xpos[base_site], base_turn)
        eef = transform.make_pose(d.site_xpos[robot.eef_site_id["right"]], transform.quat2mat(hand))
        relative = np.linalg.inv(base) @ eef
        values = {
            names.EEF_POSITION: relative[:3, 3],
            names.EEF_ROTATION: transform.mat2quat(relative[:3, :3]),
            names.GRIPPER: d.qpos[robot._ref_gripper_joint_pos_indexes["right"]],
            names.BASE_POSITION: d.site_xpos[base_site],
            names.BASE_ROTATION: transform.mat2quat(base_turn),
        }
        return {key: np.asarray(value, np.float32) for key, value in values.items()}
