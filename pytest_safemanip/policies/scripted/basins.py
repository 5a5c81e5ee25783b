"""Lowering a pan into a basin: from straight above, level, its handle to the right."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, raised
from pytest_safemanip.policies.scripted.handles import (
    FOLDED,
    OVER,
    STEADY,
    TUCKED,
    handle,
    level,
    pinch_handle,
)
from pytest_safemanip.policies.scripted.putting import held_over, set_down
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.things import Furniture, Thing

BACK = 0.35
"""How far the base draws back from a counter before a load is turned, m."""
ABOVE = 0.08
"""Free space below a load that is brought to a basin, m: over what lies on the counter."""
ROOM = 0.015
"""From a load to the end of a basin, m."""
BEFORE = 0.06
"""How far before the middle of a basin a pan is lowered, m: the hand stays off the spout."""
NEAR, FIRST_PITCH = 0.32, 18.0
"""Base to hand, m, and degrees from straight down, when nothing is held: from its first posture the
arm comes to a tap without touching the spout."""


def pick_by_handle_from_above(arm: Arm, role: str) -> Motion:
    """Pinch a vessel's handle where it leaves the vessel, the hand straight down: so it goes into a
    basin, and turns to all sides.

    Raises:
        SkillFailed: if it was not lifted.
    """
    yield from pinch_handle(arm, role, 0.0)


def place_in_basin(arm: Arm, role: str, sink_role: str) -> Motion:
    """Lower a vessel that is held by its handle into the right end of a basin, and draw back.

    Raises:
        SkillFailed: if the hand or the base does not get there.
    """
    thing, sink = Thing(arm, role), Furniture(arm, sink_role)
    pose, half = sink.interior()
    top, floor = float(pose[2] + half[2]), float(pose[2] - half[2])
    hand = level(arm, thing, np.append(-arm.left, 0.0))
    where = right_end(arm, thing, sink)
    yield from bring(arm, thing, hand, where)

    for height in (top, floor):
        over = held_over(arm, thing, where, height + OVER)
        yield from arm.move(over, hand, tolerance=0.01, speed=STEADY, steps=80)
    yield from set_down(arm, role)
    yield from arm.move(raised(arm.position, top - floor + ABOVE), tolerance=0.03, speed=STEADY)
    yield from arm.drive(arm.base - BACK * arm.forward)
    folded = arm.point(arm.ahead(arm.base) + NEAR, arm.aside(arm.base), FOLDED)
    yield from arm.move(folded, arm.hand(FIRST_PITCH), tolerance=0.05, turn_tolerance=0.3)


def right_end(arm: Arm, thing: Thing, sink: Furniture) -> Array:
    """Where the middle of a vessel goes whose handle points to the right, at the height of the
    basin's edge (3,).
    """
    pose, half = sink.interior()
    long = thing.reach(handle(thing)[1]) + float(np.linalg.norm((thing.centre - thing.middle)[:2]))
    aside = arm.aside(pose) - half[0] + ROOM + long
    return arm.point(arm.ahead(pose) - BEFORE, aside, float(pose[2] + half[2]))


def bring(arm: Arm, thing: Thing, hand: Array, where: Array) -> Motion:
    """Draw a held vessel back, turn it, and drive until it is over a point.

    Args:
        arm: the arm.
        thing: the vessel.
        hand: orientation of the hand at which the vessel is level (3, 3).
        where: the point, at the height of what it is carried over (3,).
    """
    yield from arm.drive(arm.base - BACK * arm.forward, speed=STEADY)
    base = arm.ahead(arm.base)
    rise = arm.position[2] + where[2] + ABOVE - thing.bottom
    away = arm.point(base + TUCKED, arm.aside(arm.base), rise)
    yield from arm.move(away, hand, tolerance=0.02, turn_tolerance=0.1, speed=STEADY, steps=160)
    for ahead in (base, base + arm.ahead(where) - arm.ahead(thing.middle)):
        shift = arm.aside(where) - arm.aside(thing.middle)
        yield from arm.drive(arm.floor_point(ahead, arm.aside(arm.base) + shift), speed=STEADY)
