"""Putting something on the lowest shelf of an open wall cabinet, close to other things too."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.expert.motions.grasping import FRONT_PITCH
from pytest_safemanip.expert.motions.putting import set_down
from pytest_safemanip.expert.robot.arm import GENTLY, Arm, Motion, SkillFailed
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.standing import ducked, nearest
from pytest_safemanip.expert.world.things import Furniture, Thing, other_things

CARRY_REACH = 0.50
"""Base to hand while a load is carried, m."""
SHELF_PITCH = 50.0
SHELF_STAND = 0.51
"""Base to the front of the shelf, m."""
SHELF_DEPTH = 0.06
"""Free space between the front of the shelf and the object, m."""
HANG_PITCH = 60.0
"""Likewise for what hangs 15 cm below the hand: less level, the arm does not reach so high."""
HANG_REACH = 0.46
"""Base to hand before the shelf then, m."""
HANG_OVER = 0.025
"""Free space below it, m."""
HANGS = 0.05
"""From the grip point down to the centre of mass of what swings in the fingers, m."""
MOST_REACH, RAISED = CARRY_REACH + 0.02, 1.30
"""Base to hand at most, m, and height of the hand, m, where it is turned for the shelf."""
LEAST_BACK, OFF_FRONT = 0.12, 0.10
"""How far the base draws back for that at least, and from a load to the front of the shelf, m."""
OFF_LOAD, OUT_OF_CABINET = 0.08, 0.35
"""How far the hand draws off what it has let go, and then the base back, m."""
LET_GO_OVER = 0.003
"""Free space below what is let go, m."""
BASE_FROM_SIDE = 0.20
"""From the side of a cabinet to the middle of the base, m."""
DOWN_REACH, DOWN_HEIGHT = 0.46, 1.25
"""Where the hand comes down to from a shelf, before the base and above the floor, m: from between
the doors, it would not get straight to what stands below them."""


@dataclass(frozen=True)
class _Carried:
    """How something is brought to a shelf and in over it; speeds are shares of the top ones.

    Attributes:
        pitch: of the hand before and over the shelf, degrees from straight down.
        first_pitch: likewise on the way up.
        reach: base to hand before the shelf, m.
        over_edge: free space below a load before the shelf, m.
        over_shelf: likewise over the shelf, m.
        drive: speed of the base on the way.
        move: speed of the hand on the way.
        drive_in: speed of the base on the way in.
        move_in: speed of the hand on the way in.
    """

    pitch: float
    first_pitch: float
    reach: float
    over_edge: float
    over_shelf: float
    drive: float
    move: float
    drive_in: float
    move_in: float


STANDING = _Carried(
    pitch=SHELF_PITCH,
    first_pitch=(FRONT_PITCH + SHELF_PITCH) / 2.0,
    reach=CARRY_REACH,
    over_edge=0.05,
    over_shelf=0.03,
    drive=0.7,
    move=1.0,
    drive_in=0.5,
    move_in=0.6,
)
HANGING = _Carried(
    pitch=HANG_PITCH,
    first_pitch=HANG_PITCH,
    reach=HANG_REACH,
    over_edge=HANG_OVER,
    over_shelf=HANG_OVER,
    drive=GENTLY,
    move=GENTLY,
    drive_in=GENTLY,
    move_in=GENTLY,
)


def hangs(arm: Arm, thing: Thing) -> bool:
    """Whether a held object is gripped so far above its centre of mass that it swings."""
    return bool(arm.position[2] - thing.com[2] > HANGS)


def carry_to_shelf(
    arm: Arm,
    role: str,
    cabinet_role: str,
    aside: float | None = None,
    from_side: float = BASE_FROM_SIDE,
) -> Motion:
    """Bring a held object in front of an open cabinet, a little above its lowest shelf.

    Args:
        arm: the arm.
        role: the object.
        cabinet_role: the cabinet.
        aside: where along the base's left direction, m; None for where the object is now.
        from_side: how far from the cabinet's side the base stays, m.
    """
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    front, shelf = cabinet.opening()
    pose, half = cabinet.interior()
    how = HANGING if hangs(arm, thing) else STANDING
    clear = max(LEAST_BACK, thing.extent_ahead()[1] - (front - OFF_FRONT))
    yield from arm.drive(arm.base - clear * arm.forward, speed=how.drive)
    reach = min(arm.ahead(arm.position) - arm.ahead(arm.base), MOST_REACH)
    yield from arm.move(
        arm.point(arm.ahead(arm.base) + reach, arm.aside(arm.position), RAISED),
        arm.hand(how.first_pitch),
        tolerance=0.05,
        turn_tolerance=0.3,
        speed=how.move,
        steps=140,
    )

    def before_shelf() -> Array:
        height = arm.position[2] + shelf + how.over_edge - thing.bottom
        return arm.before(how.reach, height)

    hand = arm.hand(how.pitch)
    yield from arm.move(
        before_shelf, hand, tolerance=0.03, turn_tolerance=0.15, speed=how.move, steps=120
    )
    middle, room = arm.aside(pose), half[0] - from_side
    wanted = arm.aside(thing.centre) if aside is None else aside
    to = float(np.clip(wanted, middle - room, middle + room))
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), to), speed=how.drive)


def put_on_shelf(arm: Arm, role: str, cabinet_role: str, depth: float = SHELF_DEPTH) -> Motion:
    """Push a held object in over the shelf, lower it, let go, and draw back.

    Args:
        arm: the arm.
        role: the object.
        cabinet_role: the cabinet.
        depth: free space between the front of the shelf and the object there, m.
    """
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    front, shelf = cabinet.opening()
    hanging, aside = hangs(arm, thing), arm.aside(arm.base)
    how = HANGING if hanging else STANDING
    hand = arm.hand(how.pitch)
    closest = nearest(arm, aside, aside) if hanging else front - SHELF_STAND
    yield from arm.drive(
        arm.floor_point(closest, aside),
        until=lambda: thing.extent_ahead()[0] > front + depth,
        speed=how.drive_in,
    )

    def over_shelf() -> Array:
        way = front + depth - thing.extent_ahead()[0]
        rise = shelf + how.over_shelf - thing.bottom
        return np.add(arm.position, (*(way * arm.forward), rise))

    yield from arm.move(
        over_shelf,
        hand,
        tolerance=0.02,
        turn_tolerance=0.2,
        speed=how.move_in,
        steps=60,
        required=False,
    )
    if hanging:
        yield from set_down(arm, role)
    else:
        yield from lower(arm, thing, shelf, hand)
        yield from arm.grip(False)
    yield from arm.move(
        arm.position - OFF_LOAD * arm.rotation[:, 2],
        tolerance=0.03,
        speed=0.5,
        steps=30,
        required=False,
    )
    yield from arm.drive(arm.base - OUT_OF_CABINET * arm.forward)


def come_down(arm: Arm) -> Motion:
    """Bring an empty hand down from between a cabinet's doors, in front of the counter."""
    low = arm.before(DOWN_REACH, DOWN_HEIGHT)
    yield from arm.move(low, arm.hand(FRONT_PITCH), tolerance=0.05, turn_tolerance=0.3)


