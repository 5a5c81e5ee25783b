"""Kettles: picked up by the bow on top, put on a burner that is free."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.policies.scripted.base import CAREFUL
from pytest_safemanip.policies.scripted.carrying import hangs
from pytest_safemanip.policies.scripted.grasping import (
    MOST_YAW,
    Grasp,
    angle,
    come_in,
    fold,
    lift,
    reach,
)
from pytest_safemanip.policies.scripted.handles import STEADY
from pytest_safemanip.policies.scripted.picking import PLATE_PITCH
from pytest_safemanip.policies.scripted.putting import leave, set_down
from pytest_safemanip.policies.scripted.rims import overhung
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.standing import stand_before
from pytest_safemanip.policies.scripted.sweeping import before_others
from pytest_safemanip.policies.scripted.things import Furniture, Thing

BOW = 0.010
"""Grip point below the top of a kettle, m: the middle of its bow."""
BOW_OPEN = 0.7
"""Share of the full opening on the way to a bow: 2 cm of free space on both sides."""
FRONT = 0.15
"""How far in front of a bow, m, the hand comes down to its height: in below a wall cabinet, 45 cm
above the counter, with the wrist 30 cm above the hand."""
ENTRY = 0.06
"""Before the grip point along the approach, m, from where the hand goes straight: the fingertips
come in above the bow."""
BACK = 0.33
"""How far the base draws back before it drives along the stove, m: off what stands on it and what
hangs above."""
RISE = 0.05
"""How far it is lifted, m: a stove is as high as a counter, and something may hang above it."""
LONG = 500
"""Control steps for the way along a counter."""
ROLLED_PITCH = 12.0
"""Degrees from straight down for fingers that are not level: more, and the bow turns in them."""
TOUCH, ROOM = 0.12, 0.24
"""From a kettle's middle to what stands beside it, on its way to a burner too, m: body and spout
reach 10 cm, and it swings by 2 cm; and what is better where it is driven towards a vessel behind.
Vessels side by side in front have it.
"""
BESIDE = (0.0, 0.02, -0.02, 0.04, -0.04)
"""How far beside a burner's middle something may stand for what is beside it, m."""
NEARER = 0.03
"""How much nearer than a burner's middle it stands below a microwave, m: its handle stands out over
the front burners, 1 cm from a wrist above a kettle."""
DEEP = 0.15
"""So far behind the front of a microwave, m, the wrist above a kettle does not get."""


def hook(arm: Arm, role: str) -> Motion:
    """Pick up a kettle by its bow, which runs along its longer side.

    Raises:
        SkillFailed: if it was not lifted.
    """
    thing = Thing(arm, role)
    roll = fold(angle(arm, thing.sides()[0][0]), 120.0)
    yaw = fold(roll, 90.0)
    level = abs(yaw) <= MOST_YAW
    pitch = PLATE_PITCH if level else ROLLED_PITCH
    hand = arm.hand(pitch, yaw=yaw) if level else arm.hand(pitch, roll)
    yield from stand_before(arm, thing.middle, reach(pitch))
    point = np.append(thing.middle[:2], thing.highest - BOW)
    entry = point - ENTRY * hand[:, 2]
    yield from arm.open_to(BOW_OPEN)
    front = entry - np.append(FRONT * arm.forward, 0.0)
    yield from arm.move(front, hand, tolerance=0.02, turn_tolerance=0.08, steps=140)
    stops = ((ENTRY, 0.006, 0.8), (0.0, 0.006, 0.3))
    yield from come_in(arm, Grasp(point, hand, BOW_OPEN), stops, 0.06)
    yield from lift(arm, thing, hand, RISE)


def place_on_stove(arm: Arm, role: str, stove_role: str) -> Motion:
    """Put a held vessel on a stove's burner: of those with room, in front and the nearest.

    Raises:
        SkillFailed: if none has room, or hand or base does not get there.
    """
    spot = free_burner(arm, Thing(arm, role), Furniture(arm, stove_role))
    yield from bring_to_burner(arm, role, spot)
    yield from set_down(arm, role)
    yield from leave(arm)


def bring_to_burner(arm: Arm, role: str, spot: Array, most: float = math.inf) -> Motion:
    """Bring a held vessel over a burner, in low from the front.

    Args:
        arm: the arm.
        role: the vessel.
        spot: the burner (3,).
        most: how far ahead the base may come, m; the hand goes the rest.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    thing = Thing(arm, role)
    back = arm.ahead(arm.base) - BACK
    aside = arm.aside(arm.base) + arm.aside(spot) - arm.aside(thing.middle)
    into = min(most, arm.ahead(arm.base) + arm.ahead(spot) - arm.ahead(thing.middle))
    back = min(back, before_others(arm, thing, aside))
    for ahead, side in ((back, arm.aside(arm.base)), (back, aside)):
        yield from arm.drive(arm.floor_point(ahead, side), speed=CAREFUL, steps=LONG)
    low = raised(arm.position, min(0.0, float(spot[2]) + RISE - thing.bottom))
    yield from arm.move(low, speed=STEADY, tolerance=0.02)
    yield from arm.drive(arm.floor_point(into, aside), speed=CAREFUL)


def free_burner(arm: Arm, thing: Thing, stove: Furniture) -> Array:
    """Where on a burner (3,) there is most room; with room enough, in front, then on its middle,
    then with room to swing, near.

    Raises:
        SkillFailed: if there is room on none.
    """
    others = [Thing(arm, b.entity) for b in arm.scene.bodies if b.entity != thing.entity]

    def good(place: tuple[float, Array]) -> tuple[float, ...]:
        off, spot = place
        way = [spot[:2] - back * arm.forward for back in np.linspace(0.0, BACK, 12)]
        room = min((_gap(other, point) for other in others for point in way), default=ROOM)
        aside = abs(arm.aside(thing.middle) - arm.aside(spot))
        front = -round(arm.ahead(spot), 2)
        return min(room, TOUCH), front, -abs(off), min(room, ROOM), -aside

    return max(_places(arm, thing, stove), key=good)[1]


def _places(arm: Arm, thing: Thing, stove: Furniture) -> list[tuple[float, Array]]:
    """Where on its burners a held vessel could stand (3,), and how far to the left of the middle
    that is, m; the wrist above what hangs in the fingers is as high as what hangs over the stove.
    """
    number = arm.scene.boxes_of(stove.entity, "burner")
    spots = [np.asarray(arm.step.box_pose[k][:3], np.float64) for k in number]
    if hangs(arm, thing):
        nearer, high = NEARER * np.append(arm.forward, 0.0), float(arm.position[2]) - thing.bottom
        spots = [
            spot - nearer if overhung(arm, raised(spot, high)) else spot
            for spot in spots
            if not overhung(arm, raised(spot, high), DEEP)
        ]
    if not spots:
        raise SkillFailed(f"the hand has no room over {stove.entity}")
    aside = np.append(arm.left, 0.0)
    return [(off, spot + off * aside) for spot in spots for off in BESIDE]


def _gap(vessel: Thing, point: Array) -> float:
    """Distance on the level from a point (2,) to a round vessel and to its handle, which lies along
    the middle of its box, m.
    """
    (_, width), (axis, length) = vessel.sides()
    way = point - vessel.centre[:2]
    along = float(np.clip(way @ axis[:2], -length / 2.0, length / 2.0))
    body = float(np.linalg.norm(point - vessel.middle[:2])) - width / 2.0
    return min(body, float(np.linalg.norm(way - along * axis[:2])))
