"""Skills on objects: pick up from a counter or out of a drawer, put into a cabinet or down."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.things import Furniture, Thing, counter

GAP = 0.076
"""Widest side that fits between the fingers, m."""
LIFTED = 0.02
"""Rise that shows that an object is held, m; the hand itself rises by 3 cm at least."""

FRONT_PITCH = 35.0
"""Degrees from straight down: the wrist stays clear of what hangs above the counter."""
FRONT_STAND = 0.63
CARRY_REACH = 0.50
"""Base to hand while a load is carried, m."""

SHELF_PITCH = 50.0
SHELF_STAND = 0.51
"""Base to the front of the shelf, m."""
SHELF_DEPTH = 0.06
"""Free space between the front of the shelf and the object, m."""

DRAWER_STAND = 0.50
DRAWER_CLEARANCE = 0.27
"""Base to the front of an open drawer, m: its column, and the handle."""
BESIDE = 0.40
"""From the side of a drawer to where something is put down beside it, m."""
MIDDLE = np.zeros(3)
FINGERTIP = 0.012
"""Grip point above a surface at which the fingertips do not touch it, m."""


def pick_from_counter(arm: Arm, role: str) -> Motion:
    """Pinch an object from the front, the fingers level.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    yield from pinch(arm, role)


def pinch(arm: Arm, role: str, offset: Array = MIDDLE) -> Motion:
    """Pinch an object on a counter from the front and lift it.

    Args:
        arm: the arm.
        role: the object.
        offset: from its middle to where it is gripped (3,), m.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    thing = Thing(arm, role)
    yaw = _level_yaw(arm, thing)
    hand = arm.hand(FRONT_PITCH, yaw=yaw)
    approach = hand[:, 2]
    where = thing.centre + offset
    yield from arm.drive(arm.floor_point(arm.ahead(where) - FRONT_STAND, arm.aside(where)))
    where = thing.centre + offset
    rise = max(thing.height / 2.0 - 0.025, FINGERTIP + 0.008 - thing.height / 2.0)
    target = raised(where, rise)
    yield from arm.open_to(0.98)
    yield from arm.move(raised(target - 0.14 * approach, 0.03), hand, tolerance=0.03, steps=140)
    yield from arm.move(
        target - 0.07 * approach, hand, tolerance=0.012, turn_tolerance=0.08, steps=60
    )
    yield from arm.move(
        target, hand, tolerance=0.008, turn_tolerance=0.08, speed=0.4, steps=45, required=False
    )
    yield from _lift(arm, thing, hand, 0.05)


def pick_from_drawer(arm: Arm, role: str, drawer_role: str) -> Motion:
    """Pinch an object in an open drawer from above, across its narrow side, and lift it out.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    thing, drawer = Thing(arm, role), Furniture(arm, drawer_role)
    pose, half = drawer.interior()
    middle, front = arm.aside(pose), arm.ahead(pose) - half[1]
    roll = _narrow_roll(arm, thing)
    where = thing.com
    hand = arm.hand(_drawer_pitch(arm.ahead(where) - arm.ahead(pose)), roll)
    stand = min(arm.ahead(where) - DRAWER_STAND, front - DRAWER_CLEARANCE)
    # Out of the way sideways first: the base may stand so close that its column touches the drawer.
    side = math.copysign(1.0, arm.aside(arm.base) - middle)
    beside = middle + side * max(abs(arm.aside(arm.base) - middle), half[0] + 0.25)
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), beside))
    yield from arm.drive(arm.floor_point(stand - 0.08, beside))
    yield from arm.drive(arm.floor_point(stand - 0.08, arm.aside(where)))
    yield from arm.drive(arm.floor_point(stand, arm.aside(where)))
    yield from arm.open_to(0.8)
    target = np.append(where[:2], thing.bottom + FINGERTIP)
    yield from arm.move(
        np.append(where[:2], 1.05), hand, tolerance=0.02, turn_tolerance=0.08, steps=140
    )
    yield from arm.move(
        raised(target, 0.06), hand, tolerance=0.012, turn_tolerance=0.06, speed=0.7, steps=80
    )
    yield from arm.move(
        target, hand, tolerance=0.005, turn_tolerance=0.06, speed=0.3, steps=40, required=False
    )
    yield from _lift(arm, thing, hand, 0.08)
    yield from arm.move(
        np.append(arm.position[:2], 1.10), arm.hand(0.0, roll), tolerance=0.03, speed=0.6, steps=60
    )


def carry_to_shelf(arm: Arm, role: str, cabinet_role: str) -> Motion:
    """Bring a held object in front of an open cabinet, a little above its lowest shelf."""
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    front, shelf = _opening(arm, cabinet)
    pose, half = cabinet.interior()
    clear = max(0.12, thing.extent_ahead()[1] - (front - 0.10))
    yield from arm.drive(arm.base - clear * arm.forward)
    reach = min(arm.ahead(arm.position) - arm.ahead(arm.base), CARRY_REACH + 0.02)
    turning = arm.hand((FRONT_PITCH + SHELF_PITCH) / 2.0)
    yield from arm.move(
        arm.point(arm.ahead(arm.base) + reach, arm.aside(arm.position), 1.30),
        turning,
        tolerance=0.05,
        turn_tolerance=0.3,
        steps=80,
    )

    def before_shelf() -> Array:
        height = arm.position[2] + shelf + 0.05 - thing.bottom
        return arm.point(arm.ahead(arm.base) + CARRY_REACH, arm.aside(arm.base), height)

    yield from arm.move(
        before_shelf, arm.hand(SHELF_PITCH), tolerance=0.03, turn_tolerance=0.15, steps=120
    )
    middle, room = arm.aside(pose), half[0] - 0.2
    aside = float(np.clip(arm.aside(thing.centre), middle - room, middle + room))
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), aside))


