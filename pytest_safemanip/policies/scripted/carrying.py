"""Carrying to a cabinet or a counter and putting down there."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, raised
from pytest_safemanip.policies.scripted.grasping import narrow_roll
from pytest_safemanip.policies.scripted.picking import FRONT_PITCH
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.things import Furniture, Thing, counter

CARRY_REACH = 0.50
"""Base to hand while a load is carried, m."""
SHELF_PITCH = 50.0
SHELF_STAND = 0.51
"""Base to the front of the shelf, m."""
SHELF_DEPTH = 0.06
"""Free space between the front of the shelf and the object, m."""
NEXT = 0.105
"""Middle to middle of two things on a shelf, m: the opening fingers go between them."""
BESIDE = 0.40
"""From the side of a drawer to where something is put down beside it, m."""


def carry_to_shelf(arm: Arm, role: str, cabinet_role: str, aside: float | None = None) -> Motion:
    """Bring a held object in front of an open cabinet, a little above its lowest shelf.

    Args:
        arm: the arm.
        role: the object.
        cabinet_role: the cabinet.
        aside: where along the base's left direction, m; None for where the object is now.
    """
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    front, shelf = cabinet.opening()
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
    wanted = arm.aside(thing.centre) if aside is None else aside
    to = float(np.clip(wanted, middle - room, middle + room))
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), to))


def put_on_shelf(arm: Arm, role: str, cabinet_role: str) -> Motion:
    """Push a held object in over the shelf, lower it, let go, and draw back."""
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    front, shelf = cabinet.opening()
    hand = arm.hand(SHELF_PITCH)
    before = arm.floor_point(front - SHELF_STAND, arm.aside(arm.base))
    yield from arm.drive(
        before, until=lambda: thing.extent_ahead()[0] > front + SHELF_DEPTH, speed=0.5
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


def place_in_cabinet_beside(arm: Arm, role: str, cabinet_role: str, other_role: str) -> Motion:
    """Put a held object on the lowest shelf of an open cabinet, beside another object in it."""
    pose, half = Furniture(arm, cabinet_role).interior()
    other = Thing(arm, other_role)
    others = [Thing(arm, body.entity) for body in arm.scene.bodies]
    standing = [thing for thing in others if thing.entity != Thing(arm, role).entity]
    places = [arm.aside(other.centre) + side * NEXT for side in (-1.0, 1.0)]
    middle, room = arm.aside(pose), half[0] - 0.2

    def free(aside: float) -> float:
        """How far it is there from what stands on the shelf, and from its ends, m."""
        gaps = [
            abs(aside - arm.aside(thing.centre))
            for thing in standing
            if abs(thing.bottom - (pose[2] - half[2])) < 0.05
        ]
        return min((*gaps, 0.0 if abs(aside - middle) > room else NEXT))

    yield from carry_to_shelf(arm, role, cabinet_role, max(places, key=free))
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
    roll = narrow_roll(arm, thing)
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
