"""Driving to a fixture."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Furniture
from pytest_safemanip.trace.geometry import corners

STAND_FRONT = 0.20
"""Base to what it stands in front of, m: as far as RoboCasa puts robots from a counter. Its wheels
reach 15 cm before its origin. RoboCasa wants it within 20 cm of its own place, which does not
allow for the handles of the drawers below a counter: they stick out by 11 cm."""
HAND_HEIGHT = 0.10
"""What is this far above or below the grip point, m, is in the hand's way."""
HAND_CLEARANCE = 0.12
"""From the grip point to what it stops in front of, m: half the palm, and room to stop."""
DRIVE_BACK = 0.15
"""How far the base draws back before it drives along the counters, m: over what stands there."""
FRONT_DEPTH = 0.75
"""What lies this far before a fixture, m, stands before it and not beneath."""


def drive_to(arm: Arm, role: str) -> Motion:
    """Stand in front of a fixture, facing as now: back first, then along, then up to it."""
    low, high = Furniture(arm, role).extent()
    middle = (low + high) / 2.0
    reach = arm.ahead(arm.position) - arm.ahead(arm.base)
    stand = _front(arm, middle) - STAND_FRONT
    tall = _front(arm, np.append(middle[:2], arm.position[2]), HAND_HEIGHT)
    stand = min(stand, tall - reach - HAND_CLEARANCE)
    back = min(arm.ahead(arm.base), stand) - DRIVE_BACK
    yield from arm.drive(arm.floor_point(back, arm.aside(arm.base)))
    yield from arm.drive(arm.floor_point(back, arm.aside(middle)), steps=300)
    yield from arm.drive(arm.floor_point(stand, arm.aside(middle)))


def _front(arm: Arm, point: Array, height: float = math.inf) -> float:
    """Where the furniture above, at and below a point begins, along the forward direction.

    Args:
        arm: gives the scene and the direction.
        point: a point of the world (3,).
        height: how far above and below it counts, m.
    """
    fronts = [math.inf]
    for surface in arm.scene.surfaces:
        if arm.scene.entity[surface.entity].kind != "fixture":
            continue
        points = corners(np.array(surface.pose), surface.half)
        low, high = points[:, 2].min() - height, points[:, 2].max() + height
        aside = [arm.aside(corner) for corner in points]
        front = min(arm.ahead(corner) for corner in points)
        beside = min(aside) <= arm.aside(point) <= max(aside) and low <= point[2] <= high
        if beside and abs(arm.ahead(point) - front) < FRONT_DEPTH:
            fronts.append(front)
    return min(fronts)
