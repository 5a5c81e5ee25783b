"""Carrying something to another counter, around what stands on the floor."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion
from pytest_safemanip.policies.scripted.grasping import reach
from pytest_safemanip.policies.scripted.rotations import Array, about_y, about_z
from pytest_safemanip.policies.scripted.routes import route
from pytest_safemanip.policies.scripted.things import Thing

OFF = 0.40
"""How far the base draws back before a load is tucked in, m: off what stands on the counter."""
TUCKED = 0.42
"""Base to hand on the way, m: as close as the wrist allows."""
ABOVE = 1.08
"""Height of a load's lowest point on the way, m: 16 cm above counters, over what stands on them."""
BEND = 0.12
"""How far a stretched arm is first drawn in, m."""
PITCH = 20.0
"""Degrees from straight down that the hand is pitched on the way: straight down, the wrist reaches
its limit so close to the base."""
BALANCE_PITCH, BALANCE_HEIGHT, BALANCE_TUCKED = 70.0, 1.30, 0.46
"""Likewise, and height of the hand and base to hand, m, where one finger is below what is held."""
SHORT = 0.35
"""How far before its last place the way ends, m: room to raise and to tip a load."""
SPEED = 0.6
"""Share of the base's top speed at which a load hardly swings where it starts and stops."""
LONG = 400
"""Control steps for a stretch across the room."""
NOTCH = 4.0
"""Degrees by which the hand is tipped at a time with something heavy, which swings otherwise."""


def carry_to(arm: Arm, role: str, target_role: str, gently: bool = False) -> Motion:
    """Bring a held object before another one that stands elsewhere, on an island say.

    The robot keeps facing as it does, its base moves sideways too: both a counter on the wall and
    the stools' side of an island, where things to dine with stand, are used facing the wall.

    Args:
        arm: the arm.
        role: the held object.
        target_role: the other one.
        gently: whether the hand is tipped bit by bit.

    Raises:
        SkillFailed: if the base finds no way there.
    """
    yield from draw_in(arm)
    for pitch in np.arange(arm.pitch, PITCH, -NOTCH).tolist() if gently else ():
        tipped = pitched(arm, pitch)
        yield from arm.move(arm.position, tipped, tolerance=0.03, turn_tolerance=0.03, steps=20)
    height = arm.position[2] + ABOVE - Thing(arm, role).bottom
    yield from tuck(arm, TUCKED, height, pitched(arm, PITCH))
    yield from travel(arm, role, target_role)


def balance_to(arm: Arm, role: str, target_role: str) -> Motion:
    """Bring something small before another thing that stands elsewhere, with one finger below it:
    between two fingers that are level a ball sinks by half a millimetre in a second, and in half a
    minute is past their tips.

    The hand rolls while it points down: on a level one, which is in line with the forearm, one
    joint or another does it, and may come to its end.

    Raises:
        SkillFailed: if the base finds no way there.
    """
    yield from draw_in(arm)
    upright, rolled = arm.hand(PITCH), arm.hand(PITCH, 90.0)
    for hand in (upright, rolled):
        yield from tuck(arm, TUCKED, BALANCE_HEIGHT, hand)
    yield from tuck(arm, BALANCE_TUCKED, BALANCE_HEIGHT, arm.hand(BALANCE_PITCH, 90.0))
    yield from travel(arm, role, target_role)
    for hand in (rolled, upright):
        yield from tuck(arm, TUCKED, BALANCE_HEIGHT, hand)


def draw_in(arm: Arm) -> Motion:
    """Draw the base back, and a stretched arm in."""
    yield from arm.drive(arm.base - OFF * arm.forward, speed=SPEED)
    # Upwards a little: a straight arm bends at once where it is not pulled along its own line.
    bent = arm.position + np.append(-BEND * arm.forward, 0.02)
    yield from arm.move(bent, tolerance=0.03, speed=0.5, steps=40, required=False)


def tuck(arm: Arm, ahead: float, height: float, hand: Array) -> Motion:
    """Hold the hand before the base.

    Args:
        arm: the arm.
        ahead: how far before it, m.
        height: above the floor, m.
        hand: orientation (3, 3).

    Raises:
        SkillFailed: if the hand does not get there.
    """
    tucked = arm.point(arm.ahead(arm.base) + ahead, arm.aside(arm.base), height)
    yield from arm.move(tucked, hand, tolerance=0.03, turn_tolerance=0.15, speed=0.6, steps=120)


def travel(arm: Arm, role: str, target_role: str) -> Motion:
    """Drive to where a tucked hand is before an object, around what stands on the floor."""
    thing, target = Thing(arm, role), Thing(arm, target_role)
    aside = arm.aside(target.middle)
    ahead = arm.ahead(target.middle) - reach(PITCH)
    goal = arm.floor_point(ahead - SHORT, aside)
    for place in route(arm, thing, goal):
        yield from arm.drive(place, speed=SPEED, steps=LONG)


def pitched(arm: Arm, pitch: float) -> Array:
    """The hand as it is, but pitched so far from straight down (3, 3)."""
    heading = about_z(math.degrees(math.atan2(arm.forward[1], arm.forward[0])))
    turned: Array = heading @ about_y(arm.pitch - pitch) @ heading.T @ arm.rotation
    return turned
