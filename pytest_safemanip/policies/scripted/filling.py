"""Two things beside each other in one bowl, each let go where it does not press on the other."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, raised
from pytest_safemanip.policies.scripted.facing import BACK, DRAWN, UP
from pytest_safemanip.policies.scripted.grasping import FINGERTIP, OPEN, fold
from pytest_safemanip.policies.scripted.putting import BRAKE, carry_over, held_over
from pytest_safemanip.policies.scripted.rims import WALL
from pytest_safemanip.policies.scripted.rotations import Array, about_z
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.policies.scripted.touching import touched

ROOM = 0.008
"""From what is let into a bowl to its wall, m: it hangs askew by some millimetres."""
ENDS = 0.004
"""Likewise for its ends, where it does not come to lie on the other thing, m: a bowl is not quite
round."""
ROUND = 0.002
"""What is longer than wide by less is round, m, and has no ends."""
TIPPED = 0.33
"""From a bowl's middle to that of something long that leans in it, share of the way to the wall:
farther, it comes to lie higher than the rim."""
OVER_RIM = 0.005
"""From a bowl's rim up to the fingertips that open over it, m: in it, they would jam."""
FALL = 0.045
"""Above a bowl's underside, m: nothing is let go higher."""
DEEP = 0.010
"""What is so much lower than fingers over the rim would need takes them down past the wall, m."""
FINGER_ROOM, APART = 0.026, 0.006
"""From what such fingers hold to the wall, m: a finger is 14 mm thick; how far either opens, m."""
DRAWN_HEIGHT, PITCH = 1.2, 20.0
"""Height of the hand before the base afterwards, m, and its pitch, degrees."""
NEAR = 0.003
"""That height is met so well, m."""
SLOWLY = 0.1
"""Share of the hand's top speed at which it is lowered."""
STEPS = 120
FURTHER, MORE = 0.010, 15
"""Where it stops above that, how much lower it is sent, m, and for how many control steps: so near
to where it is sent, friction in the joints stops the arm up to 5 mm off it."""
LEVEL = np.array((1.0, 1.0, 0.0))
"""Takes the vertical part off a direction."""


def fill_beside(arm: Arm, role: str, other_role: str, vessel_role: str) -> Motion:
    """Let something into a bowl, on one side of its middle: another thing has room on the other
    side, or lies there. The first is turned to lie as the other one is going to.

    Raises:
        SkillFailed: if the hand or the base does not get there.
    """
    thing, other, vessel = Thing(arm, role), Thing(arm, other_role), Thing(arm, vessel_role)
    away = float(np.linalg.norm((other.centre - vessel.middle)[:2]))
    if away < inner_radius(vessel):
        spot = beside_other(thing, other, vessel)
    else:
        turn = fold(heading(other.sides()[0][0]) - heading(thing.sides()[0][0]), 90.0)
        turned = about_z(turn) @ arm.rotation
        up = raised(arm.position, UP)
        yield from arm.move(up, turned, tolerance=0.05, speed=0.6, steps=60, required=False)
        spot = on_far_side(arm, thing, other, vessel)
    yield from carry_over(arm, role, spot, vessel.highest + BRAKE)
    over = held_over(arm, thing, spot, thing.bottom)
    yield from arm.move(over, tolerance=NEAR, speed=0.3, steps=40, required=False, exact=True)
    yield from let_down(arm, thing, spot, vessel)
    yield from arm.move(raised(arm.position, UP), tolerance=0.03, speed=0.5, steps=60)
    yield from arm.drive(arm.base - BACK * arm.forward)
    # Turned back over the next plate, the hand would swing down onto the counter.
    drawn = arm.point(arm.ahead(arm.base) + DRAWN, arm.aside(arm.base), DRAWN_HEIGHT)
    yield from arm.move(
        drawn, arm.hand(PITCH), tolerance=0.05, turn_tolerance=0.2, speed=0.5, required=False
    )


