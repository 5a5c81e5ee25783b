"""Grasping something small on a shelf of an open fridge, near its front."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pytest_safemanip.expert.motions.grasping import ALIKE, across, come_in, lift
from pytest_safemanip.expert.motions.handles import fold_in
from pytest_safemanip.expert.motions.putting import BRAKE, USUAL, carry_over, leave
from pytest_safemanip.expert.robot.arm import GENTLY, Arm, Motion, SkillFailed
from pytest_safemanip.expert.robot.hand import GAP, OPENING, TIPPED_FINGERTIP, Grasp, finger_angle
from pytest_safemanip.expert.robot.rotations import Array, fold
from pytest_safemanip.expert.world.free_spots import free_spot
from pytest_safemanip.expert.world.standing import nearest, stand
from pytest_safemanip.expert.world.things import Furniture, Thing

PITCH = 48.0
"""Degrees from straight down: between two shelves, with 28 cm from one to the next, the wrist stays
outside, below the upper one; tipped further, the forearm lies on the edge of a high shelf."""
REACH = 0.58
"""Base to hand at which the arm holds that pitch, m."""
OUTSIDE = 0.14
"""From the hand to the front of the shelf before it goes in, m."""
TUCKED = 0.46
"""Base to hand then, m."""
PASSING = 0.03
"""How far off an open door the hand passes it on its way in, m."""
BEYOND_MIDDLE = 0.003
"""How far beyond a thing's middle the fingers close on it, m: a ball that is 5 mm before the grip
point, towards their tips, is slowly pressed out of them."""
BASE_OFFSETS = tuple(
    side * off for off in np.arange(0.0, 0.26, 0.03).tolist() for side in (1.0, -1.0)
)
"""How far beside a thing the base may stand for an open door, m."""
STRAY = 0.025
"""How far the base may be from where it is to stand, m."""
REACH_FARTHER = 0.15
"""How much farther than ``REACH`` the arm gets at most, m: beyond, the hand turns level and lies on
the shelf."""
LONG_MOST_YAW = 18.0
"""Degrees to either side that the hand turns for something long: the wrist is beside it, where a
door or a wall is; closing fingers straighten what lies farther askew."""
OPEN_WIDER = 0.03
"""How much farther than that is wide the fingers open beside it, m."""
OFF_END = 0.015
"""From the end of something long to where it is gripped near it, m: its far end hangs down then."""


@dataclass(frozen=True)
class _Passage:
    """How the hand goes in to a grip point and out again.

    Attributes:
        above: that, it passes the shelf's front, m.
        before: that, along the approach, it stops, m.
        rise: how far it lifts what it holds off the shelf, m.
        back: how far it draws it back meanwhile, m.
        off_door: how far off an open door it passes that on its way out, m.
    """

    above: float
    before: float
    rise: float
    back: float
    off_door: float


FROM_ABOVE = _Passage(0.08, 0.06, 0.03, 0.02, 0.0)
OVER_LOW = _Passage(0.035, 0.02, 0.04, 0.06, PASSING)
"""Over something 2 to 3 cm high: the wrist has less room below the next shelf the farther in."""


def grasp_in_fridge(arm: Arm, role: str, fridge_role: str) -> Motion:
    """Pinch something near the front of a shelf, and bring it out past the open door.

    Raises:
        SkillFailed: if it is too wide or out of reach, or was not lifted.
    """
    yield from _bring_out(arm, role, fridge_role, straight_across, FROM_ABOVE)


def grasp_end_in_fridge(arm: Arm, role: str, fridge_role: str) -> Motion:
    """Likewise for something longer than wide, gripped near the end that points to the robot.

    Raises:
        SkillFailed: if it is too wide or out of reach, or was not lifted.
    """
    yield from _bring_out(arm, role, fridge_role, near_end, OVER_LOW)


def _bring_out(
    arm: Arm, role: str, fridge_role: str, how: Callable[[Arm, Thing], Grasp], way: _Passage
) -> Motion:
    thing, fridge = Thing(arm, role), Furniture(arm, fridge_role)
    front = fridge.opening()[0]
    aside = arm.aside(thing.centre)
    base = arm.ahead(thing.centre) - REACH
    beside = max(
        (aside + off for off in BASE_OFFSETS), key=lambda place: min(base, _limit(arm, place))
    )
    if _limit(arm, beside) < base - REACH_FARTHER:
        raise SkillFailed("the base has no room before it")
    start = min(front - OUTSIDE - TUCKED, arm.ahead(arm.base))
    yield from fold_in(arm)
    yield from stand(arm, start, beside)
    grasp = how(arm, thing)
    off_door = float(np.clip(beside - aside, -PASSING, PASSING))
    before = arm.point(arm.ahead(arm.base) + TUCKED, aside + off_door, grasp.point[2] + way.above)
    yield from arm.open_to(grasp.opening)
    yield from arm.move(before, grasp.hand, tolerance=0.03, turn_tolerance=0.12, steps=140)
    yield from stand(arm, base, beside, GENTLY)
    yield from come_in(arm, grasp, ((way.before, 0.008, 0.6), (0.0, 0.003, 0.3)), 0.08)
    yield from lift(arm, thing, grasp.hand, way.rise, way.back)
    out = beside + float(np.clip(beside - aside, -way.off_door, way.off_door))
    yield from arm.drive(arm.floor_point(start, out), speed=GENTLY)


def straight_across(arm: Arm, thing: Thing) -> Grasp:
    """How something small is gripped on a shelf: a round thing straight ahead, for the wrist of a
    turned hand is beside it, where the door may be.

    Raises:
        SkillFailed: if it is too wide.
    """
    grasp = across(arm, thing, PITCH)
    (_, narrow), (_, long) = thing.sides()
    if long < narrow + ALIKE:
        grasp = across(arm, thing, PITCH, turn=-arm.bearing(grasp.hand[:, 2]))
    return replace(grasp, point=deep_in(thing, grasp.hand))


def near_end(arm: Arm, thing: Thing) -> Grasp:
    """How something longer than wide is gripped near its end that points to the robot.

    Raises:
        SkillFailed: if it is too wide.
    """
    (narrow, width), (long, length) = thing.sides()
    if width > GAP:
        raise SkillFailed("it is too wide for the gripper")
    nearer = math.copysign(length / 2.0 - OFF_END, arm.ahead(long))
    point = thing.centre - nearer * long * (1.0, 1.0, 0.0)
    yaw = float(np.clip(fold(finger_angle(arm, narrow), 90.0), -LONG_MOST_YAW, LONG_MOST_YAW))
    hand = arm.hand(PITCH, yaw=yaw)
    tips = thing.bottom + TIPPED_FINGERTIP
    return Grasp(np.append(point[:2], max(point[2], tips)), hand, (width + OPEN_WIDER) / OPENING)


def drop_onto(arm: Arm, role: str, target_role: str) -> Motion:
    """Let a small held thing fall by some millimetres onto another one, which the fingertips around
    it do not touch.

    Raises:
        SkillFailed: if the hand or the base does not get there.
    """
    target = Thing(arm, target_role)
    yield from carry_over(arm, role, free_spot(arm, role, target), target.highest + BRAKE)
    low = np.append(arm.position[:2], target.highest + TIPPED_FINGERTIP)
    hand = arm.rotation
    yield from arm.move(
        low, hand, tolerance=0.002, speed=USUAL, steps=100, required=False, exact=True
    )
    yield from arm.grip(False)
    yield from leave(arm)


def _limit(arm: Arm, aside: float) -> float:
    """How far ahead the base may be at a place sideways, or a little beside it, m."""
    return nearest(arm, aside - STRAY, aside + STRAY)


def deep_in(thing: Thing, hand: Array) -> Array:
    """The grip point (3,), above the shelf, at which a tipped hand (3, 3) has a small thing well
    between its fingers.
    """
    approach = hand[:, 2]
    level = approach * (1.0, 1.0, 0.0)
    slope = float(np.linalg.norm(level))
    rise = max(0.0, thing.bottom + TIPPED_FINGERTIP - float(thing.centre[2]))
    ahead = (BEYOND_MIDDLE - rise * approach[2]) / slope
    return np.asarray(thing.centre + ahead * level / slope + np.array((0.0, 0.0, rise)))