def put_on_shelf(arm: Arm, role: str, cabinet_role: str) -> Motion:
    """Push a held object in over the shelf, lower it, let go, and draw back."""
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    front, shelf = _opening(arm, cabinet)
    hand = arm.hand(SHELF_PITCH)
    stand = arm.floor_point(front - SHELF_STAND, arm.aside(arm.base))
    yield from arm.drive(
        stand, until=lambda: thing.extent_ahead()[0] > front + SHELF_DEPTH, speed=0.5
    )

    def over_shelf() -> Array:
        way = front + SHELF_DEPTH - thing.extent_ahead()[0]
        return np.add(arm.position, (*(way * arm.forward), shelf + 0.03 - thing.bottom))

    yield from arm.move(
        over_shelf, hand, tolerance=0.02, turn_tolerance=0.2, speed=0.6, steps=60, required=False
    )
    yield from lower(arm, thing, shelf, hand)
    yield from arm.grip(False)
    yield from arm.move(
        arm.position - 0.08 * arm.rotation[:, 2],
        tolerance=0.03,
        speed=0.5,
        steps=30,
        required=False,
    )
    yield from arm.drive(arm.base - 0.35 * arm.forward)


def place_in_cabinet(arm: Arm, role: str, cabinet_role: str) -> Motion:
    """Put a held object on the lowest shelf of an open cabinet."""
    yield from carry_to_shelf(arm, role, cabinet_role)
    yield from put_on_shelf(arm, role, cabinet_role)


def place_beside(arm: Arm, role: str, counter_role: str, drawer_role: str) -> Motion:
    """Put a held object on a counter, to the right of an open drawer below it."""
    pose, half = Furniture(arm, drawer_role).interior()
    aside = arm.aside(pose) - half[0] - BESIDE
    top, edge = counter(arm, counter_role)
    yield from put_on_counter(arm, role, edge + 0.15, aside, top)


def put_on_counter(arm: Arm, role: str, ahead: float, aside: float, top: float) -> Motion:
    """Put a held object down on a counter and draw back.

    Args:
        arm: the arm.
        role: the object.
        ahead: where the hand lets go, along the base's forward direction, m.
        aside: likewise along its left direction, m.
        top: height of the counter, m.
    """
    thing = Thing(arm, role)
    roll = _narrow_roll(arm, thing)
    hand = arm.hand(0.0, roll)
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), aside))
    yield from arm.drive(arm.floor_point(ahead - 0.52, aside))
    yield from arm.move(arm.point(ahead, aside, 1.05), hand, tolerance=0.03, speed=0.6, steps=80)
    yield from lower(arm, thing, top, hand)
    yield from arm.grip(False)
    yield from arm.move(raised(arm.position, 0.12), tolerance=0.03, steps=40, required=False)
    yield from arm.drive(arm.base - 0.3 * arm.forward)


def lower(arm: Arm, thing: Thing, surface: float, hand: Array) -> Motion:
    """Lower a held object until it is 3 mm above a surface."""
    ahead, aside = arm.ahead(arm.position), arm.aside(arm.position)
    yield from arm.move(
        lambda: arm.point(ahead, aside, arm.position[2] + surface + 0.003 - thing.bottom),
        hand,
        tolerance=0.004,
        turn_tolerance=0.2,
        speed=0.35,
        steps=60,
        required=False,
    )


def _lift(arm: Arm, thing: Thing, hand: Array, rise: float) -> Motion:
    before = thing.bottom
    yield from arm.grip(True, 14)
    yield from arm.move(
        raised(arm.position, rise), hand, tolerance=0.02, speed=0.35, steps=40, required=False
    )
    if thing.bottom - before < LIFTED:
        raise SkillFailed("the object was not lifted")


def _opening(arm: Arm, cabinet: Furniture) -> tuple[float, float]:
    """Where a cabinet's lowest interior begins, along the forward direction, and its floor."""
    pose, half = cabinet.interior()
    return arm.ahead(pose) - float(half[1]), float(pose[2] - half[2])


def _level_yaw(arm: Arm, thing: Thing) -> float:
    """Turn about the vertical, in degrees, that lays the fingers across a side that fits."""
    fitting = [_fold(_angle(arm, axis), 90.0) for axis, width in thing.sides() if width <= GAP]
    if not fitting:
        raise SkillFailed("the object is too wide for the gripper")
    best = min(fitting, key=abs)
    return best if abs(best) <= 50.0 else 0.0


def _narrow_roll(arm: Arm, thing: Thing) -> float:
    """Roll of a hand that points down, in degrees in (-60, 120], across the narrow side."""
    axis, width = thing.sides()[0]
    if width > GAP:
        raise SkillFailed("the object is too wide for the gripper")
    return _fold(_angle(arm, axis), 120.0)


def _angle(arm: Arm, axis: Array) -> float:
    """Degrees about the vertical from the fingers' direction to an axis."""
    fingers = arm.hand()[:, 0]
    return math.degrees(math.atan2(np.cross(fingers, axis)[2], fingers @ axis))


def _fold(degrees: float, top: float) -> float:
    """The same line, as an angle in (top - 180, top]."""
    return top - (top - degrees) % 180.0


def _drawer_pitch(ahead: float) -> float:
    """Tilt of the hand, in degrees, that keeps the palm off the drawer's front and the counter.

    Args:
        ahead: where the object lies, relative to the middle of the drawer, m.
    """
    return float(np.interp(ahead, (-0.11, -0.07, -0.05, 0.0, 0.02, 0.08), (-15, -10, 0, 0, 8, 18)))
