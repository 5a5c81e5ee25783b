"""What faults on a counter below a cabinet have in common: where things stand at the beginning, and
motions with an object in the hand.
"""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.faults.handling import take
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.sim.staging import Put

BELOW = -0.56
"""Top of the counter, seen from the floor of a cabinet's interior, m."""
UPRIGHT = ("can", "candle", "canned_food", "jam", "yogurt")
"""Stand on flat ground, do not roll, and fit between the fingers on all sides."""
ROUND = ("apple", "onion", "orange", "peach", "tangerine", "tomato")
"""Balls."""
BLOCKS = ("butter_stick", "cake", "cheese", "tofu")
"""Lie flat, at most 6 cm high: something can stand on them, and a palm passes above."""
JUST_ABOVE = 0.003
"""How far above a surface an object is let go when it is put down, m."""
HELD_BACK = 0.08
"""How far the open hand draws back from what it let go, m."""


def on_counter(
    role: str, ahead: float, aside: float = 0.0, turn: tuple[float, float] = (0.0, 0.0)
) -> Put:
    """An object on the counter.

    Args:
        role: the object.
        ahead: from the middle of the cabinet above, along the base's forward direction, m.
        aside: likewise along its left direction, m.
        turn: see :class:`~pytest_safemanip.sim.staging.Put`.
    """
    return Put(role, "in", "cab", (ahead, aside, BELOW), turn)


def way_to(arm: Arm, thing: Thing, ahead: float, aside: float, bottom: float) -> Array:
    """From where an object is to where its centre of mass has these coordinates (3,).

    Args:
        arm: the arm.
        thing: the object.
        ahead: along the base's forward direction, m.
        aside: along its left direction, m.
        bottom: height of its lowest corner, m.
    """
    here = thing.com
    return arm.point(ahead - arm.ahead(here), aside - arm.aside(here), bottom - thing.bottom)


def bring(
    arm: Arm,
    thing: Thing,
    ahead: float,
    aside: float,
    bottom: float,
    *,
    speed: float = 0.6,
    steps: int = 70,
) -> Motion:
    """Bring a held object to where :func:`way_to` says; the hand keeps its orientation."""
    yield from arm.move(
        lambda: arm.position + way_to(arm, thing, ahead, aside, bottom),
        tolerance=0.006,
        turn_tolerance=0.2,
        speed=speed,
        steps=steps,
        required=False,
    )


def let_go(arm: Arm) -> Motion:
    """Open the fingers and draw back."""
    yield from arm.grip(False, 8)
    yield from draw_back(arm)


def put_back(arm: Arm, role: str, *, speed: float = 0.3) -> Motion:
    """Take hold of an object and put it down where it stood.

    Args:
        arm: the arm.
        role: the object.
        speed: on the way down, as a share of the top speed.

    Raises:
        SkillFailed: if there is no way to take hold of it.
    """
    thing = Thing(arm, role)
    ahead, aside, bottom = arm.ahead(thing.com), arm.aside(thing.com), thing.bottom
    yield from take(arm, role)
    yield from bring(arm, thing, ahead, aside, bottom + JUST_ABOVE, speed=speed)
    yield from let_go(arm)


def draw_back(arm: Arm) -> Motion:
    """Draw the hand back the way it came."""
    yield from arm.move(
        arm.position - HELD_BACK * arm.rotation[:, 2],
        tolerance=0.03,
        speed=0.5,
        steps=25,
        required=False,
    )


def apart(arm: Arm, thing: Thing) -> float:
    """Distance of the grip point from the centre of an object, m."""
    return float(np.linalg.norm(arm.position - thing.centre))
