"""The hollow of a fixture, as a script sees it: where it is, and what is in it."""

from __future__ import annotations

from fnmatch import fnmatchcase

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.sim.staging import SHOULDER
from pytest_safemanip.trace.geometry import corners, to_local

PALM = 0.06
"""Grip point to the middle of the hand, m: half of the fingers and of the palm is beyond it."""


class Hollow:
    """One interior of a fixture: a shelf, a rack, the inside of a drawer.

    Args:
        arm: gives the newest step.
        role: the task's name for the fixture.
        name: of the interior, as the scene names it; empty if there is only one. A pattern means
            what it means in :class:`~pytest_safemanip.sim.staging.Put`.

    Raises:
        SkillFailed: if it has no such interior, or several.
    """

    def __init__(self, arm: Arm, role: str, name: str = "") -> None:
        inside = arm.scene.boxes_of(arm.scene.roles[role], "interior")
        found = [k for k in inside if fnmatchcase(arm.scene.boxes[k].name, f"*{name}")]
        if not found or (len(found) > 1 and "*" not in name):
            raise SkillFailed(f"{role} has {len(found)} interiors {name!r}")
        floors = {k: arm.step.box_pose[k][2] - arm.scene.boxes[k].half[2] for k in found}
        self._arm, self._index = arm, min(found, key=lambda k: abs(floors[k] - SHOULDER))

    def _extent(self, along: Array) -> tuple[float, float]:
        points = corners(self._pose, self._half) @ along
        return float(points.min()), float(points.max())

    @property
    def _pose(self) -> Array:
        return np.asarray(self._arm.step.box_pose[self._index], np.float64)

    @property
    def _half(self) -> Array:
        return np.array(self._arm.scene.boxes[self._index].half)

    @property
    def ahead(self) -> tuple[float, float]:
        """Where it begins and ends along the base's forward direction, m."""
        return self._extent(np.append(self._arm.forward, 0.0))

    @property
    def aside(self) -> tuple[float, float]:
        """Its right and its left side along the base's left direction, m."""
        return self._extent(np.append(self._arm.left, 0.0))

    @property
    def height(self) -> tuple[float, float]:
        """Its floor and its top, m."""
        return self._extent(np.array((0.0, 0.0, 1.0)))

    def point(self, ahead: float, aside: float, up: float) -> Array:
        """A point so far beyond where it begins, left of its middle, and above its floor (3,)."""
        middle = sum(self.aside) / 2.0
        return self._arm.point(self.ahead[0] + ahead, middle + aside, self.height[0] + up)

    def has_hand(self) -> bool:
        """Whether the hand is in it up to its middle."""
        middle = self._arm.position - PALM * self._arm.rotation[:, 2]
        return bool((np.abs(to_local(self._pose, middle)) < self._half).all())

    def depth(self, thing: Thing) -> tuple[float, float]:
        """How far inside an object's innermost and outermost corners are, m: negative if outside.

        The floor does not count: what stands on it may sink in a little.
        """
        local = np.abs(to_local(self._pose, thing.corners)) - self._half
        local[:, 2] = np.where(to_local(self._pose, thing.corners)[:, 2] < 0, -np.inf, local[:, 2])
        inside = -local.max(axis=1)
        return float(inside.max()), float(inside.min())
