"""Bowls: where the fingers have room in one, two alike things of which one is grasped, two things
that are let go beside each other in it.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import cos, pi, radians, sin

import numpy as np

from pytest_safemanip.expert.motions.grasping import grasp_and_lift, narrow_roll
from pytest_safemanip.expert.motions.handles import LET_GO_BACK, LET_GO_RISE, TURN_BACK_REACH
from pytest_safemanip.expert.motions.putting import BRAKE, carry_over, held_over
from pytest_safemanip.expert.places.glass import (
    FINGER_FLARE,
    FINGER_HALF_WIDE,
    FINGERTIP_THICK,
    GLASS_PALM,
    HAND_OFF_RIM,
    TIPS_BELOW,
    palm_is_free,
)
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.robot.hand import (
    FINGERTIP,
    GRIP_DEPTH,
    HAND,
    OPENING,
    PALM,
    Grasp,
    finger_angle,
    reach_at,
)
from pytest_safemanip.expert.robot.rotations import Array, about_z, fold
from pytest_safemanip.expert.world.contacts import bears, touched
from pytest_safemanip.expert.world.rims import VESSEL_WALL
from pytest_safemanip.expert.world.standing import stand_before
from pytest_safemanip.expert.world.things import Thing, other_things
from pytest_safemanip.trace.planar import footprints_overlap

WALL_ROOM = 0.008
"""From what is let into a bowl to its wall, m: it hangs askew by some millimetres."""
ENDS = 0.004
"""Likewise for its ends, where it does not come to lie on the other thing, m: a bowl is not quite
round."""
NO_ENDS = 0.002
"""What is longer than wide by less is round, m, and has no ends."""
TIPPED = 0.33
"""From a bowl's middle to that of something long that leans in it, share of the way to the wall:
farther, it comes to lie higher than the rim."""
TIPS_OVER_RIM = 0.005
"""From a bowl's rim up to the fingertips that open over it, m: in it, they would jam."""
FALL = 0.045
"""Above a bowl's underside, m: nothing is let go higher."""
PAST_WALL_DROP = 0.010
"""What is so much lower than fingers over the rim would need takes them down past the wall, m."""
FINGER_ROOM, FINGERS_APART = 0.026, 0.006
"""From what such fingers hold to the wall, m: a finger is 14 mm thick; how far either opens, m."""
DRAWN_HEIGHT, PITCH = 1.2, 20.0
"""Height of the hand before the base afterwards, m, and its pitch, degrees."""
HEIGHT_WITHIN = 0.003
"""That height is met so well, m."""
SLOWLY = 0.1
"""Share of the hand's top speed at which it is lowered."""
STEPS = 120
FURTHER, MORE = 0.010, 15
"""Where it stops above that, how much lower it is sent, m, and for how many control steps: so near
to where it is sent, friction in the joints stops the arm up to 5 mm off it."""
LEVEL = np.array((1.0, 1.0, 0.0))
"""Takes the vertical part off a direction."""


def place_beside_in_bowl(arm: Arm, role: str, vessel_role: str, other_role: str) -> Motion:
    """Let something into a bowl, on one side of its middle: another thing has room on the other
    side, or lies there. The first is turned to lie as the other one is going to.

    Raises:
        SkillFailed: if the hand or the base does not get there.
    """
    thing, other, vessel = Thing(arm, role), Thing(arm, other_role), Thing(arm, vessel_role)
    away = float(np.linalg.norm((other.centre - vessel.middle)[:2]))
    if away < inner_radius(vessel):
        spot = beside_other(thing, other, vessel)
    else:
        turn = fold(heading(other.sides()[0][0]) - heading(thing.sides()[0][0]), 90.0)
        turned = about_z(turn) @ arm.rotation
        up = raised(arm.position, LET_GO_RISE)
        yield from arm.move(up, turned, tolerance=0.05, speed=0.6, steps=60, required=False)
        spot = on_far_side(arm, thing, other, vessel)
    yield from carry_over(arm, role, spot, vessel.highest + BRAKE)
    over = held_over(arm, thing, spot, thing.bottom)
    yield from arm.move(
        over, tolerance=HEIGHT_WITHIN, speed=0.3, steps=40, required=False, exact=True
    )
    yield from let_down(arm, thing, spot, vessel)
    yield from arm.move(raised(arm.position, LET_GO_RISE), tolerance=0.03, speed=0.5, steps=60)
    yield from arm.drive(arm.base - LET_GO_BACK * arm.forward)
    # Turned back over the next plate, the hand would swing down onto the counter.
    drawn = arm.before(TURN_BACK_REACH, DRAWN_HEIGHT)
    yield from arm.move(
        drawn, arm.hand(PITCH), tolerance=0.05, turn_tolerance=0.2, speed=0.5, required=False
    )


