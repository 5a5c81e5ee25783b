"""Ways to what lies in a wide bowl: where the fingers have room, the palm over the rim."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from math import cos, pi, radians, sin

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, SkillFailed
from pytest_safemanip.policies.scripted.grasping import (
    FINGER,
    FINGERTIP,
    HAND,
    OPEN,
    PALM,
    Grasp,
    fold,
    narrow_roll,
)
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.policies.scripted.touching import bears
from pytest_safemanip.trace.planar import footprints_overlap

ALONG = (0.0, 0.012, -0.012, 0.024, -0.024, 0.036, -0.036, 0.045, -0.045)
"""How far from its middle a thing may be pinched, m: light ones do not turn in the fingers."""
TURNS = (0.0, 12.0, -12.0, 24.0, -24.0)
"""Degrees from its narrow side: the closing fingers turn it."""
BESIDE = (
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
WALL = 0.07
"""Thickness of a bowl's wall, share of its radius."""
OVER_RIM = 0.001
"""From the rim of a bowl to the palm over it, m: the fingers reach the middle of a sausage."""
ENOUGH = 0.006
"""Room around fingers and palm that is as good as more, m."""
HIGHER, OVERLAP = 0.010, 0.003
"""Middle above middle, and how far one is over the other, m, of what lies on something."""
ROLLED = 120.0
"""Roll at which the wrist comes to its end, degrees."""
WORSE, TURNED = 0.1, 0.001
"""What a metre off the middle is worth in room, and a degree in metres."""
UP = np.array((0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Reach:
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


def best_reach(arm: Arm, bowl: Thing, roles: Sequence[str], shut: Container[str] = ()) -> Reach:
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
    found = [way for role in on_top or open_to for way in _reaches(arm, bowl, role)]
    if not found:
        raise SkillFailed("the fingers have no room beside what lies in the bowl")
    return max(found, key=lambda way: way.room)


def _lies_on(arm: Arm, upper: Thing, lower: Thing) -> bool:
    """Whether one thing lies on another, or over it, with an end at least."""
    higher = upper.centre[2] > lower.centre[2] + HIGHER
    over = higher and footprints_overlap(upper.corners, lower.corners, OVERLAP)
    return over or bears(arm, lower, upper)


def _reaches(arm: Arm, bowl: Thing, role: str) -> Iterable[Reach]:
    thing = Thing(arm, role)
    roll = narrow_roll(arm, thing)
    (_, width), (axis, _) = thing.sides()
    # Half of what it measures upwards where it is pinched, however it is turned about its length.
    half_high = thing.reach(UP - axis[2] * axis)
    others = [
        _Shadow(Thing(arm, body.entity))
        for body in arm.scene.bodies
        if body.entity not in (thing.entity, bowl.entity)
    ]
    low = max(bowl.highest + OVER_RIM - PALM, thing.bottom + FINGERTIP)
    for turn in TURNS:
        hand = arm.hand(0.0, fold(roll + turn, ROLLED))
        for off in ALONG:
            middle = thing.centre + off * axis
            height = max(low, float(middle[2]) + half_high - FINGER)
            for beside, shift in BESIDE:
                opening = (width / cos(radians(turn)) + 2.0 * beside) / OPEN
                if opening > 1.0:
                    continue
                point = np.append((middle + shift * hand[:, 0])[:2], height)
                grasp = Grasp(point, hand, opening)
                worse = abs(off) + TURNED * abs(turn) + abs(shift)
                yield Reach(role, grasp, min(_room(grasp, others, bowl), ENOUGH) - WORSE * worse)


def _room(grasp: Grasp, others: Iterable[_Shadow], bowl: Thing) -> float:
    """Least distance on the level from fingers to wall and things, and from the palm to what is
    higher than that, m; negative where they overlap.
    """
    point, flat = grasp.point, grasp.hand[:2, :2].T
    apart = grasp.opening * OPEN / 2.0 + FINGER_HALF[0]
    fingers = point[:2] + (_ENDS * apart + _OUTLINE * FINGER_HALF).reshape(-1, 2) @ flat
    palm = point[:2] + _PALM @ flat
    sides = np.array([axis[:2] for axis, _ in bowl.sides()])
    inner = bowl.sides()[0][1] / 2.0 * (1.0 - WALL)
    room = inner - float(((fingers - bowl.middle[:2]) @ (_EIGHT @ sides).T).max())
    for other in others:
        if other.top > point[2] - FINGERTIP:
            room = min(room, other.away(fingers))
        if other.top > point[2] + PALM - OVER_RIM:
            room = min(room, other.away(palm))
    return room
