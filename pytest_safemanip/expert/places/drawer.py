"""Taking something out of an open drawer."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.grasping import lift, narrow_roll
from pytest_safemanip.expert.motions.joints import move_joint
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, cut, raised
from pytest_safemanip.expert.robot.hand import FINGERTIP, GAP, OPENING
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.hand_room import fingers_meet, free_of_others
from pytest_safemanip.expert.world.standing import rearmost
from pytest_safemanip.expert.world.things import Furniture, Thing

STAND = 0.50
OVER_DRAWER = 1.05
"""Height of the hand before it goes down into a drawer, m: over the counter's edge above it."""
SLIPPED = 0.045
"""Height above its place in a drawer at which a hand draws near, m: the fingertips pass above what
is 4 cm thick."""
LOW_THING = 0.020
"""Things lower than this are pinched by fingers of one height: a tipped hand's lower one, 4 cm off
the middle, would poke the floor."""
PALM_HALF = (0.100, 0.035)
"""Half the palm's length, along the fingers' travel, and half its thickness, m."""
PASSING = 0.005
"""Kept free between the palm and what it passes on its way down, m."""
BESIDE_DRAWER = 0.25
"""From the side of a drawer to the middle of a base beside it, m."""
CLEARANCE = 0.27
"""Base to the front of an open drawer, m: its column, and the handle."""
FINGER_BESIDE = 0.018
"""Kept free between a finger and a thing that it goes down beside, m: pushed farther by one finger
before the other one meets it, a stick would roll."""
SLANTED = 0.3
"""Sine of the angle from which a low thing lies slanted: its ends are at different depths then."""
OFF_LOW_END = 0.085
"""From the end of a low thing to where it is pinched at least, m, if it is that long: as much of a
straw can stand in a glass, below the hand."""
ROUND = 0.03
"""How much wider than a thing the fingers are opened to go down around it, m."""
TILTS = ((-0.11, -0.07, -0.05, 0.0, 0.02, 0.08), (-15, -10, 0, 0, 8, 18))
"""From the middle of a drawer to what lies in it, m, and how far a hand is tipped there whose palm
stays off the drawer's front and the counter, degrees."""
LEAN = 20.0
"""Degrees that the hand is tipped where something lies near a drawer's back wall: the palm is drawn
off the wall, and its far end raised."""
LEAN_SHIFT = 0.012
"""How much nearer to the robot the hand then goes down, its farther finger close to the thing, and
how much wider the fingers are, m."""
LEAN_RISE = 0.007
"""How much higher it stays, m: the nearer finger is the lower one."""
CLOSED_TO = 0.006
"""How much wider than the thing its fingers then are before they come down the rest, m."""
LEANT = 0.086
"""From the grip point to the far end of the palm of that hand, m."""


def grasp_in_drawer(arm: Arm, role: str, drawer_role: str) -> Motion:
    """Pinch an object in an open drawer from above, across its narrow side, and lift it out.

    Raises:
        SkillFailed: if it is too wide, out of reach, too near to something, or was not lifted.
    """
    yield from grasp_thing_in_drawer(arm, Thing(arm, role), Furniture(arm, drawer_role))


def grasp_thing_in_drawer(
    arm: Arm, thing: Thing, drawer: Furniture, slip: float = 0.0, thick: float | None = None
) -> Motion:
    """Pinch a thing in an open drawer from above, across its narrow side, and lift it out.

    Args:
        arm: the arm.
        thing: what is picked.
        drawer: where it lies.
        slip: how far behind it the hand comes down, before it draws near above it, m.
        thick: how thick it is where it is pinched, m; as its narrow side if not given.

    Raises:
        SkillFailed: if it is too wide, out of reach, too near to something, or was not lifted.
    """
    roll = narrow_roll(arm, thing)
    low = thing.height < LOW_THING
    width = OPENING if low else min(OPENING, (thick or thing.sides()[0][1]) + ROUND)
    off = np.zeros(3) if low else free_of_others(arm, thing, width)
    room = _before_wall(arm, thing.com + off, drawer)
    leaning = not low and room < _half_palm(arm, roll)
    if leaning:
        off -= arm.onward(LEAN_SHIFT)
        width += LEAN_SHIFT
        if room + LEAN_SHIFT < LEANT or width > OPENING:
            raise SkillFailed("it lies too near to the drawer's back")
    deep = _short_by(arm, thing, drawer, roll, off) > 0.0
    if deep:
        yield from _step_aside(arm, drawer)
        # What lies in a drawer lags behind when it is pulled, and slides deeper.
        yield from move_joint(
            arm,
            drawer,
            drawer.doors()[0],
            2.0,
            until=lambda: _short_by(arm, thing, drawer, roll, off) <= 0.0,
        )
        if _short_by(arm, thing, drawer, roll, off) > PASSING:
            raise SkillFailed("it lies too far back in the drawer")
    pose, _ = drawer.interior()
    where = _short_of_rail(arm, thing, drawer, roll) if low else thing.com + off
    straight = low or deep
    pitch = 0.0 if straight else _drawer_pitch(arm.ahead(where) - arm.ahead(pose))
    hand = arm.hand(LEAN if leaning else pitch, roll)
    yield from _stand_at(arm, drawer, where)
    yield from arm.open_to(1.0)
    yield from arm.open_to(width / OPENING)
    target = np.append(where[:2], thing.bottom + FINGERTIP + (LEAN_RISE if leaning else 0.0))
    yield from _go_down(arm, thing, target, hand, slip)
    if leaning:
        # The more the fingers close, the higher the lower one is.
        yield from arm.open_to(((thick or thing.sides()[0][1]) + CLOSED_TO) / OPENING)
        lower = np.append(arm.position[:2], thing.bottom + FINGERTIP)
        yield from arm.move(lower, hand, tolerance=0.002, speed=0.2, steps=15, required=False)
    yield from lift(arm, thing, hand, 0.08)
    yield from arm.move(
        np.append(arm.position[:2], 1.10), arm.hand(0.0, roll), tolerance=0.03, speed=0.6, steps=60
    )


