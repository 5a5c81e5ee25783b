"""Navigation: the base drives to a fixture, stands before it and faces it."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.reaching import HEADINGS
from pytest_safemanip.expert.motions.travelling import drive, travel
from pytest_safemanip.expert.motions.turning import facing, turn_base
from pytest_safemanip.expert.robot.arm import Arm, Motion, fold_arm
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.routes import floor
from pytest_safemanip.expert.world.standing import passable
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
FRONT_DEPTH = 0.75
"""What lies this far before a fixture, m, stands before it and not beneath."""
MOVED_OUT = 0.05
"""A hand that is so much farther ahead of the base than before is drawn in again, m."""
BACKS = (0.0, 0.05, 0.1, 0.15)
"""Distances behind its goal at one of which the base has to have room, m: handles stick out."""


def drive_to(arm: Arm, role: str) -> Motion:
    """Stand in front of a fixture, turned to it.

    Args:
        arm: the arm.
        role: the fixture.

    Raises:
        SkillFailed: if the base does not get there.
    """
    turn = arm.choices.choose("base turned", _headings(arm, role) or [0.0])
    if turn:
        yield from turn_base(arm, turn, None)
        yield from fold_arm(arm, required=False)
    arm.turned = 0.0
    before = arm.hand_ahead
    yield from travel(arm, lambda: _base_goal(arm, role, arm.hand_ahead))
    if arm.hand_ahead > before + MOVED_OUT:
        # The way there took another posture of the arm, with which the base stays too far off.
        yield from fold_arm(arm, required=False)
        yield from drive(arm, _base_goal(arm, role, arm.hand_ahead))


def face(arm: Arm, role: str) -> Motion:
    """Turn back to a fixture, if the base was turned to reach something and cannot stand before the
    fixture as it faces now.

    Args:
        arm: the arm.
        role: the fixture, or its entity.

    Raises:
        SkillFailed: if the base has no room to turn.
    """
    back = next((turn for turn in HEADINGS if (arm.turned + turn) % 360.0 == 0.0), 0.0)
    if not back:
        return
    headings = _headings(arm, role)
    if back in headings and 0.0 not in headings:
        yield from turn_base(arm, back, None)
        yield from fold_arm(arm, required=False)


def _headings(arm: Arm, role: str) -> list[float]:
    """Turns of the base to the left, degrees, after which its goal before a fixture is on the floor
    and has room.
    """
    hand_ahead, found = arm.hand_ahead, list[float]()
    for turn in HEADINGS:
        with facing(arm, turn):
            (ahead, aside), (low, high) = arm.level(_base_goal(arm, role, hand_ahead)), floor(arm)
            inside = (low <= (ahead, aside)).all() and (high >= (ahead, aside)).all()
            if inside and any(passable(arm, aside, aside, ahead - back) for back in BACKS):
                found.append(turn)
    return found


def _base_goal(arm: Arm, role: str, hand_ahead: float) -> Array:
    """Where the base stands before a fixture (2,).

    Args:
        arm: the arm.
        role: the fixture.
        hand_ahead: how far the grip point is then ahead of the base, m.
    """
    low, high = Furniture(arm, role).extent()
    middle = (low + high) / 2.0
    at_hand = np.append(middle[:2], arm.position[2])
    ahead = min(
        _begins(arm, middle) - STAND_FRONT,
        _begins(arm, at_hand, HAND_HEIGHT) - hand_ahead - HAND_CLEARANCE,
    )
    return arm.floor_point(ahead, arm.aside(middle))


def _begins(arm: Arm, point: Array, height: float = math.inf) -> float:
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
