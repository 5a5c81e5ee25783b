"""Scenes of RoboCasa, set up to be drawn for people; nothing here is part of a rollout."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.mujoco import graphics
from pytest_safemanip.sim.mujoco.drawing import (
    COLLISION_GROUP,
    VISUAL_GROUP,
    FreeCamera,
    Painter,
)
from pytest_safemanip.sim.robocasa import environment, loading, observation
from pytest_safemanip.sim.robocasa.assets import Mode, prepare_assets
from pytest_safemanip.sim.robocasa.description import open_reader
from pytest_safemanip.sim.robocasa.parts import is_robot
from pytest_safemanip.sim.robocasa.rendering.thinning import simplify
from pytest_safemanip.trace.scene import Scene

ROBOT_CAMERAS = {
    "left": observation.LEFT,
    "right": observation.RIGHT,
    "wrist": observation.WRIST,
}
STILL = 2e-4
"""What has moved less than this, m, or turned less, rad, is not drawn again: a tenth of a pixel."""
UNDRAWN = 5
"""A group of geoms that no painter draws."""
REACH = 1.5
"""Things farther than this from the robot's base are left out of the near view, m: RoboCasa parks
what it has removed from a scene far away."""


class Shot:
    """The scene of an episode, ready to be drawn.

    Args:
        env: a RoboCasa environment, after its reset.
        context: gives where to draw; first called when a picture is taken.
        size: of a picture, pixels.
        draft: whether many pictures are wanted soon: without antialiasing, of simpler meshes.

    Attributes:
        instruction: what the robot is told.
        size: of a picture, pixels.
    """

    def __init__(
        self, env: Any, context: Callable[[], Any], size: int, draft: bool = False
    ) -> None:
        self._reader = open_reader(env)
        self._model = env.sim.model._model
        self._data = mujoco.MjData(self._model)
        self.instruction = environment.instruction(env)
        self._context, self.size = context, size
        self._painters: dict[int, Painter] = {}
        self.pose(env.sim.data._data.qpos)
        roots = self._model.body_rootid[self._model.geom_bodyid]
        self._robot = [g for g, root in enumerate(roots) if is_robot(self._model.body(root).name)]
        self._room, self._close = self._choose_views(env)
        self._known: dict[str, tuple[NDArray[np.float64], NDArray[np.uint8]]] | None = None
        if draft:
            simplify(self._model)
            self._known = {}

    def pose(self, qpos: NDArray[Any]) -> None:
        """Set the joint positions (nq,)."""
        self._data.qpos[:] = qpos
        mujoco.mj_forward(self._model, self._data)

    def check(self, scene: Scene) -> None:
        """Check that this is the scene of a recording.

        Raises:
            ConfigError: if it is another one.
        """
        check_scene(self._reader.description.scene, scene)

    def take(self, camera: str) -> NDArray[np.uint8]:
        """A picture (size, size, 3): ``room``, ``close``, ``solid``, ``left``, ``right``,
        ``wrist``. In a draft, the last one again where nothing has moved.
        """
        if self._known is None:
            return self._draw(camera)
        places = self._places(camera)
        known = self._known.get(camera)
        if known is None or np.abs(places - known[0]).max() > STILL:
            known = self._known[camera] = places, self._draw(camera)
        return known[1]

    def _places(self, camera: str) -> NDArray[np.float64]:
        """Where everything is that decides a picture, and how it is turned."""
        data = self._data
        geoms = np.concatenate([data.geom_xpos, data.geom_xmat], axis=1)
        if camera in ROBOT_CAMERAS:
            eye = data.camera(ROBOT_CAMERAS[camera].removeprefix("video."))
            return np.concatenate([geoms.ravel(), eye.xpos, eye.xmat])
        return geoms.ravel() if camera == "room" else np.delete(geoms, self._robot, axis=0).ravel()

    def _draw(self, camera: str) -> NDArray[np.uint8]:
        group = COLLISION_GROUP if camera == "solid" else VISUAL_GROUP
        if group not in self._painters:
            self._painters[group] = Painter(self._model, self._context(), self.size, group)
        painter = self._painters[group]
        if camera in ROBOT_CAMERAS:
            return painter.take(self._data, ROBOT_CAMERAS[camera].removeprefix("video."))
        if camera == "room":
            return painter.take(self._data, self._room)
        groups = self._model.geom_group.copy()
        self._model.geom_group[self._robot] = UNDRAWN
        try:
            return painter.take(self._data, self._close)
        finally:
            self._model.geom_group[:] = groups

    def close(self) -> None:
        """Free what was uploaded for drawing."""
        for painter in self._painters.values():
            painter.close()

    def _choose_views(self, env: Any) -> tuple[FreeCamera, FreeCamera]:
        """Over the robot's shoulder, and near the task's things (without the robot)."""
        base = self._data.body("mobilebase0_base")
        facing = math.degrees(math.atan2(base.xmat[3], base.xmat[0]))
        objects = [self._data.xpos[body] for body in env.obj_body_id.values()]
        roles = self._reader.description.scene.roles.values()
        fixtures = [np.asarray(env.fixtures[name].pos) for name in roles if name in env.fixtures]
        near = [p for p in objects if np.linalg.norm((p - base.xpos)[:2]) < REACH]
        near = near or [p for p in fixtures if np.linalg.norm((p - base.xpos)[:2]) < REACH]
        points = np.array(near or [base.xpos])
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        spread = float(np.linalg.norm(np.ptp(points, axis=0)))
        ahead = base.xpos + 0.6 * np.array([base.xmat[0], base.xmat[3], 0.0])
        return (
            FreeCamera((ahead[0], ahead[1], 1.0), 2.6, facing + 20.0, -30.0),
            FreeCamera((middle[0], middle[1], middle[2]), 0.5 + 1.1 * spread, facing - 15.0, -40.0),
        )


def check_scene(found: Scene, recorded: Scene) -> None:
    """Check that a scene is that of a recording.

    Raises:
        ConfigError: if it is another one.
    """
    if found.bodies != recorded.bodies:
        raise ConfigError(
            "the recording cannot be drawn: its episode begins with other objects now; it is "
            "from other assets, or an older one that does not say how its episode began"
        )


class Studio:
    """Sets up scenes and draws them.

    Args:
        assets: ``auto``, ``official`` or ``primitive``.
        size: of a picture, pixels.
        gl: ``egl``, ``osmesa``, or anything else for what there is.
        draft: see :class:`Shot`.

    Raises:
        ConfigError: if RoboCasa is not installed, or nothing can be drawn on this machine.
    """

    def __init__(self, assets: Mode, size: int, gl: str, draft: bool = False) -> None:
        self._root = prepare_assets(loading.package_assets(), assets).root
        self._size, self._draft = size, draft
        with ThreadPoolExecutor(1) as aside:  # it is tried out in another process
            platform = aside.submit(graphics.find_platform, gl)
            loading.load(self._root)
        self._platform = platform.result()
        self._opened: Any = None

    @contextlib.contextmanager
    def visit(self, request: Request) -> Iterator[Shot]:
        """The scene of an episode as it begins."""
        env = environment.make(request, self._root)
        shot = Shot(env, self._context, self._size, self._draft)
        try:
            yield shot
        finally:
            shot.close()

    def close(self) -> None:
        """Free the place to draw in."""
        if self._opened is not None:
            self._opened.free()

    def _context(self) -> Any:
        """Where to draw. Opened late: a process that has opened it cannot be forked any more."""
        if self._opened is None:
            self._opened = graphics.open_platform(self._platform)
        return self._opened
