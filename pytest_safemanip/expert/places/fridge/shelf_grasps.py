"""How a hand reaches what lies between two shelves: from above as far as the upper shelf lets it,
turned so that hand, wrist and forearm have room beside the walls and over what else stands there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.expert.places.fridge.compartment import (
    Compartment,
    Crowd,
    crowd,
    off_box,
    off_rod,
    spans,
)
from pytest_safemanip.expert.places.fridge.hand_turns import (
    FINGER_TRAVEL_THICK,
    Turn,
    grip_point,
    lowest,
    turns,
    turns_off_middle,
)
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.hand import FINGERTIP, HAND, OPENING, PALM, Grasp, hand_corners
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing

FLANGE, FLANGE_OFF = 0.204, 0.088
"""From the grip point back to the flange, and from there to the wrist's axis, m."""
LINK = 0.06
"""Radius of flange, wrist and forearm, m."""
TUBE, TUBE_OFF = 0.03, 0.08
"""Radius of what runs along the forearm on one side, and how far off its axis, m."""
FOREARM, TUBE_AT = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3), (0.06, 0.13, 0.2, 0.26)
"""Where on the forearm either is looked at, from the wrist, m."""
STAND, ELBOW_HEIGHT, SHOULDER = 0.40, 1.36, 1.03
"""Base to wrist; height of the elbow, over the base, and of the shoulder, m."""
ARM_REACH = 0.62
"""Shoulder to wrist at most, m."""
DOOR_ROOM = 0.28
"""From the open door to the middle of the base, m."""
DOOR_GAP = 0.01
"""From the open door to hand and arm on their way, m."""
AT_DOOR, AT_WALL, AT_EDGE = -0.10, -0.02, -0.03
"""From the front of the shelf where the left wall, the right one, and the shelves begin, m."""
WALLS, CEILING, OTHERS = 0.006, 0.006, -0.002
"""Room beside the walls, between the shelves and beside what else stands there at least, m: the
boxes around the fingers are wider than these by 2 mm."""
SURE = 0.002
"""Room beside others at which no finger comes down on one of them, m."""
LEAST_DEEP = 0.007
"""Depth of the grip point below the top at least, m."""
CLEAR_TOP = 0.008
"""How far above its top the fingertips come in, m."""
LEAST_RISE = 0.035
"""How far something is lifted at least, m."""
LOAD_OVER, LOAD_BESIDE = 0.014, 0.010
"""How far a load passes over, and beside, what else stands there, m."""
WAY_OUT = (0.0, 0.05, 0.10, 0.15, 0.2)
"""How far the hand has come when its way out is looked at, m."""
ENOUGH_BESIDE, ENOUGH_ABOVE, ENOUGH_OTHERS, ENOUGH_DEEP = 0.04, 0.03, 0.008, 0.02
"""Room beside the walls, between the shelves and beside what else stands there, and depth of the
grip point, that are as good as more, m."""
OTHERS_WORTH, DEEP_WORTH = 2.0, 0.5
"""What a metre of the last two is worth, in metres of room beside the walls."""
YAW_COST, LEFT_COST, PITCH_COST = 0.0003, 0.001, 0.0005
"""Likewise what a degree costs by which the hand is turned, more to the left, and by which it is
pitched with fingers that are not level."""
SHIFT_COST, RISE_COST, OFFSET_COST, HIGHER_COST, ALONG_COST = 0.1, 0.3, 0.3, 0.5, 0.2
"""Likewise what a metre costs by which it passes the door farther left, by which it rises, and by
which it grips before the middle, higher, or beside the middle."""
ROOM_ALONE = 0.05
"""Room beside others, if there are none, m."""


