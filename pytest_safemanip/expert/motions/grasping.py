"""Grasping solid things across their narrow side, from above and from the front."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, cut, raised
from pytest_safemanip.expert.robot.hand import (
    FINGER_SIDE,
    FINGERTIP,
    GAP,
    GRIP_DEPTH,
    OPENING,
    Grasp,
    finger_angle,
    reach_at,
)
from pytest_safemanip.expert.robot.rotations import Array, about_z, fold
from pytest_safemanip.expert.world.contacts import palm_presses
from pytest_safemanip.expert.world.free_spots import carries
from pytest_safemanip.expert.world.hand_room import PINCH_OFFSETS, free_of_others
from pytest_safemanip.expert.world.rims import overhung
from pytest_safemanip.expert.world.standing import DUCKED, duck, stand_before
from pytest_safemanip.expert.world.things import Thing, other_things

APPROACH = 0.12
"""Length of the straight way in, if nothing else is said, m."""
LIFTED = 0.02
"""Rise that shows that an object is held, m; the hand itself rises by 3 cm at least."""

ALIKE = 0.012
"""Two sides that differ by less are alike to the hand, m."""
SNUG = 0.008
"""By how much less than the gap a side may be that is gripped for the fingers to be level, m: with
a side of 6 cm between them, fingers that are not would come down on the top of something high."""
MOST_YAW = 50.0
"""Degrees to either side that the hand turns with level fingers; beyond, it rolls."""
MOST_ROLLED = 20.0
"""Pitch at which rolled fingers, which are not level, still reach under a thing, degrees."""
PADS = 0.006
"""Least depth of the grip point below an object's top, m."""


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
        narrow, long = sorted(
            (narrow, long), key=lambda s: abs(fold(finger_angle(arm, s[0]), 90.0))
        )
        roll = fold(finger_angle(arm, narrow[0]), 120.0)
    roll, width = fold(roll + turn, 120.0), 2.0 * thing.reach(about_z(turn) @ narrow[0])
    yaw = fold(roll, 90.0)
    level = abs(yaw) <= MOST_YAW
    middle = thing.centre + offset * long[0] * (1.0, 1.0, 0.0)
    opening = min(1.0, (width + 0.03) / 0.08)
    most = pitch if level else min(pitch, MOST_ROLLED)
    lower = FINGER_SIDE if level else OPENING / 2.0 * opening
    for tip in (most, *np.arange(most - 5.0, -1.0, -5.0).tolist()):
        hand = arm.hand(tip, yaw=yaw) if level else arm.hand(tip, roll)
        point = middle - max(0.0, thing.reach(hand[:, 2]) - GRIP_DEPTH) * hand[:, 2]
        tilted = lower * math.sin(math.radians(tip))
        point[2] = max(point[2], thing.bottom + FINGERTIP + tilted)
        # Tipped further, the palm would lie on what reaches out towards the robot.
        if point[2] - middle[2] < thing.height / 2.0 - PADS:
            break
    return Grasp(point, hand, opening)


def grasp_and_lift(
    arm: Arm, thing: Thing, grasp: Grasp, rise: float = 0.08, back: float = APPROACH
) -> Motion:
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


def level_yaw(arm: Arm, thing: Thing) -> float:
    """Turn about the vertical, in degrees, that lays the fingers across a side that fits.

    Raises:
        SkillFailed: if no side fits.
    """
    fitting = [fold(finger_angle(arm, axis), 90.0) for axis, width in thing.sides() if width <= GAP]
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
    return fold(finger_angle(arm, axis), 120.0)


FRONT_PITCH = 35.0
"""Degrees from straight down: the wrist stays clear of what hangs above the counter."""
FRONT_STAND = 0.63
PLATE_PITCH = 35.0
"""Degrees from straight down: wrist and elbow stay low enough for what hangs above a stove."""
ROLLED_PITCH = 15.0
"""Likewise where the fingers are not level: neither touches what a flat thing lies on."""
ROLLED_OPEN = 0.014
"""How much wider than a thing they open then, m: the wider, the lower one of them is."""
PALM_EASED = 0.006
"""How far the hand draws back from a thing that its palm has met, m: it stops within 4 mm."""
BELOW_TOP = 0.010
"""Grip point below the top of a thing that is to be used, m: it sticks out below the fingers."""
AT_MIDDLE = np.zeros(3)
WIDE_THING = 0.070
"""Fingers that are no longer told to open come back to 72 mm, 1 mm from a thing this wide, m."""
LONG_THING = 3.0
"""Length by width from which a thing may be pinched off its middle, for others beside it."""
FARTHER_ALONG = (0.06, -0.06)
"""How far off at most, m: what is light enough to lie on a plate does not turn in the fingers."""
HAND_HIGH, WRIST_HANGS = 0.17, 0.12
"""A hand that is this far above where it comes in comes down before what hangs at the height of its
wrist, m, that is, over a spot so far below the hand."""


