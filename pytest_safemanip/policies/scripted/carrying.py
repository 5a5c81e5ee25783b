"""Carrying to a cabinet or a counter and putting down there."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, raised
from pytest_safemanip.policies.scripted.grasping import narrow_roll
from pytest_safemanip.policies.scripted.picking import FRONT_PITCH
from pytest_safemanip.policies.scripted.putting import set_down
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.standing import nearest
from pytest_safemanip.policies.scripted.things import Furniture, Thing, counter

CARRY_REACH = 0.50
"""Base to hand while a load is carried, m."""
SHELF_PITCH = 50.0
SHELF_STAND = 0.51
"""Base to the front of the shelf, m."""
SHELF_DEPTH = 0.06
"""Free space between the front of the shelf and the object, m."""
HANG_PITCH = 60.0
"""Likewise for what hangs 15 cm below the hand: less level, the arm does not reach so high."""
HANG_REACH = 0.46
"""Base to hand before the shelf then, m."""
HANG_OVER = 0.025
"""Free space below it, m."""
HANGS = 0.05
"""From the grip point down to the centre of mass of what swings in the fingers, m."""
GENTLY = 0.4
"""Speed, of base and hand, at which it hardly swings."""
FROM_SIDE = 0.20
"""From the side of a cabinet to the middle of the base, m."""
BEFORE, HEIGHT = 0.46, 1.25
"""Where the hand comes down to from a shelf, before the base and above the floor, m: from between
the doors, it would not get straight to what stands below them."""
BESIDE = 0.40
"""From the side of a drawer to where something is put down beside it, m."""


def hangs(arm: Arm, thing: Thing) -> bool:
    """Whether a held object is gripped so far above its centre of mass that it swings."""
    return bool(arm.position[2] - thing.com[2] > HANGS)


def carry_to_shelf(
    arm: Arm,
    role: str,
    cabinet_role: str,
    aside: float | None = None,
    from_side: float = FROM_SIDE,
) -> Motion:
    """Bring a held object in front of an open cabinet, a little above its lowest shelf.

    Args:
        arm: the arm.
        role: the object.
        cabinet_role: the cabinet.
        aside: where along the base's left direction, m; None for where the object is now.
        from_side: how far from the cabinet's side the base stays, m.
    """
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    front, shelf = cabinet.opening()
    pose, half = cabinet.interior()
    hanging = hangs(arm, thing)
    fast, faster = (GENTLY, GENTLY) if hanging else (0.7, 1.0)
    pitch, over = (HANG_PITCH, HANG_OVER) if hanging else (SHELF_PITCH, 0.05)
    clear = max(0.12, thing.extent_ahead()[1] - (front - 0.10))
    yield from arm.drive(arm.base - clear * arm.forward, speed=fast)
    reach = min(arm.ahead(arm.position) - arm.ahead(arm.base), CARRY_REACH + 0.02)
    turning = arm.hand(HANG_PITCH if hanging else (FRONT_PITCH + SHELF_PITCH) / 2.0)
    yield from arm.move(
        arm.point(arm.ahead(arm.base) + reach, arm.aside(arm.position), 1.30),
        turning,
        tolerance=0.05,
        turn_tolerance=0.3,
        speed=faster,
        steps=140,
    )

    def before_shelf() -> Array:
        height = arm.position[2] + shelf + over - thing.bottom
        return arm.point(arm.ahead(arm.base) + before, arm.aside(arm.base), height)

    hand, before = arm.hand(pitch), HANG_REACH if hanging else CARRY_REACH
    yield from arm.move(
        before_shelf, hand, tolerance=0.03, turn_tolerance=0.15, speed=faster, steps=120
    )
    middle, room = arm.aside(pose), half[0] - from_side
    wanted = arm.aside(thing.centre) if aside is None else aside
    to = float(np.clip(wanted, middle - room, middle + room))
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), to), speed=fast)


def put_on_shelf(arm: Arm, role: str, cabinet_role: str, depth: float = SHELF_DEPTH) -> Motion:
    """Push a held object in over the shelf, lower it, let go, and draw back.

    Args:
        arm: the arm.
        role: the object.
        cabinet_role: the cabinet.
        depth: free space between the front of the shelf and the object there, m.
    """
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    front, shelf = cabinet.opening()
    hanging, aside = hangs(arm, thing), arm.aside(arm.base)
    hand = arm.hand(HANG_PITCH if hanging else SHELF_PITCH)
    closest = nearest(arm, aside, aside) if hanging else front - SHELF_STAND
    yield from arm.drive(
        arm.floor_point(closest, aside),
        until=lambda: thing.extent_ahead()[0] > front + depth,
        speed=GENTLY if hanging else 0.5,
    )

    def over_shelf() -> Array:
        way = front + depth - thing.extent_ahead()[0]
        rise = shelf + (HANG_OVER if hanging else 0.03) - thing.bottom
        return np.add(arm.position, (*(way * arm.forward), rise))

    yield from arm.move(
        over_shelf,
        hand,
        tolerance=0.02,
        turn_tolerance=0.2,
        speed=GENTLY if hanging else 0.6,
        steps=60,
        required=False,
    )
    if hanging:
        yield from set_down(arm, role)
    else:
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


def come_down(arm: Arm) -> Motion:
    """Bring an empty hand down from between a cabinet's doors, in front of the counter."""
    low = arm.point(arm.ahead(arm.base) + BEFORE, arm.aside(arm.base), HEIGHT)
    yield from arm.move(low, arm.hand(FRONT_PITCH), tolerance=0.05, turn_tolerance=0.3)


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
