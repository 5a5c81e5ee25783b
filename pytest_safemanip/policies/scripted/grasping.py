"""Grasps from above, across the narrow side of a solid thing."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.policies.scripted.rotations import Array, about_z
from pytest_safemanip.policies.scripted.things import Thing

GAP = 0.076
"""Widest side that fits between the fingers, m."""
LIFTED = 0.02
"""Rise that shows that an object is held, m; the hand itself rises by 3 cm at least."""
FINGERTIP = 0.012
"""Grip point above a surface at which the fingertips do not touch it, m."""
FINGER = 0.022
"""How far below an object's top the grip point goes, m: the palm stays clear of it."""

ALIKE = 0.012
"""Two sides that differ by less are alike to the hand, m."""
SNUG = 0.008
"""By how much less than the gap a side may be that is gripped for the fingers to be level, m: with
a side of 6 cm between them, fingers that are not would come down on the top of something high."""
MOST_YAW = 50.0
"""Degrees to either side that the hand turns with level fingers; beyond, it rolls."""
MOST_ROLLED = 20.0
"""Pitch at which rolled fingers, which are not level, still reach under a thing, degrees."""
FINGER_SIDE, OPEN = 0.010, 0.08
"""Half a finger's width, and between the fingers where they are open, m: tipped, the lower side of
level fingers, or the lower one of two that are not, is what meets a surface first."""
PADS = 0.006
"""Least depth of the grip point below an object's top, m."""
PALM = 0.026
"""From the grip point to the palm, m."""
HAND = (0.102, 0.032, 0.066)
"""Half the Panda hand's length, along the fingers' travel, half its thickness, and from its palm to
its flange, m."""


@dataclass(frozen=True)
class Grasp:
    """Where and how the hand closes.

    Attributes:
        point: grip point (3,).
        hand: orientation (3, 3).
        opening: of the fingers on the way there, share of the full opening.
    """

    point: Array
    hand: Array
    opening: float


def across(arm: Arm, thing: Thing, pitch: float, offset: float = 0.0, turn: float = 0.0) -> Grasp:
    """Across the narrow side of a solid thing.

    Args:
        arm: the arm.
        thing: what is grasped.
        pitch: of the hand, degrees; less where the palm would touch.
        offset: from its middle along its long side, m.
        turn: of the fingers, degrees from its narrow side: for round things.

    Raises:
        SkillFailed: if it is too wide.
    """
    roll = narrow_roll(arm, thing)
    narrow, long = thing.sides()
    high = abs(fold(roll, 90.0)) > MOST_YAW and thing.height > long[1]
    if long[1] <= min(narrow[1] + ALIKE, GAP - (SNUG if high else ALIKE)):
        # Nearly as thick both ways: across the one that turns the hand less.
        narrow, long = sorted((narrow, long), key=lambda s: abs(fold(angle(arm, s[0]), 90.0)))
        roll = fold(angle(arm, narrow[0]), 120.0)
    roll, width = fold(roll + turn, 120.0), 2.0 * thing.reach(about_z(turn) @ narrow[0])
    yaw = fold(roll, 90.0)
    level = abs(yaw) <= MOST_YAW
    middle = thing.centre + offset * long[0] * (1.0, 1.0, 0.0)
    opening = min(1.0, (width + 0.03) / 0.08)
    most = pitch if level else min(pitch, MOST_ROLLED)
    lower = FINGER_SIDE if level else OPEN / 2.0 * opening
    for tip in (most, *np.arange(most - 5.0, -1.0, -5.0).tolist()):
        hand = arm.hand(tip, yaw=yaw) if level else arm.hand(tip, roll)
        point = middle - max(0.0, thing.reach(hand[:, 2]) - FINGER) * hand[:, 2]
        tilted = lower * math.sin(math.radians(tip))
        point[2] = max(point[2], thing.bottom + FINGERTIP + tilted)
        # Tipped further, the palm would lie on what reaches out towards the robot.
        if point[2] - middle[2] < thing.height / 2.0 - PADS:
            break
    return Grasp(point, hand, opening)


def reach(pitch: float) -> float:
    """Base to hand at which the arm holds a pitch well, at the height of a counter, m."""
    return float(np.interp(pitch, (0.0, 35.0, 45.0), (0.52, 0.63, 0.57)))