def let_down(arm: Arm, thing: Thing, spot: Array, vessel: Thing) -> Motion:
    """Lower what is held over a spot (3,) in a bowl and let it go."""
    hanging = float(arm.position[2]) - thing.bottom
    tips = vessel.highest + FINGERTIP + TIPS_OVER_RIM - hanging
    bottom = min(tips, vessel.bottom + FALL)
    low = tips - bottom > PAST_WALL_DROP
    if low:
        spot = inwards(thing, spot, vessel)
        over = held_over(arm, thing, spot, thing.bottom)
        yield from arm.move(
            over, tolerance=HEIGHT_WITHIN, speed=0.3, steps=40, required=False, exact=True
        )
    for lower, steps in ((bottom, STEPS), (bottom - FURTHER, MORE)):
        yield from arm.move(
            held_over(arm, thing, spot, lower),
            speed=SLOWLY,
            steps=steps,
            until=lambda: touched(arm, thing) or thing.bottom < bottom + HEIGHT_WITHIN,
            required=False,
        )
    if low:
        yield from arm.open_to((thing.sides()[0][1] + 2.0 * FINGERS_APART) / OPENING)
        up = raised(arm.position, tips - bottom)
        yield from arm.move(up, tolerance=HEIGHT_WITHIN, speed=0.3, steps=40, required=False)
    yield from arm.grip(False)


def inwards(thing: Thing, spot: Array, vessel: Thing) -> Array:
    """As a spot (3,) in a round vessel, but no nearer to the wall than leaves room for a finger."""
    off = inner_radius(vessel) - FINGER_ROOM - thing.sides()[0][1] / 2.0
    away = float(np.linalg.norm((spot - vessel.middle) * LEVEL))
    share = 1.0 if away < off else off / away
    return np.asarray(spot - (1.0 - share) * (spot - vessel.middle) * LEVEL)


def on_far_side(arm: Arm, thing: Thing, other: Thing, vessel: Thing) -> Array:
    """Where the first of two things goes in an empty bowl, lying as the other one does (3,)."""
    radius, side = inner_radius(vessel), other.sides()[0][0] * LEVEL
    (_, width), (axis, length) = thing.sides()
    off, along = off_middle(radius, width, length, ENDS), 0.0
    if length > 2.0 * radius:
        off, along = leaning(radius, width, length)
    across = math.copysign(off, arm.ahead(side)) * side
    return np.asarray(vessel.middle + across + along * axis * LEVEL)


def beside_other(thing: Thing, other: Thing, vessel: Thing) -> Array:
    """Where the second of two things goes, on the side of a bowl away from the first (3,)."""
    radius, side = inner_radius(vessel), thing.sides()[0][0] * LEVEL
    (_, width), (_, length) = thing.sides()
    away = float((vessel.middle - other.centre) @ side)
    off = off_middle(radius, width, length, ENDS)
    if off - width / 2.0 < other.reach(side) - abs(away):
        off = off_middle(radius, width, length)
    return np.asarray(vessel.middle + math.copysign(off, away) * side)


def inner_radius(vessel: Thing) -> float:
    """Of a round vessel, its handle left out, m."""
    return vessel.sides()[0][1] / 2.0 - VESSEL_WALL


def off_middle(radius: float, width: float, length: float, ends: float = 0.0) -> float:
    """How far from a round vessel's middle something may lie that is so wide and long and whose
    ends keep so far from the wall, m.
    """
    long = length if length - width > NO_ENDS else 0.0
    between = math.sqrt(max(0.0, (radius - ends) ** 2 - long**2 / 4.0))
    return max(0.0, min(radius - WALL_ROOM, between) - width / 2.0)


def leaning(radius: float, width: float, length: float) -> tuple[float, float]:
    """How far from the middle of a round vessel, across and along, something is let go that is
    longer than that is wide, m: level, it would lie on the rim; with one end just inside, its
    middle some way to the wall, it tips in and leans.
    """
    half = (length / 2.0 + WALL_ROOM) / (1.0 + TIPPED)
    across = math.sqrt(max(0.0, radius**2 - half**2)) - width / 2.0
    return max(0.0, across), TIPPED * half


def heading(way: Array) -> float:
    """Of a direction (3,), degrees about the vertical."""
    return math.degrees(math.atan2(way[1], way[0]))