def grasp_from_front(arm: Arm, role: str, offset: Array = AT_MIDDLE, rise: float = 0.05) -> Motion:
    """Pinch an object on a counter from the front and lift it.

    Args:
        arm: the arm.
        role: the object.
        offset: from its middle to where it is gripped (3,), m.
        rise: how far it is lifted, m; farther where its other end hangs.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    thing = Thing(arm, role)
    yaw = level_yaw(arm, thing)
    hand = arm.hand(FRONT_PITCH, yaw=yaw)
    approach = hand[:, 2]
    where = thing.centre + offset
    yield from arm.drive(arm.floor_point(arm.ahead(where) - FRONT_STAND, arm.aside(where)))
    where = thing.centre + offset
    above = max(thing.height / 2.0 - 0.025, FINGERTIP + 0.008 - thing.height / 2.0)
    target = raised(where, above)
    if 2.0 * thing.reach(hand[:, 0]) > WIDE_THING:
        yield from arm.grip(False)
    else:
        yield from arm.open_to(0.98)
    yield from arm.move(raised(target - 0.14 * approach, 0.03), hand, tolerance=0.03, steps=140)
    yield from arm.move(
        target - 0.07 * approach, hand, tolerance=0.012, turn_tolerance=0.08, steps=60
    )
    yield from cut(
        arm.move(
            target, hand, tolerance=0.008, turn_tolerance=0.08, speed=0.4, steps=45, required=False
        ),
        lambda: palm_presses(arm, thing),
    )
    if palm_presses(arm, thing):
        # What lies under the palm while the fingers close is pressed on the counter.
        eased = arm.position - PALM_EASED * approach
        yield from arm.move(eased, hand, tolerance=0.002, speed=0.2, steps=8, required=False)
    yield from lift(arm, thing, hand, rise)


def grasp_from_above(arm: Arm, role: str, pitch: float = 0.0) -> Motion:
    """Pinch an object across its narrow side.

    Args:
        arm: the arm.
        role: the object.
        pitch: of the hand, degrees from straight down.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    thing = Thing(arm, role)
    where = thing.centre
    yield from duck(arm, arm.aside(where))
    yield from stand_before(arm, where, reach_at(pitch))
    grasp = across(arm, thing, pitch)
    (_, width), (axis, length) = thing.sides()
    if length > LONG_THING * width:
        off = off_others(arm, thing, grasp.opening)
        grasp = across(arm, thing, pitch, off)
        # On a plate's rim it slopes, and is lower at one end than in its middle.
        grasp = replace(grasp, point=raised(grasp.point, min(0.0, off * float(axis[2]))))
        # Fingers that come from closed open farther than they are told, onto what lies beside it.
        yield from arm.open_to(1.0)
    low, height = grasp.point[2] + APPROACH, arm.position[2]
    if height > low + HAND_HIGH and overhung(arm, np.append(where[:2], height - WRIST_HANGS)):
        front = arm.before(DUCKED[0], low)
        yield from arm.move(front, grasp.hand, tolerance=0.04, turn_tolerance=0.3, steps=80)
    yield from grasp_and_lift(arm, thing, grasp)


def off_others(arm: Arm, thing: Thing, opening: float) -> float:
    """How far from its middle, along its long side, something long is pinched for the fingers to
    come down beside what lies next to it on the same plate, m.

    Args:
        arm: the arm.
        thing: what is pinched.
        opening: of the fingers, share of the full opening.
    """
    axis = thing.sides()[1][0]
    under = [other.entity for other in other_things(arm) if carries(other, thing)]
    return float(
        free_of_others(arm, thing, opening * OPENING, (*PINCH_OFFSETS, *FARTHER_ALONG), under)
        @ axis
    )


def grasp_near_top(arm: Arm, role: str) -> Motion:
    """Pinch a thing that lies on a counter near its top, so that it can be pressed on another one.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    thing = Thing(arm, role)
    level = abs(fold(narrow_roll(arm, thing), 90.0)) <= MOST_YAW
    pitch = PLATE_PITCH if level else ROLLED_PITCH
    yield from stand_before(arm, thing.centre, reach_at(pitch))
    grasp = across(arm, thing, pitch)
    # With 7 mm of it between the pads, a sponge slips out: the lower finger may touch the counter.
    height = max(thing.bottom + FINGERTIP, thing.highest - BELOW_TOP)
    point = np.append(grasp.point[:2], height)
    grasp = replace(grasp, point=point)
    if not level:
        grasp = replace(grasp, opening=min(1.0, (thing.sides()[0][1] + ROLLED_OPEN) / GAP))
    yield from grasp_and_lift(arm, thing, grasp)
