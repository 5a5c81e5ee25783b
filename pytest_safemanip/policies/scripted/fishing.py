"""Taking a small thing out of a bowl, beside another one: the palm stays above the rim."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed
from pytest_safemanip.policies.scripted.glasses import (
    BELOW,
    FLARE,
    HALF_WIDE,
    OFF_RIM,
    PALM,
    TIP,
    palm_is_free,
    slip_into,
)
from pytest_safemanip.policies.scripted.grasping import (
    FINGERTIP,
    OPEN,
    Grasp,
    angle,
    fold,
    reach,
    take,
)
from pytest_safemanip.policies.scripted.rims import WALL
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.standing import stand_before
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.trace.planar import footprints_overlap

BESIDE = 0.004
"""From a small thing to each finger that comes down beside it, m."""
OVERSHOT = 0.06
"""Share of the full opening by which fingers that close to such a small one close farther."""
FREE = 0.002
"""Kept free between a finger and another thing, m; a wall may be nearer by as much than a circle
would be: that of an octagon is so near in the middle of its sides only."""


def fish_from(arm: Arm, role: str, other_role: str, bowl_role: str) -> Motion:
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
    if room < -FREE:
        raise SkillFailed("the fingers have no room beside either")
    yield from stand_before(arm, thing.centre, reach(0.0))
    yield from take(arm, thing, grasp)


def slip_either_into(arm: Arm, role: str, other_role: str, glass_role: str) -> Motion:
    """Let the one of two alike things that is held into a glass, from straight above."""

    def off_hand(name: str) -> float:
        return float(np.linalg.norm(Thing(arm, name).centre - arm.position))

    yield from slip_into(arm, min(role, other_role, key=off_hand), glass_role)


def ways(arm: Arm, thing: Thing, other: Thing, bowl: Thing) -> Iterator[tuple[float, Grasp]]:
    """How a thing may be gripped from straight above, with the room that the fingers then have
    beside them in the bowl, m.
    """
    # Its palm above the rim, the fingertips off the floor.
    height = max(thing.centre[2], bowl.highest + OFF_RIM - PALM, thing.bottom + FINGERTIP)
    up = bowl.highest - (height - BELOW)
    radius = bowl.sides()[0][1] / 2.0 - WALL
    for axis, width in thing.sides():
        apart = width / 2.0 + BESIDE
        outer = apart + TIP + FLARE * max(0.0, up)
        ends = [_finger(thing, side * axis, apart, outer) for side in (-1.0, 1.0)]
        far = max(float(np.linalg.norm(p - bowl.middle[:2])) for end in ends for p in end[:, :2])
        meets = any(footprints_overlap(end, other.corners, 0.0) for end in ends)
        hand = arm.hand(0.0, fold(angle(arm, axis), 120.0))
        grasp = Grasp(np.append(thing.centre[:2], height), hand, 2.0 * apart / OPEN + OVERSHOT)
        free = palm_is_free(arm, grasp.point, hand, bowl)
        yield radius - far if free and not meets else -1.0, grasp


def _finger(thing: Thing, way: Array, inner: float, outer: float) -> Array:
    """Corners (4, 3) of a finger beside a thing, seen from above.

    Args:
        thing: the thing.
        way: from its middle to the finger (3,).
        inner: from its middle to the finger's inside, m.
        outer: likewise to its outside, m.
    """
    wide = (HALF_WIDE + FREE) * np.array((-way[1], way[0], 0.0))
    return np.array([thing.centre + k * way + s * wide for k in (inner, outer) for s in (-1, 1)])