def _stand_at(arm: Arm, drawer: Furniture, where: Array) -> Motion:
    """Drive round an open drawer to where the hand reaches a place (3,) in it."""
    pose, half = drawer.interior()
    near = min(arm.ahead(where) - STAND, arm.ahead(pose) - float(half[1]) - CLEARANCE)
    rise = OVER_DRAWER - arm.position[2]
    if rise > 0.0:
        yield from arm.move(raised(arm.position, rise), tolerance=0.03, steps=60)
    yield from _step_aside(arm, drawer)
    yield from arm.drive(arm.floor_point(near - 0.08, arm.aside(arm.base)))
    yield from arm.drive(arm.floor_point(near - 0.08, arm.aside(where)))
    yield from arm.drive(arm.floor_point(near, arm.aside(where)))


def _go_down(arm: Arm, thing: Thing, target: Array, hand: Array, slip: float) -> Motion:
    """Come down to a grip point (3,) in a drawer, or behind it by so much, m, and then near.

    Raises:
        SkillFailed: if a finger stands on what lies beside.
    """
    behind = arm.onward(slip)
    over, before = np.append(target[:2], OVER_DRAWER) + behind, raised(target, 0.06) + behind
    yield from arm.move(over, hand, tolerance=0.02, turn_tolerance=0.08, steps=140)
    yield from arm.move(before, hand, tolerance=0.012, turn_tolerance=0.06, speed=0.7, steps=80)
    if slip:
        yield from arm.move(raised(target, SLIPPED), hand, tolerance=0.008, speed=0.3, steps=40)
    down = arm.move(
        target, hand, tolerance=0.005, turn_tolerance=0.06, speed=0.3, steps=40, required=False
    )
    yield from cut(down, lambda: fingers_meet(arm, thing))
    if fingers_meet(arm, thing):
        raise SkillFailed("what lies beside it leaves no room for the fingers")


def _step_aside(arm: Arm, drawer: Furniture) -> Motion:
    """Drive away from an open drawer sideways: the base may stand so close that its column touches
    it. In front of it, that is to the nearer side if nothing stands behind the base there.
    """
    pose, half = drawer.interior()
    middle, here = arm.aside(pose), arm.aside(arm.base)
    side, room = math.copysign(1.0, here - middle), float(half[0]) + BESIDE_DRAWER

    def blocked(way: float) -> bool:
        right, left = sorted((here, middle + way * room))
        return arm.ahead(arm.base) < rearmost(arm, right, left)

    if abs(here - middle) < half[0] and blocked(side) and not blocked(-side):
        side, here = -side, middle
    clear = middle + side * max(abs(here - middle), room)
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), clear))


def _short_of_rail(arm: Arm, thing: Thing, drawer: Furniture, roll: float) -> Array:
    """Where a low thing is pinched (3,): in its middle, or as much nearer to its end, or beside
    it if it lies across, as the palm needs to pass the front of what the drawer is in.
    """
    along, beside = _nearer(arm, thing, _hidden(arm, thing.com, drawer, roll))
    back = arm.onward(beside)
    return np.asarray(thing.com - along - back, np.float64)


def _short_by(arm: Arm, thing: Thing, drawer: Furniture, roll: float, off: Array) -> float:
    """How much nearer a thing would have to lie to be pinched there, or, if it is low, near its
    end or beside it, m.
    """
    deep = _hidden(arm, thing.com + off, drawer, roll)
    if thing.height >= LOW_THING:
        return deep
    along, beside = _nearer(arm, thing, deep)
    return deep - abs(float(along[:2] @ arm.forward)) - beside


def _nearer(arm: Arm, thing: Thing, deep: float) -> tuple[Array, float]:
    """How far from its middle along a low thing (3,), and how far beside it, m, it is pinched to
    be so much nearer to the robot, m, or by as much as there is.
    """
    (_, width), (axis, length) = thing.sides()
    slope = float(axis[:2] @ arm.forward)
    if abs(slope) > SLANTED:
        along = float(np.clip(deep / abs(slope), 0.0, max(0.0, length / 2.0 - OFF_LOW_END)))
        return np.asarray(math.copysign(along, slope) * axis, np.float64), 0.0
    return np.zeros(3), float(np.clip(deep, 0.0, (GAP - width) / 2.0 - FINGER_BESIDE))


def _hidden(arm: Arm, where: Array, drawer: Furniture, roll: float) -> float:
    """How much nearer a place (3,) would have to be for the palm, straight above it, to pass the
    front of what the drawer is in, m.
    """
    rail = min(arm.ahead(end) for end in drawer.extent())
    return arm.ahead(where) + _half_palm(arm, roll) - rail


def _before_wall(arm: Arm, where: Array, drawer: Furniture) -> float:
    """How far a place (3,) is from the back wall of a drawer, m."""
    pose, half = drawer.interior()
    return arm.ahead(pose) + float(half[1]) - arm.ahead(where)


def _half_palm(arm: Arm, roll: float) -> float:
    """What the palm of a hand that points down needs ahead of it, m."""
    palm = PALM_HALF @ np.abs(arm.forward @ arm.hand(0.0, roll)[:2, :2])
    return float(palm) + PASSING


def _drawer_pitch(ahead: float) -> float:
    """Tilt of the hand, in degrees, that keeps the palm off the drawer's front and the counter.

    Args:
        ahead: where the object lies, relative to the middle of the drawer, m.
    """
    return float(np.interp(ahead, *TILTS))