BOWL_OFFSETS = (0.0, 0.012, -0.012, 0.024, -0.024, 0.036, -0.036, 0.045, -0.045)
"""How far from its middle a thing may be pinched, m: light ones do not turn in the fingers."""
BOWL_TURNS = (0.0, 12.0, -12.0, 24.0, -24.0)
"""Degrees from its narrow side: the closing fingers turn it."""
FINGER_GAPS = (
    (0.010, 0.0),
    (0.006, 0.0),
    (0.009, 0.003),
    (0.009, -0.003),
    (0.012, 0.006),
    (0.012, -0.006),
    (0.017, 0.011),
    (0.017, -0.011),
)
"""From an open finger to what it closes on, m, and how much less on one side than on the other."""
FINGER_HALF = (0.007, 0.010)
"""Half a finger's thickness, along its travel, and half its width, m."""
_ENDS = np.array(((-1.0, 0.0), (1.0, 0.0)))[:, None]
_OUTLINE = np.array([(i, j) for i in (-1.0, 0.0, 1.0) for j in (-1.0, 0.0, 1.0)])
"""The two fingers, and points of either, in terms of half its size."""
_PALM = np.array([(i * HAND[0], j * HAND[1]) for i in np.linspace(-1, 1, 9) for j in (-1, 0, 1)])
"""Points of the palm, from the grip point, m."""
_EIGHT = np.array([(cos(k * pi / 4.0), sin(k * pi / 4.0)) for k in range(8)])
"""Directions to the sides of an octagon: a stand-in's wall has eight."""
BOWL_WALL = 0.07
"""Thickness of a bowl's wall, share of its radius."""
PALM_OVER_RIM = 0.001
"""From the rim of a bowl to the palm over it, m: the fingers reach the middle of a sausage."""
ENOUGH = 0.006
"""Room around fingers and palm that is as good as more, m."""
HIGHER, OVERLAP = 0.010, 0.003
"""Middle above middle, and how far one is over the other, m, of what lies on something."""
ROLLED = 120.0
"""Roll at which the wrist comes to its end, degrees."""
WORSE, TURN_WORTH = 0.1, 0.001
"""What a metre off the middle is worth in room, and a degree in metres."""
UPWARDS = np.array((0.0, 0.0, 1.0))


@dataclass(frozen=True)
class BowlGrasp:
    """How a thing may be taken out of a bowl.

    Attributes:
        role: the thing.
        grasp: where and how the hand closes.
        room: around fingers and palm, m.
    """

    role: str
    grasp: Grasp
    room: float


class _Shadow:
    """A thing's box as seen from above.

    Args:
        thing: the thing, as it lies now.
    """

    def __init__(self, thing: Thing) -> None:
        self._middle = thing.centre[:2]
        axes = np.array([axis[:2] for axis, _ in thing.sides()]).T
        self._axes = axes / np.linalg.norm(axes, axis=0)
        self._half = np.abs((thing.corners[:, :2] - self._middle) @ self._axes).max(axis=0)
        self.top = thing.highest

    def away(self, points: Array) -> float:
        """How far the nearest of some points (K, 2) is from it, m; negative inside."""
        gaps = np.abs((points - self._middle) @ self._axes) - self._half
        return float(gaps.max(axis=1).min())


def best_bowl_grasp(
    arm: Arm, bowl: Thing, roles: Sequence[str], shut: Container[str] = ()
) -> BowlGrasp:
    """The way to the thing in a bowl that has most room; what lies on top comes first.

    Args:
        arm: the arm.
        bowl: the bowl.
        roles: what lies in it.
        shut: those of them that there is no way to.

    Raises:
        SkillFailed: if there is no way to any.
    """
    things = {role: Thing(arm, role) for role in roles}
    open_to = [role for role in roles if role not in shut]
    on_top = [
        role for role in open_to if not any(_lies_on(arm, o, things[role]) for o in things.values())
    ]
    found = [way for role in on_top or open_to for way in _bowl_grasps(arm, bowl, role)]
    if not found:
        raise SkillFailed("the fingers have no room beside what lies in the bowl")
    return max(found, key=lambda way: way.room)


def _lies_on(arm: Arm, upper: Thing, lower: Thing) -> bool:
    """Whether one thing lies on another, or over it, with an end at least."""
    higher = upper.centre[2] > lower.centre[2] + HIGHER
    over = higher and footprints_overlap(upper.corners, lower.corners, OVERLAP)
    return over or bears(arm, lower, upper)


def _bowl_grasps(arm: Arm, bowl: Thing, role: str) -> Iterable[BowlGrasp]:
    thing = Thing(arm, role)
    roll = narrow_roll(arm, thing)
    (_, width), (axis, _) = thing.sides()
    # Half of what it measures upwards where it is pinched, however it is turned about its length.
    half_high = thing.reach(UPWARDS - axis[2] * axis)
    others = [_Shadow(other) for other in other_things(arm, thing, bowl)]
    low = max(bowl.highest + PALM_OVER_RIM - PALM, thing.bottom + FINGERTIP)
    for turn in BOWL_TURNS:
        hand = arm.hand(0.0, fold(roll + turn, ROLLED))
        for off in BOWL_OFFSETS:
            middle = thing.centre + off * axis
            height = max(low, float(middle[2]) + half_high - GRIP_DEPTH)
            for beside, shift in FINGER_GAPS:
                opening = (width / cos(radians(turn)) + 2.0 * beside) / OPENING
                if opening > 1.0:
                    continue
                point = np.append((middle + shift * hand[:, 0])[:2], height)
                grasp = Grasp(point, hand, opening)
                worse = abs(off) + TURN_WORTH * abs(turn) + abs(shift)
                yield BowlGrasp(
                    role, grasp, min(_room(grasp, others, bowl), ENOUGH) - WORSE * worse
                )


