"""A dishwasher, from beside its open door: dishes go into its upper rack."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.cup_grasps import CUP_SIDES, around, yaws_around
from pytest_safemanip.expert.motions.grasping import come_in, lift
from pytest_safemanip.expert.motions.handles import handle, lug_length
from pytest_safemanip.expert.motions.putting import held_over, set_upon
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.robot.hand import GAP, Grasp, finger_angle
from pytest_safemanip.expert.robot.rotations import Array, about_z, fold
from pytest_safemanip.expert.world.standing import nearest, solids
from pytest_safemanip.expert.world.things import Furniture, Part, Thing, halves, other_things

RISEN = 1.10
"""Height from which the hand comes back to the base, m: lower, its wrist is at its limit there."""


def rise_off(arm: Arm) -> Motion:
    """Draw the hand straight up, out of the rack or off the door."""
    up = raised(arm.position, max(0.0, RISEN - float(arm.position[2])))
    yield from arm.move(up, tolerance=0.06, required=False)


BESIDE_RACK = 0.295
"""From the side of a rack to the base, m: half the base's width, and the door's edge."""
BASE_FRONT = 0.20
"""From the base's origin to what it drives along in front of it, m."""
FAR, FAR_DOWN = 0.85, 0.72
"""How far from the base a hand reaches at the height of the counter, m, tipped around a cup, and
pointing straight down; what is farther is taken from the dishwasher's other side."""
FOREARM_BEHIND, FOREARM_ABOVE = 0.08, 0.30
"""Room for the forearm behind a dish and above it, m."""
OVER_COUNTER_REACH, OVER_RACK_REACH = 0.15, 0.25
"""How far before the base the hand is, m, far to its side: over the counter at least, for the base
comes up to that, and over the rack."""
SWING_BEFORE = 0.35
"""How far before a dish on the counter the arm swings to the side, m: off what stands there."""
OVER_COUNTER_HIGHER = 0.04
"""How much higher than where a grasp begins the hand comes over the counter, m."""
CUP_PITCH = 20.0
"""Degrees from straight down, away from the base, at which a hand takes a cup."""
MOST_LEFT_TURN = 105.0
"""How far a hand that points down may be turned to the left of the arm, degrees: to the right, its
last joint has less room."""
UNDER_RIM = 0.006
"""From the top of a small bowl's lug to the grip point, m."""
ON_LUG = 0.75
"""From a small bowl's wall to the grip point, share of its lug: beside the wall, which is wider."""
DISH_APPROACH = 0.12
"""Length of the way in to a dish, m."""
DISH_STOPS = ((0.06, 0.006, 0.8), (0.03, 0.003, 0.4), (0.0, 0.004, 0.2))
"""On it: distance left, m, with tolerance, m, and speed. Beside a cup of 7 cm an open finger has
4 mm, and must not come down on its rim."""
DISH_RISE = 0.10
"""How far a dish is lifted off the counter, m."""

DISH_OFF_FRONT = 0.10
"""From the front of the rack to the middle of a dish, m: the wrist stays before the counter."""
DISHES_APART = 0.17
"""From one dish in the rack to the next, m: half a hand and a bowl."""
OVER_FLOOR = 0.055
"""From the underside of the rack to a dish that is lowered slowly from there, m."""


def grasp_over_door(arm: Arm, role: str, fixture_role: str) -> Motion:
    """Pick up a cup or a small bowl with a lug that stands above a dishwasher that is open.

    Raises:
        SkillFailed: if it is out of reach or was not lifted.
    """
    fixture, thing = Furniture(arm, fixture_role), Thing(arm, role)
    cup = thing.sides()[0][1] <= GAP
    here = _base_beside(arm, fixture)
    there = 2.0 * arm.aside(fixture.part(fixture.upper_rack())) - here
    far = FAR if cup else FAR_DOWN
    if _hard(arm, thing, here, far) > _hard(arm, thing, there, far):
        yield from _go_round(arm, fixture, there)
    aside = _base_beside(arm, fixture)
    ahead = _base_ahead(arm, thing, aside)
    away = arm.bearing(thing.middle[:2] - arm.floor_point(ahead, aside))
    grasp = _around_cup(arm, thing, away) if cup else _on_lug(arm, thing, away)
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), aside), tolerance=0.01)
    yield from arm.drive(arm.floor_point(ahead - SWING_BEFORE, aside), speed=1.0)
    before = grasp.point - DISH_APPROACH * grasp.hand[:, 2] - arm.onward(SWING_BEFORE)
    yield from arm.open_to(grasp.opening)
    yield from arm.move(raised(before, OVER_COUNTER_HIGHER), grasp.hand, tolerance=0.03, steps=140)
    yield from arm.drive(arm.floor_point(ahead, aside))
    yield from come_in(arm, grasp, DISH_STOPS, 0.04)
    yield from lift(arm, thing, grasp.hand, DISH_RISE)