@dataclass(frozen=True)
class ShelfGrasp:
    """A grasp between two shelves.

    Attributes:
        grasp: the grip point, and how the hand is held.
        base: where the base stands (2,).
        straight: where a hand that is held so is straight before the base, to the left, m.
        rise: how far above the grip point the hand comes in and goes out, m.
        raised: how far the torso is raised, m.
        shift: how much farther to the left it passes the open door, m.
        others: room beside what else stands there, m.
        score: which is best.
    """

    grasp: Grasp
    base: Array
    straight: float
    rise: float
    raised: float
    shift: float
    others: float
    score: float


@dataclass(frozen=True)
class Bent:
    """Flange, wrist and elbow (3,), and where the base stands to the left, m."""

    flange: Array
    wrist: Array
    elbow: Array
    beside: float


def best_shelf_grasp(
    arm: Arm, thing: Thing, space: Compartment, raises: tuple[float, ...], like: str = ""
) -> ShelfGrasp | None:
    """How a thing is best gripped where it stands; None if the hand has no room.

    Args:
        arm: the arm.
        thing: what is gripped.
        space: where it stands.
        raises: how far the torso may be raised, m.
        like: role of what the hand may brush; empty if there is nothing.
    """
    others = crowd(arm, thing, space, like)
    over = others.top - thing.bottom + LOAD_OVER
    found: list[ShelfGrasp] = []
    for held in (turns(arm, thing), turns_off_middle(arm, thing)):
        found += [
            reach
            for turn in held
            for raised in raises
            for least in (LEAST_RISE, max(LEAST_RISE, over))
            if (reach := _shelf_grasp(arm, thing, space, others, turn, raised, least))
        ]
        best = max(found, key=lambda reach: reach.score, default=None)
        if best and best.others > SURE:
            break
    return best


def _shelf_grasp(
    arm: Arm,
    thing: Thing,
    space: Compartment,
    others: Crowd,
    turn: Turn,
    raised: float,
    least: float,
) -> ShelfGrasp | None:
    """The reach with a turn of the hand, with the torso raised and the hand rising by so much."""
    hand = arm.hand(turn.pitch, turn.roll, turn.yaw)
    point = grip_point(thing, space, turn, hand)
    deep = thing.highest - point[2]
    if deep < LEAST_DEEP:
        return None
    rise = max(least, deep + CLEAR_TOP + lowest(turn))
    bent = _bent(arm, space, point, hand, raised)
    if math.hypot(STAND, bent.wrist[2] + rise - SHOULDER - raised) > ARM_REACH:
        return None
    walls, ceiling, shift = _room(arm, space, point, hand, bent, rise)
    if walls < WALLS or ceiling < CEILING:
        return None
    grasp = Grasp(point, hand, turn.opening / OPENING)
    gap = _beside_others(arm, thing, others, grasp, bent, rise, shift)
    if gap <= OTHERS:
        return None
    # Fingers that are level hold a thing steadier, and a hand that is turned left meets the door.
    score = min(walls, ENOUGH_BESIDE) + min(ceiling, ENOUGH_ABOVE)
    score += OTHERS_WORTH * min(gap, ENOUGH_OTHERS)
    score += DEEP_WORTH * min(deep, ENOUGH_DEEP)
    score -= (
        YAW_COST * abs(turn.yaw)
        + LEFT_COST * max(0.0, turn.yaw)
        + SHIFT_COST * shift
        + RISE_COST * rise
    )
    if turn.rolled:
        score -= HIGHER_COST * turn.offset + PITCH_COST * turn.pitch
    else:
        score -= OFFSET_COST * turn.offset
    score -= ALONG_COST * abs(turn.along)
    return ShelfGrasp(
        grasp=grasp,
        base=arm.floor_point(arm.ahead(bent.wrist) - STAND, bent.beside),
        straight=bent.beside + FLANGE * arm.aside(hand[:, 2]),
        rise=rise,
        raised=raised,
        shift=shift,
        others=gap,
        score=score,
    )


