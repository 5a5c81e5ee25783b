"""What a held load would meet while the base drives sideways."""

from __future__ import annotations

import math

from pytest_safemanip.policies.scripted.arm import Arm
from pytest_safemanip.policies.scripted.things import Thing

ROOM = 0.03
"""Kept free before a load, m: what swings in the fingers swings by 2 cm."""
UNDER = 0.02
"""Kept free below it, m."""


def before_others(arm: Arm, load: Thing, aside: float) -> float:
    """How far ahead the base may be for a held load to pass before everything that stands there, m.

    Args:
        arm: the arm.
        load: what it holds.
        aside: where the base drives to, along its left direction, m.
    """
    far = load.extent_ahead()[1] - arm.ahead(arm.base)
    way = aside - arm.aside(arm.base)
    sides = [arm.aside(corner) for corner in load.corners]
    right, left = min(sides) + min(0.0, way) - ROOM, max(sides) + max(0.0, way) + ROOM
    limit = math.inf
    for body in arm.scene.bodies:
        other = Thing(arm, body.entity)
        near, across = other.extent_ahead()[0], [arm.aside(corner) for corner in other.corners]
        beside = max(across) < right or min(across) > left
        over_or_under = other.highest < load.bottom - UNDER or other.bottom > load.highest
        # What lies in a load comes along, what is behind the base stays behind it.
        lies_in = math.dist(other.centre[:2], load.middle[:2]) < load.sides()[0][1] / 2.0
        if not (beside or over_or_under or lies_in or near < arm.ahead(arm.base)):
            limit = min(limit, near - ROOM - far)
    return limit
