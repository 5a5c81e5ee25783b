"""Drawing a scene off screen, with the settings of robosuite's renderer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import RolloutError

COLLISION_GROUP, VISUAL_GROUP = 0, 1
"""robosuite's groups of geoms; a policy sees the second and not the first."""
MAX_GEOMS = 10_000
"""Largest number of geoms in a picture, robosuite's limit; more are not drawn."""


@dataclass(frozen=True)
class FreeCamera:
    """Pose of a camera that is not part of the scene.

    Attributes:
        at: the point that it looks at, world frame (3,), m.
        distance: from there, m.
        azimuth: of its line of sight about the vertical, degrees from x to y.
        elevation: of its line of sight above the horizontal, degrees.
    """

    at: tuple[float, float, float]
    distance: float
    azimuth: float
    elevation: float


class Painter:
    """Draws one model.

    Args:
        model: a ``mujoco.MjModel``.
        context: where to draw, from
            :func:`~pytest_safemanip.sim.mujoco.graphics.open_context`; must
            outlive the painter.
        size: width and height of a picture, pixels.
        group: the geoms that are drawn, ``VISUAL_GROUP`` or ``COLLISION_GROUP``.
    """

    def __init__(self, model: Any, context: Any, size: int, group: int = VISUAL_GROUP) -> None:
        self._model, self._context, self._size = model, context, size
        buffer = model.vis.global_
        buffer.offwidth, buffer.offheight = max(buffer.offwidth, size), max(buffer.offheight, size)
        context.make_current()
        self._gpu = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_150)
        self._scene = mujoco.MjvScene(model, maxgeom=MAX_GEOMS)
        self._options = mujoco.MjvOption()
        self._options.geomgroup[COLLISION_GROUP] = group == COLLISION_GROUP
        self._options.geomgroup[VISUAL_GROUP] = group == VISUAL_GROUP

    def take(self, data: Any, camera: str | FreeCamera) -> NDArray[np.uint8]:
        """One picture (size, size, 3), RGB, the top row first.

        Args:
            data: a ``mujoco.MjData``, its kinematics up to date.
            camera: one of the model's, or a view.

        Raises:
            RolloutError: if the scene has more geoms than are drawn.
        """
        self._context.make_current()
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(
            self._model, data, self._options, None, self._pose(camera), everything, self._scene
        )
        if self._scene.ngeom >= MAX_GEOMS:
            raise RolloutError(f"camera {camera!r} sees over {MAX_GEOMS} geoms, too many to draw")
        view = mujoco.MjrRect(0, 0, self._size, self._size)
        # Each time: another painter may have drawn into a buffer of its own since.
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._gpu)
        mujoco.mjr_render(view, self._scene, self._gpu)
        image = np.empty((self._size, self._size, 3), np.uint8)
        mujoco.mjr_readPixels(image, None, view, self._gpu)
        return np.ascontiguousarray(image[::-1])

    def close(self) -> None:
        """Free what was uploaded for drawing."""
        self._context.make_current()
        self._gpu.free()

    def _pose(self, camera: str | FreeCamera) -> Any:
        pose = mujoco.MjvCamera()
        if isinstance(camera, FreeCamera):
            pose.type = mujoco.mjtCamera.mjCAMERA_FREE
            pose.lookat[:] = camera.at
            pose.distance = camera.distance
            pose.azimuth, pose.elevation = camera.azimuth, camera.elevation
        else:
            pose.type = mujoco.mjtCamera.mjCAMERA_FIXED
            pose.fixedcamid = self._model.camera(camera).id
        return pose
