"""A scene, and where in MuJoCo's arrays its moving parts are read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.mujoco.extents import vector
from pytest_safemanip.sim.mujoco.parts import PartTable
from pytest_safemanip.trace.elements import Camera, Vector
from pytest_safemanip.trace.scene import Scene

Read = Callable[[], Sequence[bool]]
"""Gives the states of some of the scene's switches."""

_KINDS = {
    "body": mujoco.mjtObj.mjOBJ_BODY,
    "camera": mujoco.mjtObj.mjOBJ_CAMERA,
    "geom": mujoco.mjtObj.mjOBJ_GEOM,
    "joint": mujoco.mjtObj.mjOBJ_JOINT,
    "site": mujoco.mjtObj.mjOBJ_SITE,
}


@dataclass(frozen=True)
class Hand:
    """Where a hand is read.

    Attributes:
        site: id of the end effector's site; -1 if it is the body itself.
        body: id of the body that it is on.
        qpos: addresses of the finger joints (K,).
        dof: likewise (K,).
        closed: their positions when the hand is closed (K,).
        opened: when it is open (K,).
    """

    site: int
    body: int
    qpos: NDArray[np.intp]
    dof: NDArray[np.intp]
    closed: NDArray[np.float64]
    opened: NDArray[np.float64]

    def pose(self, data: Any) -> NDArray[np.float64]:
        """Of the end effector, world frame (7,)."""
        if self.site < 0:
            return np.concatenate((data.xpos[self.body], data.xquat[self.body]))
        quat = np.empty(4)
        mujoco.mju_mat2Quat(quat, data.site_xmat[self.site])
        return np.concatenate((data.site_xpos[self.site], quat))

    def opening(self, data: Any) -> tuple[float, float]:
        """0 closed, 1 open, and its rate in 1/s; 0 of a tool without fingers."""
        if not len(self.qpos):
            return 0.0, 0.0
        way = self.opened - self.closed
        opening = ((data.qpos[self.qpos] - self.closed) / way).mean()
        return float(opening), float((data.qvel[self.dof] / way).mean())


@dataclass(frozen=True)
class Attached:
    """Where things are that move with bodies: boxes of fixtures, cameras.

    Attributes:
        body: ids of the bodies that they move with (B,).
        local: their poses in the frames of these (B, 7).
    """

    body: NDArray[np.intp]
    local: NDArray[np.float64]

    @classmethod
    def of(cls, places: Sequence[tuple[int, NDArray[np.float64]]]) -> Attached:
        """Of bodies and poses in their frames (7,)."""
        local = [pose for _, pose in places]
        return cls(np.array([body for body, _ in places], np.intp), np.array(local).reshape(-1, 7))


@dataclass(frozen=True)
class Description:
    """A scene, and where in MuJoCo's arrays its moving parts are read.

    Attributes:
        scene: what is recorded.
        table: parts of geoms.
        hands: of the scene's grippers.
        base: body id of the robot's base.
        object_body: body id of each object (N,).
        joint_qpos: qpos address of each joint (J,).
        joint_dof: dof address of each joint (J,).
        joint_closed: joint position at openness 0 (J,).
        joint_open: joint position at openness 1 (J,).
        boxes: of the scene's boxes.
        read_switches: give the states of the scene's switches, one after the other.
        cameras: of the scene's cameras.
        particles: body id of each particle of a liquid (P,).
    """

    scene: Scene
    table: PartTable
    hands: tuple[Hand, ...]
    base: int
    object_body: NDArray[np.intp]
    joint_qpos: NDArray[np.intp]
    joint_dof: NDArray[np.intp]
    joint_closed: NDArray[np.float64]
    joint_open: NDArray[np.float64]
    boxes: Attached
    read_switches: Sequence[Read] = ()
    cameras: Attached = field(default_factory=lambda: Attached.of(()))
    particles: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp))


def find(model: Any, kind: str, name: str, what: str = "the layout") -> int:
    """Id of a ``body``, ``camera``, ``geom``, ``joint`` or ``site``.

    Args:
        model: a ``mujoco.MjModel``.
        kind: one of these.
        name: its name.
        what: who names it, for the error.

    Raises:
        ConfigError: if the model has none of this name.
    """
    found = int(mujoco.mj_name2id(model, _KINDS[kind], name))
    if found < 0:
        raise ConfigError(f"{what} names a {kind} {name!r} that the model does not have")
    return found


def half_of_geom(model: Any, geom: int) -> Vector:
    """Half extents of the box around a geom of a primitive shape, in its own axes, m (3,)."""
    return _half(int(model.geom_type[geom]), model.geom_size[geom])


def half_of_site(model: Any, site: int) -> Vector:
    """Half extents of the box around a site, in its own axes, m (3,)."""
    return _half(int(model.site_type[site]), model.site_size[site])


def _half(shape: int, size: NDArray[np.float64]) -> Vector:
    if shape == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return vector((size[0], size[0], size[1]))
    if shape == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return vector((size[0], size[0], size[0] + size[1]))
    if shape == mujoco.mjtGeom.mjGEOM_SPHERE:
        return vector((size[0], size[0], size[0]))
    return vector(size)


def geom_place(model: Any, geom: int) -> tuple[int, NDArray[np.float64]]:
    """The body that a geom moves with, and the geom's pose in its frame (7,)."""
    pose = np.concatenate((model.geom_pos[geom], model.geom_quat[geom]))
    return int(model.geom_bodyid[geom]), pose


def camera_place(model: Any, camera: int) -> tuple[int, NDArray[np.float64]]:
    """The body that a camera moves with, and the camera's pose in its frame (7,)."""
    pose = np.concatenate((model.cam_pos[camera], model.cam_quat[camera]))
    return int(model.cam_bodyid[camera]), pose


def camera_of(model: Any, camera: int, aspect: float) -> Camera:
    """A camera.

    Args:
        model: a ``mujoco.MjModel``.
        camera: its id.
        aspect: width of its image over the height.
    """
    fov = float(np.deg2rad(model.cam_fovy[camera]))
    return Camera(str(model.camera(camera).name), fov, aspect)


def site_place(model: Any, site: int) -> tuple[int, NDArray[np.float64]]:
    """The body that a site moves with, and the site's pose in its frame (7,)."""
    pose = np.concatenate((model.site_pos[site], model.site_quat[site]))
    return int(model.site_bodyid[site]), pose