def place_on_shelf(arm: Arm, role: str, cabinet_role: str) -> Motion:
    """Put a held object on the lowest shelf of an open cabinet."""
    yield from carry_to_shelf(arm, role, cabinet_role)
    yield from put_on_shelf(arm, role, cabinet_role)


def lower(arm: Arm, thing: Thing, surface: float, hand: Array) -> Motion:
    """Lower a held object to where it is let go above a surface."""
    ahead, aside = arm.ahead(arm.position), arm.aside(arm.position)
    yield from arm.move(
        lambda: arm.point(ahead, aside, arm.position[2] + surface + LET_GO_OVER - thing.bottom),
        hand,
        tolerance=0.004,
        turn_tolerance=0.2,
        speed=0.35,
        steps=60,
        required=False,
    )


BELONGS_WITHIN = 0.135
"""Middle to middle of what is put down and what it belongs to, m: RoboCasa wants 15 cm, and the
hand stops within 1 cm."""
STILL_BELONGS = 0.142
"""Likewise where no place that is closer has room, m."""
GROUP_WITHIN = 0.30
"""Likewise for what only belongs to a group: nearer to one another than to the rest, m."""
DEPTHS = (0.02, 0.04, 0.06, 0.08, 0.10)
"""Free space between the front of the shelf and the object, m."""
PLACES = 25
"""Number of places along the shelf that are looked at."""
HAND_FROM_SIDE = 0.17
"""From the side of a cabinet to the middle of the hand, m: the palm is 10 cm wide to either side,
and the elbow swings out a little beyond."""
OFF_DOOR = 0.26
"""From the side of a cabinet to the middle of the base, m: elbow and forearm swing out to an open
door, and the hand reaches as far aside of the base."""
FINGER_END, PALM_END = 0.058, 0.105
"""From the grip point to the far side of an opening finger, and to the end of the palm, m."""
ENOUGH_ROOM = 0.02
"""Free space that is as good as more, m."""
APART_FROM_REST = 0.25
"""From the middle of what it does not belong to, m: what belongs to that finds room too."""
TALLER = 0.03
"""What is higher by more is as wide as its box at the height of the palm, m."""
BEFORE_NEXT = 0.015
"""From a thing that is put down in front of another one to that, m."""
TOP_BEFORE = 0.008
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


