"""Emptying a pan: tipped to one side over what gets its food, held by its handle."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.motions.approaching import draw_back
from pytest_safemanip.expert.motions.placing import Spot, bring
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing, other_things
from pytest_safemanip.trace.geometry import about, matrix

OVER_FOOD = 0.03
"""From the food, once it lies on the receiver, to the pan above it, m."""
TURN_BACK_RISE = 0.08
"""How far the pan is raised before it is turned back, m: long food leans on its rim."""
SHORT = (0.04, 0.03, 0.05, 0.02)
"""How far to the left of the receiver's middle the pan's middle is, m: food slides off the edge
below it, and moves on to the right by 0 to 10 cm, what rolls the farthest."""
TILT = np.radians(155.0)
"""How far it is tipped: its wall then slopes by 65 degrees; things that rub with a coefficient of 1
begin to slide at 45."""
FALLING = 1.0
"""Until the food has left the pan, s."""
TIPPING = np.radians(1.5)
"""Turn per control step: 30 degrees in a second, and what rolls does not jump over the rim."""
BACK = 0.3
"""How far the base then draws back at least, m."""


def pour(
    arm: Arm,
    role: str,
    receiver_role: str,
    short: tuple[float, ...] = SHORT,
    tilt: float = TILT,
) -> Motion:
    """Tip a held pan over another vessel to the right, and turn it level again.

    Args:
        arm: the arm, holding the pan by its handle.
        role: the pan.
        receiver_role: what gets the food.
        short: how far to the left of the receiver's middle the pan's middle may be, m.
        tilt: how far it is tipped, rad.

    Raises:
        SkillFailed: if there is no way for it.
    """
    pan, receiver = Thing(arm, role), Thing(arm, receiver_role)
    height = receiver.highest + fill_height(arm, pan) + OVER_FOOD
    rim = pan.sides()[0][1] / 2.0 - pan.height / 2.0
    spots = [
        Spot(
            np.append(receiver.middle[:2] + off * arm.left, height + rim),
            0.1 * number,
            f"over {off}",
        )
        for number, off in enumerate(short)
    ]
    reach = yield from bring(arm, pan, lambda: spots)
    goal, hand = reach.pose.point, reach.pose.hand
    middle = goal + hand @ (arm.rotation.T @ (pan.middle - arm.position))

    yield from arm.move(goal, hand, tolerance=0.015, speed=0.5, steps=80)
    yield from turn(arm, hand, middle, goal, 0.0, tilt)
    tipped = arm.rotation
    yield from arm.wait(FALLING)
    up = np.array((0.0, 0.0, TURN_BACK_RISE))
    yield from arm.move(arm.position + up, tipped, speed=0.4, steps=30, required=False)
    yield from turn(arm, hand, middle + up, goal + up, tilt, 0.0)
    yield from draw_back(arm, reach, pan, BACK)


def fill_height(arm: Arm, pan: Thing) -> float:
    """How high what lies in a pan stands on a plate: long things lie down, m."""
    radius = pan.sides()[0][1] / 2.0
    inside = [
        o for o in other_things(arm, pan) if np.linalg.norm((o.centre - pan.middle)[:2]) < radius
    ]
    return max((min(o.sides()[1][1], o.height) for o in inside), default=0.0)


def turn(arm: Arm, hand: Array, middle: Array, point: Array, start: float, end: float) -> Motion:
    """Turn a held thing slowly about a line through its middle, along the base's forward direction.

    Args:
        arm: the arm.
        hand: its orientation where the turn is 0 (3, 3).
        middle: of the thing (3,).
        point: grip point where the turn is 0 (3,).
        start: first angle, rad; positive is to the right.
        end: last angle, rad.
    """
    ahead = np.append(arm.forward, 0.0)
    for angle in np.linspace(start, end, round(abs(end - start) / TIPPING)).tolist():
        turned = np.asarray(matrix(about(ahead, angle)))
        there = middle + turned @ (point - middle)
        yield from arm.move(there, turned @ hand, steps=1, until=lambda: False, required=False)
