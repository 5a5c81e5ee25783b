"""Observations as RoboCasa's gym wrapper gives them, of the present state.

The wrapper's own are taken before the last physics substep has moved anything: 2 ms old.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.mujoco.drawing import Painter
from pytest_safemanip.sim.mujoco.scratch import Scratch
from pytest_safemanip.sim.robocasa import observation as names


class Observer:
    """Observes one episode.

    Args:
        env: a RoboCasa environment, after its reset.
        context: where to draw, from
            :func:`~pytest_safemanip.sim.mujoco.graphics.open_context`; must
            outlive the observer.
    """

    def __init__(self, env: Any, context: Any) -> None:
        self._env, self._copy = env, Scratch(env.sim.model._model, env.sim.data._data)
        self._model, self._scratch = self._copy.model, self._copy.data
        self._pictures = Painter(self._model, context, names.IMAGE_SIZE)

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
        return {**images, **proprioception(self._env, self._scratch)}

    def close(self) -> None:
        """Free what was uploaded for drawing."""
        self._pictures.close()


def proprioception(env: Any, data: Any) -> dict[str, NDArray[np.float32]]:
    """The robot's own state, by its names in an observation.

    robosuite's conversions are called: where a rotation by half a turn leaves a quaternion's sign
    to rounding, and the hand points down by half a turn, a model knows their choice.

    Args:
        env: a RoboCasa environment, after its reset.
        data: ``MjData`` of its model, kinematics up to date.
    """
    import robosuite.utils.transform_utils as transform

    robot, center = env.robots[0], env.robots[0].robot_model.base.correct_naming("center")
    base_site = data.site(center)
    base_turn = base_site.xmat.reshape(3, 3)
    hand = transform.convert_quat(data.body(robot.robot_model.eef_name["right"]).xquat, to="xyzw")
    base = transform.make_pose(base_site.xpos, base_turn)
    eef = transform.make_pose(data.site_xpos[robot.eef_site_id["right"]], transform.quat2mat(hand))
    relative = np.linalg.inv(base) @ eef
    values = {
        names.EEF_POSITION: relative[:3, 3],
        names.EEF_ROTATION: transform.mat2quat(relative[:3, :3]),
        names.GRIPPER: data.qpos[robot._ref_gripper_joint_pos_indexes["right"]],
        names.BASE_POSITION: base_site.xpos,
        names.BASE_ROTATION: transform.mat2quat(base_turn),
    }
    return {key: np.asarray(value, np.float32) for key, value in values.items()}
