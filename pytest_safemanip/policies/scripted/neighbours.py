"""Putting something on a shelf close to another thing that stands there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed
from pytest_safemanip.policies.scripted.carrying import (
    GENTLY,
    HANG_OVER,
    carry_to_shelf,
    come_down,
    hangs,
    put_on_shelf,
)
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.standing import ducked
from pytest_safemanip.policies.scripted.things import Furniture, Thing

CLOSE = 0.135
"""Middle to middle of what is put down and what it belongs to, m: RoboCasa wants 15 cm, and the
hand stops within 1 cm."""
STILL_CLOSE = 0.142
"""Likewise where no place that is closer has room, m."""
NEAR = 0.30
"""Likewise for what only belongs to a group: nearer to one another than to the rest, m."""
DEPTHS = (0.02, 0.04, 0.06, 0.08, 0.10)
"""Free space between the front of the shelf and the object, m."""
PLACES = 25
"""Number of places along the shelf that are looked at."""
FROM_SIDE = 0.17
"""From the side of a cabinet to the middle of the hand, m: the palm is 10 cm wide to either side,
and the elbow swings out a little beyond."""
OFF_DOOR = 0.26
"""From the side of a cabinet to the middle of the base, m: elbow and forearm swing out to an open
door, and the hand reaches as far aside of the base."""
FINGERS, PALM = 0.058, 0.105
"""From the grip point to the far side of an opening finger, and to the end of the palm, m."""
ROOM = 0.02
"""Free space that is as good as more, m."""
APART = 0.25
"""From the middle of what it does not belong to, m: what belongs to that finds room too."""
TALLER = 0.03
"""What is higher by more is as wide as its box at the height of the palm, m."""
BEHIND = 0.015
"""From a thing that is put down in front of another one to that, m."""
TOP = 0.008
"""How far before the middle of a thing a palm passes that is as high as its top, m: there the palm
is 13 mm behind the grip point, shakers have a radius of 21 mm, and bottles are narrower."""


@dataclass(frozen=True)
class Spot:
    """Where on a shelf something can be put down.

    Attributes:
        aside: along the base's left direction, m.
        depth: from the front of the shelf to the thing, m.
        room: least distance from the hand, and from the thing, to what stands there, m.
        away: to the object that it belongs to, m.
    """

    aside: float
    depth: float
    room: float
    away: float


def place_in_cabinet_beside(arm: Arm, role: str, cabinet_role: str, other_role: str) -> Motion:
    """Put a held object on the lowest shelf of an open cabinet, close to another object in it, and
    come down in front of the counter.

    Raises:
        SkillFailed: if there is no room.
    """
    cabinet, other, thing = Furniture(arm, cabinet_role), Thing(arm, other_role), Thing(arm, role)
    spot = spot_on_shelf(arm, thing, cabinet, other)
    yield from put_beside(arm, role, cabinet_role, spot)


def place_in_cabinet_near(arm: Arm, role: str, cabinet_role: str, other_role: str) -> Motion:
    """Put a held object on the lowest shelf of an open cabinet, as near to another object in it as
    there is room for the hand, and come down in front of the counter.

    Raises:
        SkillFailed: if there is no room.
    """
    cabinet, other, thing = Furniture(arm, cabinet_role), Thing(arm, other_role), Thing(arm, role)
    spots = spots_on_shelf(arm, thing, cabinet, other, NEAR)
    best = max(spots, key=lambda s: (min(s.room, ROOM), -s.away))
    yield from put_beside(arm, role, cabinet_role, best)
    yield from ducked(arm)


def put_beside(arm: Arm, role: str, cabinet_role: str, spot: Spot) -> Motion:
    """Bring a held object to a spot on a shelf, let go of it, and come down."""
    thing, cabinet, aside = Thing(arm, role), Furniture(arm, cabinet_role), spot.aside
    yield from carry_to_shelf(arm, role, cabinet_role, aside, OFF_DOOR)
    # What hangs low may still be below the shelf's edge.
    lowest = cabinet.opening()[1] + HANG_OVER if hangs(arm, thing) else -math.inf

    def before_spot() -> Array:
        way = aside - arm.aside(thing.centre)
        return np.add(arm.position, (*(way * arm.left), max(0.0, lowest - thing.bottom)))

    yield from arm.move(before_spot, tolerance=0.005, speed=GENTLY, steps=40, required=False)
    yield from put_on_shelf(arm, role, cabinet_role, spot.depth)
    yield from come_down(arm)


def spot_on_shelf(arm: Arm, thing: Thing, cabinet: Furniture, other: Thing) -> Spot:
    """Where on a shelf, close to another object, there is most room for a thing and the hand.

    Raises:
        SkillFailed: if there is none.
    """
    rest = [t for t in standing_on(arm, cabinet, thing) if t.entity != other.entity]

    def apart(spot: Spot) -> float:
        """From a spot to what the thing does not belong to, along the shelf, m."""
        return min((abs(spot.aside - arm.aside(t.centre)) for t in rest), default=APART)

    spots = spots_on_shelf(arm, thing, cabinet, other, STILL_CLOSE)
    closer = [spot for spot in spots if spot.away < CLOSE]
    return max(closer or spots, key=lambda s: (min(s.room, ROOM), min(apart(s), APART), -s.away))


def standing_on(arm: Arm, cabinet: Furniture, thing: Thing) -> list[Thing]:
    """What else stands on the lowest shelf of a cabinet."""
    pose, half = cabinet.interior()
    floor = pose[2] - half[2]
    everything = [Thing(arm, body.entity) for body in arm.scene.bodies]
    return [t for t in everything if t.entity != thing.entity and abs(t.bottom - floor) < 0.05]


def spots_on_shelf(
    arm: Arm, thing: Thing, cabinet: Furniture, other: Thing, within: float
) -> list[Spot]:
    """Where there is room for a thing and the hand on a shelf, within a distance of another object.

    Raises:
        SkillFailed: if there is none.
    """
    pose, half = cabinet.interior()
    front = cabinet.opening()[0]
    standing = standing_on(arm, cabinet, thing)
    radius = thing.sides()[1][1] / 2.0
    middle, reach = arm.aside(pose), half[0] - FROM_SIDE

    def room(aside: float, depth: float) -> float:
        """Least distance from the hand, and from the thing, to what stands there, m."""
        gaps = [math.inf]
        for t in standing:
            beside = abs(aside - arm.aside(t.centre)) - t.sides()[1][1] / 2.0
            beyond = t.extent_ahead()[0] - front - depth - radius
            past = past_palm(aside, depth, t)
            gaps.append(max(min(beside - FINGERS, past), beyond - radius - BEHIND))
        return min(gaps)

    def past_palm(aside: float, depth: float, t: Thing) -> float:
        """Of the palm, which comes after the fingers, nothing reaches beyond the grip point."""
        if t.height < thing.height - TALLER:
            return math.inf
        centre = front + depth + radius
        wide = t.sides()[1][1] / 2.0
        if t.height < thing.height + TALLER:
            before = arm.ahead(t.centre) - TOP - centre
        else:
            before = t.extent_ahead()[0] - centre
        return max(abs(aside - arm.aside(t.centre)) - wide - PALM, before)

    def away(aside: float, depth: float) -> float:
        """To the other object, m."""
        ahead = front + depth + radius - arm.ahead(other.centre)
        return math.hypot(aside - arm.aside(other.centre), ahead)

    found = [
        Spot(float(aside), depth, room(aside, depth), away(aside, depth))
        for aside in np.linspace(middle - reach, middle + reach, PLACES)
        for depth in DEPTHS
        if away(aside, depth) < within
    ]
    found = [spot for spot in found if spot.room >= 0.0]
    if not found:
        raise SkillFailed(f"there is no room close to {other.entity}")
    return found