def let_down(arm: Arm, thing: Thing, spot: Array, vessel: Thing) -> Motion:
    """Lower what is held over a spot (3,) in a bowl and let it go."""
    hanging = float(arm.position[2]) - thing.bottom
    tips = vessel.highest + FINGERTIP + OVER_RIM - hanging
    bottom = min(tips, vessel.bottom + FALL)
    low = tips - bottom > DEEP
    if low:
        spot = inwards(thing, spot, vessel)
        over = held_over(arm, thing, spot, thing.bottom)
        yield from arm.move(over, tolerance=NEAR, speed=0.3, steps=40, required=False, exact=True)
    for lower, steps in ((bottom, STEPS), (bottom - FURTHER, MORE)):
        yield from arm.move(
            held_over(arm, thing, spot, lower),
            speed=SLOWLY,
            steps=steps,
            until=lambda: touched(arm, thing) or thing.bottom < bottom + NEAR,
            required=False,
        )
    if low:
        yield from arm.open_to((thing.sides()[0][1] + 2.0 * APART) / OPEN)
        up = raised(arm.position, tips - bottom)
        yield from arm.move(up, tolerance=NEAR, speed=0.3, steps=40, required=False)
    yield from arm.grip(False)


def inwards(thing: Thing, spot: Array, vessel: Thing) -> Array:
    """As a spot (3,) in a round vessel, but no nearer to the wall than leaves room for a finger."""
    off = inner_radius(vessel) - FINGER_ROOM - thing.sides()[0][1] / 2.0
    away = float(np.linalg.norm((spot - vessel.middle) * LEVEL))
    share = 1.0 if away < off else off / away
    return np.asarray(spot - (1.0 - share) * (spot - vessel.middle) * LEVEL)


def on_far_side(arm: Arm, thing: Thing, other: Thing, vessel: Thing) -> Array:
    """Where the first of two things goes in an empty bowl, lying as the other one does (3,)."""
    radius, side = inner_radius(vessel), other.sides()[0][0] * LEVEL
    (_, width), (axis, length) = thing.sides()
    off, along = off_middle(radius, width, length, ENDS), 0.0
    if length > 2.0 * radius:
        off, along = leaning(radius, width, length)
    across = math.copysign(off, arm.ahead(side)) * side
    return np.asarray(vessel.middle + across + along * axis * LEVEL)


def beside_other(thing: Thing, other: Thing, vessel: Thing) -> Array:
    """Where the second of two things goes, on the side of a bowl away from the first (3,)."""
    radius, side = inner_radius(vessel), thing.sides()[0][0] * LEVEL
    (_, width), (_, length) = thing.sides()
    away = float((vessel.middle - other.centre) @ side)
    off = off_middle(radius, width, length, ENDS)
    if off - width / 2.0 < other.reach(side) - abs(away):
        off = off_middle(radius, width, length)
    return np.asarray(vessel.middle + math.copysign(off, away) * side)


def inner_radius(vessel: Thing) -> float:
    """Of a round vessel, its handle left out, m."""
    return vessel.sides()[0][1] / 2.0 - WALL


def off_middle(radius: float, width: float, length: float, ends: float = 0.0) -> float:
    """How far from a round vessel's middle something may lie that is so wide and long and whose
    ends keep so far from the wall, m.
    """
    long = length if length - width > ROUND else 0.0
    between = math.sqrt(max(0.0, (radius - ends) ** 2 - long**2 / 4.0))
    return max(0.0, min(radius - ROOM, between) - width / 2.0)


def leaning(radius: float, width: float, length: float) -> tuple[float, float]:
    """How far from the middle of a round vessel, across and along, something is let go that is
    longer than that is wide, m: level, it would lie on the rim; with one end just inside, its
    middle some way to the wall, it tips in and leans.
    """
    half = (length / 2.0 + ROOM) / (1.0 + TIPPED)
    across = math.sqrt(max(0.0, radius**2 - half**2)) - width / 2.0
    return max(0.0, across), TIPPED * half


def heading(way: Array) -> float:
    """Of a direction (3,), degrees about the vertical."""
    return math.degrees(math.atan2(way[1], way[0]))
