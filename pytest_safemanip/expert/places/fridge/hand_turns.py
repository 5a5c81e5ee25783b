"""How a hand may be turned to grip what lies between two shelves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.expert.places.fridge.compartment import Compartment, spans
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.base import NOTCH
from pytest_safemanip.expert.robot.hand import (
    FINGER_SIDE,
    FINGERTIP,
    GAP,
    GRIP_DEPTH,
    HAND,
    OPENING,
    PALM,
    TIPPED_FINGERTIP,
    finger_angle,
)
from pytest_safemanip.expert.robot.rotations import Array, fold
from pytest_safemanip.expert.world.things import Thing

TIPPED = (40.0, 44.0, 48.0, 52.0, 55.0)
"""Degrees from straight down with fingers that are level: below the upper shelf, straight ahead."""
STEEP = (0.0, 5.0, 10.0, 15.0, 20.0, 26.0)
"""Likewise with fingers that need not be level: from above, at any bearing."""
MOST_TURNED = 62.0
"""Degrees to either side that a hand with level fingers is turned: farther, the wrist is at a
wall."""
ROUND_BEARINGS = (-60.0, -45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0, 60.0)
"""Bearings for round things, of a hand with level fingers."""
ROLLED = (-60.0, -30.0, 0.0, 30.0, 60.0, 90.0)
"""Likewise rolled."""
ROUND_WITHIN = 0.003
"""By how much the sides of what is round differ at most, m."""
SLIM = 1.5
"""Length by width from which fingers may close askew: others they would hold by their corners."""
ASKEW = 0.072
"""Between fingers that close askew on a thing, m."""
SHARES = (0.0, -0.5, 0.5, -1.0, 1.0)
"""How far askew, as a share of what the fingers allow."""
OFFSETS = (0.0, 0.015, 0.03, 0.045)
"""How far before a thing's middle it may be gripped, m."""
FROM_END = 0.025
"""From the grip point to the near end of a thing at least, m."""
HIGHER = (0.0, 0.008)
"""How much higher it may be gripped, m: the palm then is higher over what stands beside it."""
SLID = (-0.024, -0.016, -0.008, 0.008, 0.016, 0.024)
"""How far from its middle along its long side a thing may be gripped from above, m: farther, it
turns between the fingers."""
WIDER = 0.010
"""How much wider than a thing the fingers open, m, to the nearest notch."""
THICK = 0.03
"""How much of a thing's height tipped fingers have between them at most, m."""
OFF_SHELF = FINGERTIP + 0.003
"""Likewise of fingers that are not level: 3 mm more, for the load gives way as they open."""
FINGER_TRAVEL_THICK = 0.018
"""Of a finger, along their travel, m."""
PALM_CLEAR = 0.004
"""Between the palm and the shelf, or the top of what is gripped, m."""


@dataclass(frozen=True)
class Turn:
    """How the hand is turned and how far open.

    Attributes:
        pitch: degrees from straight down.
        yaw: degrees about the vertical, of a hand with level fingers.
        roll: degrees about the approach, of one whose fingers need not be level.
        width: of what is between the fingers, along them, m.
        rolled: whether the fingers need not be level.
        offset: how far before a thing's middle it is gripped; rolled, how much higher, m.
        along: how far from its middle along its long side, m.
    """

    pitch: float
    yaw: float
    roll: float
    width: float
    rolled: bool
    offset: float
    along: float = 0.0

    @property
    def opening(self) -> float:
        """Between the fingers on the way there, m."""
        notch = NOTCH * OPENING
        return min(OPENING, notch * round((self.width + WIDER) / notch))


