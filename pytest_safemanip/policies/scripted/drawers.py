"""Taking something out of an open drawer."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.policies.scripted.grasping import FINGERTIP, GAP, lift, narrow_roll
from pytest_safemanip.policies.scripted.opening import pull_out
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.things import Furniture, Thing

STAND = 0.50
ABOVE = 1.05
"""Height of the hand before it goes down into a drawer, m: over the counter's edge above it."""
SLIPPED = 0.045
"""Height above its place in a drawer at which a hand draws near, m: the fingertips pass above what
is 4 cm thick."""
LOW = 0.020
"""Things lower than this are pinched by fingers of one height: a tipped hand's lower one, 4 cm off
the middle, would poke the floor."""
PALM = (0.100, 0.035)
"""Half the palm's length, along the fingers' travel, and half its thickness, m."""
PASSING = 0.005
"""Kept free between the palm and what it passes on its way down, m."""
BESIDE_DRAWER = 0.25
"""From the side of a drawer to the middle of a base beside it, m."""
CLEARANCE = 0.27
"""Base to the front of an open drawer, m: its column, and the handle."""
BESIDE = 0.018
"""Kept free between a finger and a thing that it goes down beside, m: pushed farther by one finger
before the other one meets it, a stick would roll."""
SLANTED = 0.3
"""Sine of the angle from which a low thing lies slanted: its ends are at different depths then."""
END = 0.045
"""From the end of a low thing to where it is pinched at least, m."""


def pick_from_drawer(arm: Arm, role: str, drawer_role: str) -> Motion:
    """Pinch an object in an open drawer from above, across its narrow side, and lift it out.

    Raises:
        SkillFailed: if it is too wide, out of reach, or was not lifted.
    """
    yield from pinch_in_drawer(arm, Thing(arm, role), Furniture(arm, drawer_role))


def pinch_in_drawer(arm: Arm, thing: Thing, drawer: Furniture, slip: float = 0.0) -> Motion:
    """Pinch a thing in an open drawer from above, across its narrow side, and lift it out.

    Args:
        arm: the arm.
        thing: what is picked.
        drawer: where it lies.
        slip: how far behind it the hand comes down, before it draws near above it, m.

    Raises:
        SkillFailed: if it is too wide, out of reach, or was not lifted.
    """
    roll = narrow_roll(arm, thing)
    low = thing.height < LOW
    missing = 0.0 if low else _hidden(arm, thing, drawer, roll)
    if missing > 0.0:
        joint = drawer.doors()[0]
        yield from _step_aside(arm, drawer)
        yield from pull_out(arm, drawer, drawer.openness(joint) + missing / joint.travel)
    pose, half = drawer.interior()
    front = arm.ahead(pose) - half[1]
    where = _short_of_rail(arm, thing, drawer, roll) if low else thing.com
    straight = low or missing > 0.0
    hand = arm.hand(0.0 if straight else _drawer_pitch(arm.ahead(where) - arm.ahead(pose)), roll)
    near = min(arm.ahead(where) - STAND, front - CLEARANCE)
    rise = ABOVE - arm.position[2]
    if rise > 0.0:
        yield from arm.move(raised(arm.position, rise), tolerance=0.03, steps=60)
    yield from _step_aside(arm, drawer)
    yield from arm.drive(arm.floor_point(near - 0.08, arm.aside(arm.base)))
    yield from arm.drive(arm.floor_point(near - 0.08, arm.aside(where)))
    yield from arm.drive(arm.floor_point(near, arm.aside(where)))
    yield from arm.open_to(1.0 if low else 0.8)
    target = np.append(where[:2], thing.bottom + FINGERTIP)
    behind = np.append(slip * arm.forward, 0.0)
    over, before = np.append(where[:2], ABOVE) + behind, raised(target, 0.06) + behind
    yield from arm.move(over, hand, tolerance=0.02, turn_tolerance=0.08, steps=140)
    yield from arm.move(before, hand, tolerance=0.012, turn_tolerance=0.06, speed=0.7, steps=80)
    if slip:
        yield from arm.move(raised(target, SLIPPED), hand, tolerance=0.008, speed=0.3, steps=40)
    yield from arm.move(
        target, hand, tolerance=0.005, turn_tolerance=0.06, speed=0.3, steps=40, required=False
    )
    yield from lift(arm, thing, hand, 0.08)
    yield from arm.move(
        np.append(arm.position[:2], 1.10), arm.hand(0.0, roll), tolerance=0.03, speed=0.6, steps=60
    )


def _step_aside(arm: Arm, drawer: Furniture) -> Motion:
    """Drive away from an open drawer sideways: the base may stand so close that its column touches
    it.
    """
    pose, half = drawer.interior()
    off = arm.aside(arm.base) - arm.aside(pose)
    clear = math.copysign(max(abs(off), half[0] + BESIDE_DRAWER), off)
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), arm.aside(pose) + clear))


def _short_of_rail(arm: Arm, thing: Thing, drawer: Furniture, roll: float) -> Array:
    """Where a low thing is pinched (3,): in its middle, or as much nearer to its end, or beside
    it if it lies across, as the palm needs to pass the front of what the drawer is in.

    Raises:
        SkillFailed: if it lies too far back.
    """
    deep = _hidden(arm, thing, drawer, roll)
    (_, width), (axis, length) = thing.sides()
    slope = float(axis[:2] @ arm.forward)
    along = beside = 0.0
    if abs(slope) > SLANTED:
        along = float(np.clip(deep / abs(slope), 0.0, length / 2.0 - END))
    else:
        beside = float(np.clip(deep, 0.0, (GAP - width) / 2.0 - BESIDE))
    if along * abs(slope) + beside < deep - PASSING:
        raise SkillFailed("it lies too far back in the drawer")
    back = np.append(beside * arm.forward, 0.0)
    return np.asarray(thing.com - math.copysign(along, slope) * axis - back, np.float64)


def _hidden(arm: Arm, thing: Thing, drawer: Furniture, roll: float) -> float:
    """How much nearer a thing would have to lie for the palm, straight above it, to pass the front
    of what the drawer is in, m.
    """
    rail = min(arm.ahead(end) for end in drawer.extent())
    palm = PALM @ np.abs(arm.forward @ arm.hand(0.0, roll)[:2, :2])
    return arm.ahead(thing.com) + float(palm) + PASSING - rail


def _drawer_pitch(ahead: float) -> float:
    """Tilt of the hand, in degrees, that keeps the palm off the drawer's front and the counter.

    Args:
        ahead: where the object lies, relative to the middle of the drawer, m.
    """
    return float(np.interp(ahead, (-0.11, -0.07, -0.05, 0.0, 0.02, 0.08), (-15, -10, 0, 0, 8, 18)))