def place_in_dish_rack(arm: Arm, role: str, fixture_role: str) -> Motion:
    """Put a held dish into the upper rack of a dishwasher, which is out, and draw the hand up.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    fixture, thing = Furniture(arm, fixture_role), Thing(arm, role)
    spot = _free_spot(arm, fixture, thing)
    stand = arm.floor_point(arm.ahead(spot) - OVER_RACK_REACH, arm.aside(arm.base))
    yield from arm.drive(stand, speed=0.5, gentle=True)
    turn = arm.bearing(spot[:2] - arm.base) - arm.bearing(thing.middle[:2] - arm.base)
    hand = about_z(turn) @ arm.rotation
    rack = fixture.upper_rack()
    middle, half = float(fixture.part(rack)[2]), rack.half[2]
    over = held_over(arm, thing, spot, max(thing.bottom, middle + half))
    yield from arm.move(over, hand, tolerance=0.02, speed=0.6, steps=120)
    over = held_over(arm, thing, spot, middle - half + OVER_FLOOR)
    yield from arm.move(over, hand, tolerance=0.015, speed=0.6, steps=120)
    yield from set_upon(arm, role)
    yield from arm.grip(False)
    yield from rise_off(arm)


def _base_beside(arm: Arm, fixture: Furniture) -> float:
    """Where the base stands beside the open door of a dishwasher, along its left direction, m."""
    rack = fixture.upper_rack()
    middle = arm.aside(fixture.part(rack))
    return middle + math.copysign(halves(arm, rack)[1] + BESIDE_RACK, arm.aside(arm.base) - middle)


def _base_ahead(arm: Arm, thing: Thing, aside: float) -> float:
    """How far ahead the base stands for a dish on the counter, m."""
    return min(arm.ahead(thing.middle) - OVER_COUNTER_REACH, nearest(arm, aside, aside))


def _hard(arm: Arm, thing: Thing, aside: float, far: float) -> int:
    """What speaks against reaching for a dish from a place beside the dishwasher: that it is too
    far and, less, that something high stands between, which the forearm might meet.
    """
    ends = sorted((aside, arm.aside(thing.middle)))
    beside = any(
        points[:, 2].max() > thing.highest
        and points[:, 2].min() < thing.highest + FOREARM_ABOVE
        and (points[:, :2] @ arm.left).max() > ends[0]
        and (points[:, :2] @ arm.left).min() < ends[1]
        and (points[:, :2] @ arm.forward).min() < arm.ahead(thing.middle) + FOREARM_BEHIND
        and (points[:, :2] @ arm.forward).max() > arm.ahead(thing.middle) - SWING_BEFORE
        for points in solids(arm)
    )
    ahead = arm.ahead(thing.middle) - _base_ahead(arm, thing, aside)
    return int(beside) + 2 * int(math.hypot(ahead, ends[1] - ends[0]) > far)


def _go_round(arm: Arm, fixture: Furniture, there: float) -> Motion:
    """Drive round the open door of a dishwasher, to a place along the base's left direction."""
    joint = fixture.joint(Part.DOOR)
    end = min(arm.ahead(point) for point in fixture.outline(joint))
    before = end - BASE_FRONT
    yield from arm.drive(arm.floor_point(before, arm.aside(arm.base)), speed=1.0)
    yield from arm.drive(arm.floor_point(before, there), speed=1.0)


def _around_cup(arm: Arm, thing: Thing, away: float) -> Grasp:
    """Around a cup, the hand tipped as nearly to a bearing, degrees, as its sides allow."""
    yaws = yaws_around(arm, thing, CUP_SIDES, 90.0)
    return around(arm, thing, CUP_PITCH, yaw=min(yaws, key=lambda yaw: abs(yaw - away)))


def _on_lug(arm: Arm, thing: Thing, away: float) -> Grasp:
    """Across a bowl's lug, the hand pointing down, turned as little from a bearing, degrees, as
    that takes.
    """
    root, way = handle(thing)
    yaw = fold(finger_angle(arm, np.cross((0.0, 0.0, 1.0), way)), away + MOST_LEFT_TURN)
    point = root + ON_LUG * lug_length(thing) * way - np.array((0.0, 0.0, UNDER_RIM))
    return Grasp(point, arm.hand(0.0, yaw=yaw), 1.0)


def _free_spot(arm: Arm, fixture: Furniture, thing: Thing) -> Array:
    """Where in the upper rack a dish goes: its middle, or nearer to the robot (3,)."""
    rack = fixture.upper_rack()
    middle = fixture.part(rack)
    side = math.copysign(1.0, arm.aside(arm.base) - arm.aside(middle))
    ahead = arm.ahead(middle) - halves(arm, rack)[0] + DISH_OFF_FRONT
    others = [other.middle for other in other_things(arm, thing)]
    for aside in (0.0, DISHES_APART):
        spot = arm.point(ahead, arm.aside(middle) + side * aside, middle[2])
        if all(np.linalg.norm((other - spot)[:2]) > DISHES_APART / 2.0 for other in others):
            return spot
    raise SkillFailed("the rack is full")