def take(arm: Arm, thing: Thing, grasp: Grasp, rise: float = 0.08, back: float = 0.12) -> Motion:
    """Come in along the approach, close, and lift straight up.

    Args:
        arm: the arm.
        thing: what is grasped.
        grasp: how.
        rise: how far it is lifted, m.
        back: length of the approach, m.

    Raises:
        SkillFailed: if it was not lifted.
    """
    approach = grasp.hand[:, 2]
    yield from arm.open_to(grasp.opening)
    start = raised(grasp.point - back * approach, 0.04)
    yield from arm.move(start, grasp.hand, tolerance=0.02, turn_tolerance=0.08, steps=140)
    yield from come_in(arm, grasp, ((0.06, 0.006, 0.8), (0.0, 0.006, 0.3)), 0.06)
    yield from lift(arm, thing, grasp.hand, rise)


def come_in(
    arm: Arm, grasp: Grasp, stops: Iterable[tuple[float, float, float]], turn_tolerance: float
) -> Motion:
    """Go to a grip point along the approach, as near as the hand gets.

    Args:
        arm: the arm.
        grasp: the grip point, and how the hand is held.
        stops: before the grip point, m, with tolerance, m, and speed, one after the other.
        turn_tolerance: rad.
    """
    for before, tolerance, speed in stops:
        yield from arm.move(
            grasp.point - before * grasp.hand[:, 2],
            grasp.hand,
            tolerance=tolerance,
            turn_tolerance=turn_tolerance,
            speed=speed,
            steps=60,
            required=False,
            exact=True,
        )


def lift(arm: Arm, thing: Thing, hand: Array, rise: float, back: float = 0.0) -> Motion:
    """Close the fingers and rise.

    Args:
        arm: the arm.
        thing: what is between the fingers.
        hand: orientation (3, 3).
        rise: how far it is lifted, m.
        back: how far it is drawn towards the robot meanwhile, m; near the end of its reach the arm
            rises no other way.

    Raises:
        SkillFailed: if the object did not come along.
    """
    before = thing.underside
    # Within 2 cm of its goal, a hand that is also drawn back has risen by little.
    tolerance = 0.01 if back else 0.02
    yield from arm.grip(True, 14)
    yield from arm.move(
        raised(arm.position - back * np.append(arm.forward, 0.0), rise),
        hand,
        tolerance=tolerance,
        speed=0.35,
        steps=40,
        required=False,
    )
    if thing.underside - before < LIFTED:
        raise SkillFailed("the object was not lifted")


def hand_corners(hand: Array) -> Array:
    """Corners (8, 3) of the hand without its fingers, from the grip point, m."""
    x, y, deep = HAND
    ends = (PALM, PALM + deep)
    return np.array([(i * x, j * y, -k) for i in (-1, 1) for j in (-1, 1) for k in ends]) @ hand.T


def level_yaw(arm: Arm, thing: Thing) -> float:
    """Turn about the vertical, in degrees, that lays the fingers across a side that fits.

    Raises:
        SkillFailed: if no side fits.
    """
    fitting = [fold(angle(arm, axis), 90.0) for axis, width in thing.sides() if width <= GAP]
    if not fitting:
        raise SkillFailed("the object is too wide for the gripper")
    best = min(fitting, key=abs)
    return best if abs(best) <= 50.0 else 0.0


def narrow_roll(arm: Arm, thing: Thing) -> float:
    """Roll of a hand that points down, in degrees in (-60, 120], across the narrow side.

    Raises:
        SkillFailed: if it does not fit.
    """
    axis, width = thing.sides()[0]
    if width > GAP:
        raise SkillFailed("the object is too wide for the gripper")
    return fold(angle(arm, axis), 120.0)


def angle(arm: Arm, axis: Array) -> float:
    """Degrees about the vertical from the fingers' direction to an axis."""
    fingers = arm.hand()[:, 0]
    return math.degrees(math.atan2(np.cross(fingers, axis)[2], fingers @ axis))


def fold(degrees: float, top: float) -> float:
    """The same line, as an angle in (top - 180, top]."""
    return top - (top - degrees) % 180.0
