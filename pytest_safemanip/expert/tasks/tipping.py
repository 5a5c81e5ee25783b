"""Emptying a pan: tipped to one side over what gets its food, held by its handle."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.motions.handles import STEADY, level
from pytest_safemanip.expert.places.basin import bring_level
from pytest_safemanip.expert.robot.arm import Arm, Motion, Target
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing, other_things
from pytest_safemanip.trace.geometry import about, matrix

PAN_OVER_FOOD = 0.03
"""From the food, once it lies on the receiver, to the pan above it, m."""
TURN_BACK_RISE = 0.08
"""How far the pan is raised before it is turned back, m: long food leans on its rim."""
LEFT_OF_MIDDLE = 0.04
"""How far to the left of the receiver's middle the pan's middle is, m: food slides off the edge
below it, and moves on to the right by 0 to 10 cm, what rolls the farthest."""
TILT = np.radians(155.0)
"""How far it is tipped: its wall then slopes by 65 degrees; things that rub with a coefficient of 1
begin to slide at 45."""
FALLING = 1.0
"""Until the food has left the pan, s."""
TIPPING = np.radians(1.5)
"""Turn per control step: 30 degrees in a second, and what rolls does not jump over the rim."""


def pour(
    arm: Arm, role: str, receiver_role: str, short: float = LEFT_OF_MIDDLE, tilt: float = TILT
) -> Motion:
    """Tip a held pan over another vessel to the right, and turn it level again.

    Args:
        arm: the arm, holding the pan by its handle.
        role: the pan.
        receiver_role: what gets the food.
        short: how far to the left of the receiver's middle the pan's middle is, m.
        tilt: how far it is tipped, rad.

    Raises:
        SkillFailed: if the hand or the base does not get there.
    """
    pan, receiver = Thing(arm, role), Thing(arm, receiver_role)
    radius = pan.sides()[0][1] / 2.0
    towards = np.append(-arm.forward, 0.0)
    spot = np.append((receiver.middle[:2] + short * arm.left), receiver.highest)
    yield from bring_level(arm, pan, level(arm, pan, towards), spot)
    hand = level(arm, pan, towards)
    height = receiver.highest + fill_height(arm, pan) + PAN_OVER_FOOD + radius

    def over() -> Array:
        way = np.append((spot - pan.middle)[:2], height - pan.middle[2])
        return np.add(arm.position, way)

    yield from arm.move(over, hand, tolerance=0.015, speed=STEADY, steps=80)
    yield from turn(arm, hand, over, 0.0, tilt)
    tipped = arm.rotation
    yield from arm.wait(FALLING)
    height += TURN_BACK_RISE
    yield from arm.move(over, tipped, speed=0.4, steps=30, required=False)
    yield from turn(arm, hand, over, tilt, 0.0)


def fill_height(arm: Arm, pan: Thing) -> float:
    """How high what lies in a pan stands on a plate: long things lie down, m."""
    radius = pan.sides()[0][1] / 2.0
    inside = [
        o for o in other_things(arm, pan) if np.linalg.norm((o.centre - pan.middle)[:2]) < radius
    ]
    return max((min(o.sides()[1][1], o.height) for o in inside), default=0.0)


def turn(arm: Arm, hand: Array, there: Target, start: float, end: float) -> Motion:
    """Turn a held thing about the base's forward direction, slowly.

    Args:
        arm: the arm.
        hand: its orientation where the turn is 0 (3, 3).
        there: where the hand is meanwhile.
        start: first angle, rad; positive is to the right.
        end: last angle, rad.
    """
    ahead = np.append(arm.forward, 0.0)
    for angle in np.linspace(start, end, round(abs(end - start) / TIPPING)).tolist():
        turned = matrix(about(ahead, angle)) @ hand
        yield from arm.move(there, turned, steps=1, until=lambda: False, required=False)