def place_on_shelf_beside(arm: Arm, role: str, cabinet_role: str, other_role: str) -> Motion:
    """Put a held object on the lowest shelf of an open cabinet, close to another object in it, and
    come down in front of the counter.

    Raises:
        SkillFailed: if there is no room.
    """
    cabinet, other, thing = Furniture(arm, cabinet_role), Thing(arm, other_role), Thing(arm, role)
    spot = spot_on_shelf(arm, thing, cabinet, other)
    yield from put_beside(arm, role, cabinet_role, spot)


def place_on_shelf_near(arm: Arm, role: str, cabinet_role: str, other_role: str) -> Motion:
    """Put a held object on the lowest shelf of an open cabinet, as near to another object in it as
    there is room for the hand, and come down in front of the counter.

    Raises:
        SkillFailed: if there is no room.
    """
    cabinet, other, thing = Furniture(arm, cabinet_role), Thing(arm, other_role), Thing(arm, role)
    spots = spots_on_shelf(arm, thing, cabinet, other, GROUP_WITHIN)
    best = max(spots, key=lambda s: (min(s.room, ENOUGH_ROOM), -s.away))
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
        return min((abs(spot.aside - arm.aside(t.centre)) for t in rest), default=APART_FROM_REST)

    spots = spots_on_shelf(arm, thing, cabinet, other, STILL_BELONGS)
    closer = [spot for spot in spots if spot.away < BELONGS_WITHIN]
    return max(
        closer or spots,
        key=lambda s: (min(s.room, ENOUGH_ROOM), min(apart(s), APART_FROM_REST), -s.away),
    )


def standing_on(arm: Arm, cabinet: Furniture, thing: Thing) -> list[Thing]:
    """What else stands on the lowest shelf of a cabinet."""
    pose, half = cabinet.interior()
    floor = pose[2] - half[2]
    return [t for t in other_things(arm, thing) if abs(t.bottom - floor) < 0.05]


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
    middle, reach = arm.aside(pose), half[0] - HAND_FROM_SIDE

    def room(aside: float, depth: float) -> float:
        """Least distance from the hand, and from the thing, to what stands there, m."""
        gaps = [math.inf]
        for t in standing:
            beside = abs(aside - arm.aside(t.centre)) - t.sides()[1][1] / 2.0
            beyond = t.extent_ahead()[0] - front - depth - radius
            past = past_palm(aside, depth, t)
            gaps.append(max(min(beside - FINGER_END, past), beyond - radius - BEFORE_NEXT))
        return min(gaps)

    def past_palm(aside: float, depth: float, t: Thing) -> float:
        """Of the palm, which comes after the fingers, nothing reaches beyond the grip point."""
        if t.height < thing.height - TALLER:
            return math.inf
        centre = front + depth + radius
        wide = t.sides()[1][1] / 2.0
        if t.height < thing.height + TALLER:
            before = arm.ahead(t.centre) - TOP_BEFORE - centre
        else:
            before = t.extent_ahead()[0] - centre
        return max(abs(aside - arm.aside(t.centre)) - wide - PALM_END, before)

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
