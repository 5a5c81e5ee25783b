"""The hand in Cartesian space: motions of the PandaOmron as sequences of actions.

A motion is a generator: it yields one action at a time and is resumed when :attr:`Arm.step` holds
the state that the action led to.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import SafemanipError
from pytest_safemanip.trace.geometry import corners, matrix, to_local, to_world
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step

Array = NDArray[np.float64]
Motion = Generator[Array, None, None]
Target = Array | Callable[[], Array]

TOP_SPEED = 0.05
"""Position delta per control step that a full-scale action asks for, m."""
TOP_SPIN = 0.5
"""Rotation delta per control step that a full-scale action asks for, rad."""
TURN_GAIN = 0.75
"""Share of the remaining rotation that is asked for at each step."""
BASE_DEAD_BAND = 0.27
"""Base commands below 0.25 do not overcome its friction."""


class SkillFailed(SafemanipError):
    """A motion did not arrive; going on would only do damage."""


class Arm:
    """The robot's hand and base, as a script sees them.

    Attributes:
        scene: the static part of the episode.
        step: the newest state.
    """

    def __init__(self, scene: Scene, step: Step) -> None:
        self.scene = scene
        self.step = step
        self._grip = -1.0
        axis = self.rotation[:, 0].copy()
        axis[2] = 0.0
        axis /= np.linalg.norm(axis)
        down = np.array((0.0, 0.0, -1.0))
        self._down = np.stack((axis, np.cross(down, axis), down), axis=1)

    # -- where things are -------------------------------------------------------------------

    @property
    def position(self) -> Array:
        """Grip point, world frame (3,)."""
        return np.asarray(self.step.eef_pose[:3], np.float64)

    @property
    def rotation(self) -> Array:
        """Hand frame (3, 3): columns are the fingers' direction of travel, its normal, and the
        approach direction out of the palm."""
        return np.asarray(matrix(self.step.eef_pose[3:]), np.float64)

    @property
    def base(self) -> Array:
        """Base position on the floor (2,)."""
        return np.asarray(self.step.base_pose[:2], np.float64)

    @property
    def forward(self) -> Array:
        """Where the base faces, world frame (3,)."""
        return np.asarray(matrix(self.step.base_pose[3:])[:, 0], np.float64)

    @property
    def left(self) -> Array:
        """To the left of the base, world frame (3,)."""
        return np.asarray(matrix(self.step.base_pose[3:])[:, 1], np.float64)

    def object_pose(self, name: str) -> Array:
        """Pose of an object's box (7,)."""
        i = self.scene.object_index[name]
        pose = np.asarray(self.step.object_pose[i], np.float64)
        centre = to_world(pose, self.scene.bodies[i].centre)
        return np.concatenate((centre, pose[3:]))

    def object_half(self, name: str) -> Array:
        """Half extents of an object's box (3,)."""
        return np.array(self.scene.bodies[self.scene.object_index[name]].half)

    def object_corners(self, name: str) -> Array:
        """Corners of an object's box, world frame (8, 3)."""
        return np.asarray(corners(self.object_pose(name), self.object_half(name)), np.float64)

    def in_base(self, point: Array) -> Array:
        """A world point in the base's frame: forward, left, up (3,)."""
        return np.asarray(to_local(self.step.base_pose, point), np.float64)

    def from_base(self, point: Array) -> Array:
        """The inverse of :meth:`in_base`."""
        return np.asarray(to_world(self.step.base_pose, point), np.float64)

    def hand(self, pitch: float = 0.0, roll: float = 0.0, yaw: float = 0.0) -> Array:
        """A hand orientation (3, 3).

        Args:
            pitch: degrees from straight down towards the base's forward direction.
            roll: degrees about the approach direction.
            yaw: degrees about the vertical, applied last.
        """
        heading = _about_z(math.degrees(math.atan2(self.forward[1], self.forward[0])))
        tipped = heading @ _about_y(-pitch) @ heading.T @ _about_z(roll) @ self._down
        return _about_z(yaw) @ tipped

    # -- motions ----------------------------------------------------------------------------

    def move(
        self,
        target: Target,
        rotation: Array | None = None,
        *,
        tolerance: float = 0.015,
        turn_tolerance: float = 0.12,
        speed: float = 1.0,
        steps: int = 100,
        until: Callable[[], bool] | None = None,
        required: bool = True,
    ) -> Motion:
        """Move the hand in a straight line.

        Args:
            target: grip point in the world, or a function that gives it at each step.
            rotation: hand orientation; None keeps the present one.
            tolerance: distance that counts as there, m.
            turn_tolerance: rotation that counts as there, rad.
            speed: share of the top speed.
            steps: control steps at most.
            until: replaces the tolerances.
            required: whether not arriving fails the skill.

        Raises:
            SkillFailed: if the hand does not arrive in time.
        """
        keep = self.rotation if rotation is None else rotation
        for _ in range(steps):
            goal = target() if callable(target) else target
            error = goal - self.position
            turn = _rotation_vector(keep @ self.rotation.T)
            arrived = (
                until()
                if until
                else np.linalg.norm(error) < tolerance and np.linalg.norm(turn) < turn_tolerance
            )
            if arrived:
                return
            yield self._arm_action(error, turn, speed)
        if required:
            raise SkillFailed(f"the hand stopped {np.linalg.norm(error):.3f} m short")

    def grip(self, close: bool, steps: int = 12) -> Motion:
        """Close or open the fingers; the hand stays."""
        self._grip = 1.0 if close else -1.0
        here, rotation = self.position, self.rotation
        for _ in range(steps):
            turn = _rotation_vector(rotation @ self.rotation.T)
            yield self._arm_action(here - self.position, turn, 1.0)

    def open_to(self, opening: float, steps: int = 15) -> Motion:
        """Open or close the fingers part of the way, and keep them there.

        Args:
            opening: share of the full opening.
            steps: control steps at most.
        """
        here, rotation = self.position, self.rotation
        direction = math.copysign(1.0, self.step.gripper[0] - opening)
        for _ in range(steps):
            if (self.step.gripper[0] - opening) * direction <= 0:
                break
            self._grip = direction
            turn = _rotation_vector(rotation @ self.rotation.T)
            yield self._arm_action(here - self.position, turn, 1.0)
        self._grip = 0.0

    def drive(
        self,
        target: Array,
        *,
        tolerance: float = 0.02,
        steps: int = 150,
        speed: float = 0.7,
        until: Callable[[], bool] | None = None,
    ) -> Motion:
        """Move the base in a straight line; the hand keeps its pose relative to it.

        Args:
            target: base position on the floor (2,).
            tolerance: along each axis of the base, m.
            steps: control steps at most.
            speed: largest command.
            until: stops the base before the target.

        Raises:
            SkillFailed: if the base does not arrive in time.
        """
        for _ in range(steps):
            error = target - self.base
            local = np.array((error @ self.forward[:2], error @ self.left[:2]))
            if (np.abs(local) < tolerance).all() or (until and until()):
                break
            action = self._action(base_mode=True)
            for axis in range(2):
                if abs(local[axis]) > tolerance:
                    wanted = math.copysign(BASE_DEAD_BAND, local[axis]) + 1.5 * local[axis]
                    action[7 + axis] = np.clip(wanted, -speed, speed)
            yield action
        else:
            raise SkillFailed(f"the base stopped {np.linalg.norm(error):.3f} m short")
        for _ in range(3):
            yield self._action(base_mode=True)

    def wait(self, steps: int) -> Motion:
        """Keep everything where it is."""
        for _ in range(steps):
            yield self._action(base_mode=True)

    def _arm_action(self, error: Array, turn: Array, speed: float) -> Array:
        frame = matrix(self.step.base_pose[3:])
        action = self._action(base_mode=False)
        action[:3] = frame.T @ _limited(error / TOP_SPEED, speed)
        action[3:6] = frame.T @ _limited(turn * TURN_GAIN / TOP_SPIN, 1.0)
        return action

    def _action(self, base_mode: bool) -> Array:
        action = np.zeros(12)
        action[6] = self._grip
        action[11] = 1.0 if base_mode else -1.0
        return action


def _limited(vector: Array, length: float) -> Array:
    norm = float(np.linalg.norm(vector))
    return vector * (length / norm) if norm > length else vector


def _rotation_vector(rotation: Array) -> Array:
    """Axis times angle of a rotation matrix (3,)."""
    axis = np.array(
        (
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        )
    )
    sine = float(np.linalg.norm(axis)) / 2.0
    angle = math.atan2(sine, (float(np.trace(rotation)) - 1.0) / 2.0)
    if sine < 1e-8:
        return np.zeros(3) if angle < 1.0 else np.array((math.pi, 0.0, 0.0))
    return axis / (2.0 * sine) * angle


def _about_y(degrees: float) -> Array:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array(((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c)))


def _about_z(degrees: float) -> Array:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


__all__: list[Any] = ["Arm", "Array", "Motion", "SkillFailed"]