def _room(grasp: Grasp, others: Iterable[_Shadow], bowl: Thing) -> float:
    """Least distance on the level from fingers to wall and things, and from the palm to what is
    higher than that, m; negative where they overlap.
    """
    point, flat = grasp.point, grasp.hand[:2, :2].T
    apart = grasp.opening * OPENING / 2.0 + FINGER_HALF[0]
    fingers = point[:2] + (_ENDS * apart + _OUTLINE * FINGER_HALF).reshape(-1, 2) @ flat
    palm = point[:2] + _PALM @ flat
    sides = np.array([axis[:2] for axis, _ in bowl.sides()])
    inner = bowl.sides()[0][1] / 2.0 * (1.0 - BOWL_WALL)
    room = inner - float(((fingers - bowl.middle[:2]) @ (_EIGHT @ sides).T).max())
    for other in others:
        if other.top > point[2] - FINGERTIP:
            room = min(room, other.away(fingers))
        if other.top > point[2] + PALM - PALM_OVER_RIM:
            room = min(room, other.away(palm))
    return room


BESIDE_SMALL = 0.004
"""From a small thing to each finger that comes down beside it, m."""
OVERSHOT = 0.06
"""Share of the full opening by which fingers that close to such a small one close farther."""
FINGER_FREE = 0.002
"""Kept free between a finger and another thing, m; a wall may be nearer by as much than a circle
would be: that of an octagon is so near in the middle of its sides only."""


def grasp_either_in_bowl(arm: Arm, role: str, other_role: str, bowl_role: str) -> Motion:
    """Take the one of two alike things out of a bowl beside which the fingers have more room.

    Raises:
        SkillFailed: if they have none beside either, or it was not lifted.
    """
    bowl, things = Thing(arm, bowl_role), (Thing(arm, role), Thing(arm, other_role))
    found = [
        (room, thing, grasp)
        for thing, other in (things, things[::-1])
        for room, grasp in ways(arm, thing, other, bowl)
    ]
    room, thing, grasp = max(found, key=lambda way: way[0])
    if room < -FINGER_FREE:
        raise SkillFailed("the fingers have no room beside either")
    yield from stand_before(arm, thing.centre, reach_at(0.0))
    yield from grasp_and_lift(arm, thing, grasp)


def ways(arm: Arm, thing: Thing, other: Thing, bowl: Thing) -> Iterator[tuple[float, Grasp]]:
    """How a thing may be gripped from straight above, with the room that the fingers then have
    beside them in the bowl, m.
    """
    # Its palm above the rim, the fingertips off the floor.
    height = max(
        thing.centre[2], bowl.highest + HAND_OFF_RIM - GLASS_PALM, thing.bottom + FINGERTIP
    )
    up = bowl.highest - (height - TIPS_BELOW)
    radius = bowl.sides()[0][1] / 2.0 - VESSEL_WALL
    for axis, width in thing.sides():
        apart = width / 2.0 + BESIDE_SMALL
        outer = apart + FINGERTIP_THICK + FINGER_FLARE * max(0.0, up)
        ends = [_finger_corners(thing, side * axis, apart, outer) for side in (-1.0, 1.0)]
        far = max(float(np.linalg.norm(p - bowl.middle[:2])) for end in ends for p in end[:, :2])
        meets = any(footprints_overlap(end, other.corners, 0.0) for end in ends)
        hand = arm.hand(0.0, fold(finger_angle(arm, axis), 120.0))
        grasp = Grasp(np.append(thing.centre[:2], height), hand, 2.0 * apart / OPENING + OVERSHOT)
        free = palm_is_free(arm, grasp.point, hand, bowl)
        yield radius - far if free and not meets else -1.0, grasp


def _finger_corners(thing: Thing, way: Array, inner: float, outer: float) -> Array:
    """Corners (4, 3) of a finger beside a thing, seen from above.

    Args:
        thing: the thing.
        way: from its middle to the finger (3,).
        inner: from its middle to the finger's inside, m.
        outer: likewise to its outside, m.
    """
    wide = (FINGER_HALF_WIDE + FINGER_FREE) * np.array((-way[1], way[0], 0.0))
    return np.array([thing.centre + k * way + s * wide for k in (inner, outer) for s in (-1, 1)])
