"""Observations as RoboCasa's gym wrapper gives them, of the present state.

The wrapper's own are taken before the last physics substep has moved anything: 2 ms old.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import RolloutError
from pytest_safemanip.sim import observation as names
from pytest_safemanip.sim.robocasa.scratch import Scratch

COLLISION_GROUP, VISUAL_GROUP = 0, 1
"""robosuite's groups of geoms; a policy sees the second and not the first."""
MAX_GEOMS = 10_000
"""In a picture; robosuite's limit. Geoms beyond it are not drawn."""


class Observer:
    """Observes one episode.

    Args:
        env: a RoboCasa environment, after its reset.
        context: where to draw, from :func:`~pytest_safemanip.sim.robocasa.graphics.open_context`;
            must outlive the observer.
    """

    def __init__(self, env: Any, context: Any) -> None:
        self._env, self._copy = env, Scratch(env)
        self._model, self._scratch = self._copy.model, self._copy.data
        self._pictures = _Pictures(self._model, context)

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


class _Pictures:
    """Pictures of one model, with the settings of robosuite's renderer."""

    def __init__(self, model: Any, context: Any) -> None:
        self._model, self._context = model, context
        context.make_current()
        self._gpu = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_150)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._gpu)
        self._scene = mujoco.MjvScene(model, maxgeom=MAX_GEOMS)
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._options = mujoco.MjvOption()
        self._options.geomgroup[COLLISION_GROUP] = 0
        self._options.geomgroup[VISUAL_GROUP] = 1
        self._view = mujoco.MjrRect(0, 0, names.IMAGE_SIZE, names.IMAGE_SIZE)

    def take(self, data: Any, camera: str) -> NDArray[np.uint8]:
        """One picture, the top row first."""
        self._context.make_current()
        self._camera.fixedcamid = self._model.camera(camera).id
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(
            self._model, data, self._options, None, self._camera, everything, self._scene
        )
        if self._scene.ngeom >= MAX_GEOMS:
            raise RolloutError(f"camera {camera!r} sees over {MAX_GEOMS} geoms, too many to draw")
        mujoco.mjr_render(self._view, self._scene, self._gpu)
        image = np.empty((names.IMAGE_SIZE, names.IMAGE_SIZE, 3), np.uint8)
        mujoco.mjr_readPixels(image, None, self._view, self._gpu)
        return np.ascontiguousarray(image[::-1])

    def close(self) -> None:
        self._context.make_current()
        self._gpu.free()
