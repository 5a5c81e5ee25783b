"""Where the robot's hand and base are, and points and orientations relative to them."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.robot.choices import Choices
from pytest_safemanip.expert.robot.rotations import Array, about_y, about_z
from pytest_safemanip.trace.geometry import matrix
from pytest_safemanip.trace.steps import Step

TIPPED, TURNED = (0.0, 15.0, -15.0, 30.0), (0.0, 20.0, -20.0)
"""By how much the hand may be tipped forward and turned left otherwise than usual, degrees."""


class Posture:
    """The newest state of hand and base. Points are of the world, metres.

    Args:
        step: the first state.

    Attributes:
        step: the newest state.
        straight_down: the hand (3, 3) that points straight down, its wrist turned as an episode
            begins.
    """

    def __init__(self, step: Step) -> None:
        self.step = step
        self.choices = Choices()
        axis = self.rotation[:, 0].copy()
        axis[2] = 0.0
        axis /= np.linalg.norm(axis)
        down = np.array((0.0, 0.0, -1.0))
        self.straight_down = np.stack((axis, np.cross(down, axis), down), axis=1)

    @property
    def position(self) -> Array:
        """Grip point (3,)."""
        return np.asarray(self.step.eef_pose[:3], np.float64)

    @property
    def rotation(self) -> Array:
        """Hand frame (3, 3): columns are the fingers' direction of travel, the normal of the hand,
        and the approach direction out of the palm.
        """
        return np.asarray(matrix(self.step.eef_pose[3:]), np.float64)

    @property
    def pitch(self) -> float:
        """Degrees from straight down to where the hand points, towards the base's forward."""
        return self.pitch_of(self.rotation)

    @property
    def base(self) -> Array:
        """Base position on the floor (2,)."""
        return np.asarray(self.step.base_pose[:2], np.float64)

    @property
    def forward(self) -> Array:
        """Where the base faces, on the floor (2,)."""
        return np.asarray(matrix(self.step.base_pose[3:])[:2, 0], np.float64)

    @property
    def left(self) -> Array:
        """To the left of the base, on the floor (2,)."""
        return np.asarray(matrix(self.step.base_pose[3:])[:2, 1], np.float64)

    @property
    def frame(self) -> Array:
        """Forward, left and up of the base as columns (3, 3)."""
        forward, left = np.append(self.forward, 0.0), np.append(self.left, 0.0)
        return np.stack((forward, left, np.array((0.0, 0.0, 1.0))), axis=1)

    def ahead(self, point: Array) -> float:
        """How far a point lies along the base's forward direction, m."""
        return float(np.asarray(point)[:2] @ self.forward)

    def aside(self, point: Array) -> float:
        """How far a point lies along the base's left direction, m."""
        return float(np.asarray(point)[:2] @ self.left)

    def bearing(self, way: Array) -> float:
        """Degrees about the vertical from the base's forward direction left to another one."""
        return math.degrees(math.atan2(self.aside(way), self.ahead(way)))

    def pitch_of(self, hand: Array) -> float:
        """Degrees from straight down to where a hand (3, 3) points, towards the base's forward."""
        approach = hand[:, 2]
        return math.degrees(math.atan2(approach[:2] @ self.forward, -approach[2]))

    def floor_point(self, ahead: float, aside: float) -> Array:
        """The point on the floor with these two coordinates (2,)."""
        return ahead * self.forward + aside * self.left

    def point(self, ahead: float, aside: float, height: float) -> Array:
        """The point with these coordinates (3,)."""
        return np.append(self.floor_point(ahead, aside), height)

    def before(self, ahead: float, height: float) -> Array:
        """The point so far straight before the base, m, at a height (3,)."""
        return self.point(self.ahead(self.base) + ahead, self.aside(self.base), height)

    def onward(self, distance: float) -> Array:
        """The way so far along the base's forward direction, m (3,)."""
        return np.append(distance * self.forward, 0.0)

    def hand(self, pitch: float = 0.0, roll: float = 0.0, yaw: float = 0.0) -> Array:
        """A hand orientation (3, 3).

        Args:
            pitch: degrees from straight down towards the base's forward direction.
            roll: degrees about the approach direction, before pitching.
            yaw: degrees about the vertical, applied last.
        """
        pitch += self.choices.choose("hand tipped farther", TIPPED)
        yaw += self.choices.choose("hand turned farther", TURNED)
        return self.pointing(pitch, roll, yaw)

    def pointing(self, pitch: float = 0.0, roll: float = 0.0, yaw: float = 0.0) -> Array:
        """A hand orientation (3, 3), as :meth:`hand` gives it where nothing else is chosen."""
        heading = about_z(math.degrees(math.atan2(self.forward[1], self.forward[0])))
        tipped = heading @ about_y(-pitch) @ heading.T @ about_z(roll) @ self.straight_down
        turned: Array = about_z(yaw) @ tipped
        return turned
