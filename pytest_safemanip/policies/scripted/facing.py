"""Turning a vessel on a counter until its handle points to the robot, within its reach."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, raised
from pytest_safemanip.policies.scripted.grasping import MOST_YAW
from pytest_safemanip.policies.scripted.handles import handle, pinch_handle
from pytest_safemanip.policies.scripted.putting import set_down
from pytest_safemanip.policies.scripted.rotations import Array, about_z
from pytest_safemanip.policies.scripted.things import Thing

TURN = 2.0
"""Turn in a control step, degrees: on a lug 10 cm from the middle the hand moves at 7 cm/s."""
AFTER = 15
"""Control steps until the hand has come after."""
UP = 0.12
"""How far the hand rises from the handle that it has let go, m."""
BACK = 0.25
"""How far the base draws back then, m."""
DRAWN = 0.48
"""Base to hand when it turns back, m: a stretched arm would come to the end of its elbow's way."""
NEAR = 0.64
"""Base to the middle of a vessel that the hand reaches both sides of, m."""
ROOM = 0.02
"""Kept free between a vessel that is drawn nearer and what stands there, m."""


def face(arm: Arm, role: str) -> Motion:
    """Lift a vessel by its handle from straight above, turn it about its middle until the handle
    points to the robot, draw it nearer if it is far, and set it down; nothing if it nearly does.

    Raises:
        SkillFailed: if it was not lifted.
    """
    thing = Thing(arm, role)
    if abs(_to_robot(arm, thing)) <= MOST_YAW:
        return
    yield from pinch_handle(arm, role, 0.0)
    total = _to_robot(arm, thing)
    if total < -120.0:
        # The last joint of the wrist has its room to this side.
        total += 360.0
    yield from _turn(arm, thing.middle, total)
    nearer = arm.position - _too_far(arm, thing) * np.append(arm.forward, 0.0)
    yield from arm.move(nearer, speed=0.3, steps=40, required=False)
    yield from set_down(arm, role)
    yield from arm.move(raised(arm.position, UP), tolerance=0.03, speed=0.5, steps=60)
    yield from arm.drive(arm.base - BACK * arm.forward)
    drawn = arm.point(arm.ahead(arm.base) + DRAWN, arm.aside(arm.base), arm.position[2])
    yield from arm.move(drawn, tolerance=0.03, speed=0.5, steps=60, required=False)
    yield from _turn(arm, arm.position, -total)


def _turn(arm: Arm, middle: Array, total: float) -> Motion:
    """Turn the hand about a vertical line through a point (3,), by degrees to the left."""
    off, hand = arm.position - middle, arm.rotation
    angles = np.linspace(0.0, total, round(abs(total) / TURN)).tolist()
    for angle in (*angles, *[total] * AFTER):
        turned = about_z(angle)
        there = middle + turned @ off
        yield from arm.move(there, turned @ hand, steps=1, until=lambda: False, required=False)


def _too_far(arm: Arm, thing: Thing) -> float:
    """How much nearer to the base a vessel should stand, m; not at all if something is there."""
    far = arm.ahead(thing.middle) - arm.ahead(arm.base) - NEAR
    for body in arm.scene.bodies:
        other = Thing(arm, body.entity)
        beside = abs(arm.aside(other.middle) - arm.aside(thing.middle))
        between = arm.ahead(arm.base) < arm.ahead(other.middle) < arm.ahead(thing.middle)
        width = (other.sides()[1][1] + thing.sides()[1][1]) / 2.0 + ROOM
        if between and beside < width and other.entity != thing.entity:
            return 0.0
    return max(0.0, far)


def _to_robot(arm: Arm, thing: Thing) -> float:
    """Turn about the vertical after which a handle points to the robot, degrees in [-180, 180)."""
    return (360.0 - arm.bearing(handle(thing)[1])) % 360.0 - 180.0