def turns(arm: Arm, thing: Thing) -> Iterator[Turn]:
    """How a hand may be turned to grip a thing by its middle, where nothing else is in its way."""
    (_, narrow), (_, long) = thing.sides()
    if _is_round(thing):
        for yaw in ROUND_BEARINGS:
            yield from _level(thing, yaw, narrow)
        for roll in ROLLED:
            yield from _rolled(thing, roll, narrow)
        return
    for axis, width in thing.sides():
        if width >= GAP:
            continue
        bearing = finger_angle(arm, axis)
        most = math.degrees(math.acos(min(1.0, width / ASKEW)))
        for share in SHARES if long > SLIM * width else SHARES[:1]:
            yaw = fold(fold(bearing, 90.0) + share * most, 90.0)
            if abs(yaw) < MOST_TURNED:
                yield from _level(thing, yaw, width / math.cos(math.radians(share * most)))
        yield from _rolled(thing, fold(bearing, 120.0), width)


def turns_off_middle(arm: Arm, thing: Thing) -> Iterator[Turn]:
    """Likewise from above, at either side of its middle."""
    (axis, width), (_, long) = thing.sides()
    if width >= GAP or _is_round(thing):
        return
    for along in SLID:
        if abs(along) <= long / 2.0 - FROM_END:
            yield from _rolled(thing, fold(finger_angle(arm, axis), 120.0), width, along)


def grip_point(thing: Thing, space: Compartment, turn: Turn, hand: Array) -> Array:
    """Where a hand (3, 3) grips a thing: as deep as palm and fingertips let it (3,)."""
    approach = hand[:, 2]
    if turn.rolled:
        point = thing.centre + turn.along * thing.sides()[1][0]
        point -= max(0.0, thing.reach(approach) - GRIP_DEPTH + turn.offset) * approach
        lower = (turn.width / 2.0 + FINGER_SIDE) * _slope(turn.pitch, turn.roll)
        point[2] = max(point[2], thing.bottom + OFF_SHELF + lower + turn.offset)
        return np.asarray(point)
    level = approach * (1.0, 1.0, 0.0) / np.linalg.norm(approach[:2])
    point = thing.centre - turn.offset * level
    under = -math.copysign(1.0, hand[2, 1]) * hand[:, 1]
    edge = HAND[1] * under - PALM * approach
    point[2] = max(
        thing.bottom + TIPPED_FINGERTIP, thing.centre[2], space.floor + PALM_CLEAR - edge[2]
    )
    extent = thing.reach(level) if _is_round(thing) else np.abs(level @ spans(thing)).sum()
    if -(edge @ level) < extent - turn.offset + PALM_CLEAR:
        point[2] = max(point[2], thing.highest + PALM_CLEAR - edge[2])
    return np.asarray(point)


def lowest(turn: Turn) -> float:
    """How far the fingers reach below the grip point, m."""
    tip = math.radians(turn.pitch)
    beside = turn.opening / 2.0 + FINGER_TRAVEL_THICK if turn.rolled else FINGER_SIDE
    return FINGERTIP * math.cos(tip) + beside * math.sin(tip)


def _is_round(thing: Thing) -> bool:
    (_, narrow), (_, long) = thing.sides()
    return long < narrow + ROUND_WITHIN


def _level(thing: Thing, yaw: float, width: float) -> Iterator[Turn]:
    if width > GAP:
        return
    most = max(0.0, thing.sides()[1][1] / 2.0 - FROM_END)
    for pitch in TIPPED:
        for offset in OFFSETS:
            if offset <= most:
                yield Turn(pitch, yaw, 0.0, width, rolled=False, offset=offset)


def _rolled(thing: Thing, roll: float, width: float, along: float = 0.0) -> Iterator[Turn]:
    for pitch in STEEP:
        slope = _slope(pitch, roll)
        across = width * math.sqrt(1.0 - slope**2) + min(thing.height, THICK) * slope
        if across <= GAP:
            for offset in HIGHER:
                yield Turn(pitch, 0.0, roll, across, True, offset, along)


def _slope(pitch: float, roll: float) -> float:
    """How much higher one finger is than the other, as a share of what is between them."""
    return math.sin(math.radians(pitch) * abs(math.sin(math.radians(roll))))
