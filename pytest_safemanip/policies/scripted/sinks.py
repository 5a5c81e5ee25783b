"""Picking up from a basin: the palm needs room between its walls."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed
from pytest_safemanip.policies.scripted.grasping import (
    GAP,
    Grasp,
    across,
    hand_corners,
    reach,
    take,
)
from pytest_safemanip.policies.scripted.rotations import about_z
from pytest_safemanip.policies.scripted.standing import stand_before
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.trace.geometry import matrix

SINK_PITCH = 20.0
"""Degrees from straight down at the back of a basin: the hand goes in under the spout. Further to
the front it is steeper, for the arm to stay off the front wall."""
SPOUT = 0.05
"""From the middle of a basin to where the hand passes in front of the spout, m."""
ROOM = 0.010
"""Kept free around the palm, m: it arrives within 6 mm, and a hand that is 3 degrees askew has its
ends 5 mm elsewhere."""
ROUND = 1.6
"""Length by width up to which fingers that close aslant turn a thing between them."""
TURNS = (0.0, 15.0, -15.0, 30.0, -30.0, 45.0, -45.0, 60.0, -60.0, 75.0, -75.0, 90.0)
"""Of the fingers from a thing's narrow side, degrees, the least first."""
STEEPER = (0.0, 5.0, 10.0)
"""How much steeper than elsewhere in the basin the hand may be, degrees."""
ENDS = (0.0, 0.1, -0.1, 0.2, -0.2)
"""From the middle of a long thing to where it is held, shares of its length."""


def pick_from_basin(arm: Arm, role: str, sink_role: str) -> Motion:
    """Pinch an object in a sink, and bring it out in front of the spout.

    Raises:
        SkillFailed: if it is too wide, lies where the hand has no room, or was not lifted.
    """
    thing, sink = Thing(arm, role), Furniture(arm, sink_role)
    middle = arm.ahead(sink.interior()[0])
    deep = arm.ahead(thing.centre) - middle
    pitch = float(np.interp(deep, (-0.05, 0.03, 0.11), (-5.0, 10.0, SINK_PITCH)))
    grasp = roomy(arm, thing, sink, pitch)
    where = thing.centre
    yield from stand_before(arm, where, reach(pitch))
    above = arm.ahead(grasp.point) - 0.15 * math.sin(math.radians(pitch))
    front = arm.point(min(above, middle - 0.08), arm.aside(where), grasp.point[2] + 0.20)
    yield from arm.move(front, grasp.hand, tolerance=0.03, turn_tolerance=0.1, steps=120)
    yield from take(arm, thing, grasp, rise=0.05)
    ahead = min(arm.ahead(arm.position), middle - SPOUT)
    out = arm.point(ahead, arm.aside(arm.position), arm.position[2] + 0.18)
    yield from arm.move(out, tolerance=0.03, speed=0.6, steps=60)


def roomy(arm: Arm, thing: Thing, sink: Furniture, pitch: float) -> Grasp:
    """The first grasp in which the palm has room in the basin, else the one with most of it.

    Args:
        arm: the arm.
        thing: what lies in the basin.
        sink: the basin.
        pitch: of the hand, degrees, where there is room for it.

    Raises:
        SkillFailed: if it is too wide, or lies where the palm would touch a wall or the floor.
    """
    best, most = None, 0.0
    for grasp in _grasps(arm, thing, pitch):
        room = palm_room(grasp, sink)
        if room > most:
            best, most = grasp, room
        if room >= ROOM:
            break
    if best is None:
        raise SkillFailed("the hand has no room between the object and the walls of the basin")
    return best


def _grasps(arm: Arm, thing: Thing, pitch: float) -> Iterator[Grasp]:
    """Grasps of a thing, the one that holds it best first."""
    (axis, width), (_, length) = thing.sides()
    plump = length < ROUND * width
    for steeper in STEEPER:
        for turn in TURNS if plump else (0.0,):
            if turn and 2.0 * thing.reach(about_z(turn) @ axis) > GAP:
                continue
            for end in (0.0,) if plump else ENDS:
                yield across(arm, thing, pitch - steeper, end * length, turn)


def palm_room(grasp: Grasp, sink: Furniture) -> float:
    """From the palm, where the fingers close, to the basin's walls and floor, m; what is above the
    basin has all the room there is.
    """
    pose, half = sink.interior()
    palm = hand_corners(grasp.hand) + grasp.point - pose[:3]
    own = palm @ matrix(pose[3:])
    inside = own[own[:, 2] < half[2]]
    walls = (half[:2] - np.abs(inside[:, :2])).min(initial=math.inf)
    return float(min(walls, (inside[:, 2] + half[2]).min(initial=math.inf)))