def _bent(arm: Arm, space: Compartment, point: Array, hand: Array, raised: float) -> Bent:
    """How the arm is bent behind a hand (3, 3) at a grip point (3,)."""
    approach = hand[:, 2]
    flange = wrist = point - FLANGE * approach
    for _ in range(4):
        beside = max(arm.aside(wrist), space.door + DOOR_ROOM)
        elbow = arm.point(arm.ahead(wrist) - STAND, beside, ELBOW_HEIGHT + raised)
        way = (elbow - wrist) / np.linalg.norm(elbow - wrist)
        out = way - (way @ approach) * approach
        wrist = flange + FLANGE_OFF * out / np.linalg.norm(out)
    return Bent(flange, wrist, elbow, beside)


def _room(
    arm: Arm, space: Compartment, point: Array, hand: Array, bent: Bent, rise: float
) -> tuple[float, float, float]:
    """Room beside the walls and between the shelves, and how much farther to the left hand and arm
    pass the open door, m.
    """
    way = (bent.elbow - bent.wrist) / np.linalg.norm(bent.elbow - bent.wrist)
    side = np.cross(hand[:, 2], way)
    side *= TUBE_OFF / np.linalg.norm(side)
    outline = [(corner + point, 0.0) for corner in hand_corners(hand)]
    outline += [(at, LINK) for at in (bent.flange, (bent.flange + bent.wrist) / 2.0, bent.wrist)]
    outline += [(bent.wrist + far * way, LINK) for far in FOREARM]
    outline += [(bent.wrist + far * way + side, TUBE) for far in TUBE_AT]
    left = right = height = math.inf
    shift = 0.0
    for at, thick in outline:
        ahead, aside = arm.ahead(at) + thick - space.front, arm.aside(at)
        shift = max(shift, space.door + DOOR_GAP - aside + thick)
        if ahead > AT_EDGE:
            height = min(height, at[2] - thick - space.floor, space.ceiling - at[2] - thick - rise)
        if ahead > AT_DOOR:
            left = min(left, space.left - aside - thick)
        if ahead > AT_WALL:
            right = min(right, aside - thick - space.right)
    return min(right, left - shift), height, shift


def _beside_others(
    arm: Arm, thing: Thing, others: Crowd, grasp: Grasp, bent: Bent, rise: float, shift: float
) -> float:
    """Room between hand, arm and load and what else stands there, on their way in and out, m."""
    if not len(others.points):
        return ROOM_ALONE
    x, y, deep = HAND
    half = grasp.opening * OPENING / 2.0
    low = np.array((half, -FINGERTIP, -PALM))
    high = np.array((half + FINGER_TRAVEL_THICK, FINGERTIP, FINGERTIP))
    far = np.array((2.0 * half + FINGER_TRAVEL_THICK, 0.0, 0.0))
    palm = np.array((-x, -y, -PALM - deep)), np.array((x, y, -PALM))
    boxes = ((low, high), (low - far, high - far), palm)
    load = spans(thing)
    size = np.linalg.norm(load, axis=0)
    gaps = [ROOM_ALONE]
    ways = [(0.0, 0.0, 0.0), (0.5 * rise, 0.0, 0.0), (rise, 0.0, 0.0), (rise, 0.0, shift / 2.0)]
    for up, back, left in (*ways, *((rise, back, shift) for back in WAY_OUT)):
        come = np.append(left * arm.left - back * arm.forward, up)
        points = others.points - come
        local = (points - grasp.point) @ grasp.hand
        # The hand may push some of them: these are looked at by themselves.
        for mild in np.unique(others.pushed).tolist():
            some = others.pushed == mild
            gaps += [mild + off_box(local[some], *box) for box in boxes]
            rods = ((bent.flange, bent.wrist), (bent.wrist, bent.elbow))
            gaps += [mild + off_rod(points[some], *rod, LINK) for rod in rods]
        if up == rise:
            gaps.append(off_box((points - thing.centre) @ (load / size), -size, size) - LOAD_BESIDE)
    return min(gaps)
