"""Taking off a shelf of a wall cabinet what lies along it: near one end, by a hand that comes from
there, the torso raised.

From the front, level fingers would have to close along it, and it is longer than they open.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed
from pytest_safemanip.policies.scripted.carrying import BEFORE, come_down
from pytest_safemanip.policies.scripted.grasping import (
    GAP,
    PALM,
    Grasp,
    hand_corners,
)
from pytest_safemanip.policies.scripted.pans import ENTRY, come_before, room_beside, take_out
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.standing import HAND_ROOM
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.policies.scripted.torso import LIFTED
from pytest_safemanip.trace.geometry import corners

MOST_YAW = 78.0
"""Degrees to either side that the hand turns."""
PITCH = 40.0
"""Degrees from straight down, towards the thing's far end: more upright, the wrist meets the
cabinet."""
ASKEW = (0.0, 6.0, 12.0, 18.0)
"""By how much less than along it the hand may be turned, degrees: the wrist is less far beside the
thing."""
MOST_ASKEW, PAD = math.radians(30.0), 0.016
"""How far askew a thing is straightened by closing fingers, rad, and their pads' width, m."""
DEEP = 0.013
"""From the top of a thing down to the grip point, m: the pads, 16 mm wide, lie on its sides."""
OFF_PALM = 0.003
"""Free space between it and the palm, m."""
END = 0.015
"""From its end to the grip point at least, m."""
BACK_WALL = 0.005
"""Kept free between the palm and the back wall of a cabinet, m."""
SHIFT = 0.15
"""How far to the side that the hand comes from the base stands, m: so the wrist turns by less."""
OFF_DOOR = 0.19
"""From the side of the cabinet, and its open door, to the middle of the base, m."""
LOW_PITCH = 35.0
"""Degrees from straight down that the hand is pitched to then, below the cabinet."""


def pick_along_shelf(arm: Arm, role: str, cabinet_role: str) -> Motion:
    """Pinch something long that lies in an open cabinet, bring it out, and turn it and bring it
    down before the counter.

    Raises:
        SkillFailed: if there is no room, hand or base does not get there, or it was not lifted.
    """
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    grasp = from_an_end(arm, thing, cabinet)
    yield from before_doors(arm, cabinet)
    entry = grasp.point - ENTRY * grasp.hand[:, 2]
    base = beside(arm, cabinet, entry, grasp.hand)
    yield from come_before(arm, cabinet, entry, grasp.hand, base, LIFTED)
    yield from take_out(arm, thing, cabinet, grasp, LOW_PITCH)


def beside(arm: Arm, cabinet: Furniture, entry: Array, hand: Array) -> float:
    """Where the base stands along its left direction for a hand (3, 3) to come in at a point (3,):
    to the side that the hand comes from, the elbow off the open door there, m.
    """
    pose, half = cabinet.interior()
    side = arm.aside(hand[:, 2]) / float(np.linalg.norm(hand[:2, 2]))
    middle, room = arm.aside(pose), float(half[0]) - OFF_DOOR
    return float(np.clip(arm.aside(entry) - SHIFT * side, middle - room, middle + room))


def before_doors(arm: Arm, cabinet: Furniture) -> Motion:
    """Bring the hand before and below the open doors of a cabinet, from beside one of them."""
    doors = [corners(cabinet.part(joint), np.asarray(joint.half)) for joint in cabinet.doors()]
    near = min(arm.ahead(corner) for door in doors for corner in door)
    before = near - HAND_ROOM - max(BEFORE, arm.ahead(arm.position) - arm.ahead(arm.base))
    yield from arm.drive(arm.floor_point(min(before, arm.ahead(arm.base)), arm.aside(arm.base)))
    yield from come_down(arm)


def room_behind(arm: Arm, cabinet: Furniture, grasp: Grasp) -> float:
    """Free space between a gripping palm, which is 10 cm wide to either side, and the back wall of
    a cabinet, m.
    """
    pose, half = cabinet.interior()
    far = max(arm.ahead(corner) for corner in hand_corners(grasp.hand) + grasp.point)
    return float(arm.ahead(pose) + half[1] - far)


def from_an_end(arm: Arm, thing: Thing, cabinet: Furniture) -> Grasp:
    """How something long is pinched on a shelf: by a hand from that end of it beside which a
    cabinet has more room, as little askew as there is room for.

    Raises:
        SkillFailed: if there is none.
    """
    _, (long, _) = thing.sides()
    for askew in ASKEW:
        found = [end_grasp(arm, thing, way, askew) for way in (long, -long)]
        grasps = [g for g in found if g and room_behind(arm, cabinet, g) >= BACK_WALL]
        room = {room_beside(arm, cabinet, grasp): grasp for grasp in grasps}
        if room and max(room) >= 0.0:
            return room[max(room)]
    raise SkillFailed("there is no room for the hand beside it")


def end_grasp(arm: Arm, thing: Thing, way: Array, askew: float) -> Grasp | None:
    """How something is pinched near an end by a hand that is tipped and does not touch it with the
    palm; None if it does not fit between the fingers.

    Args:
        arm: the arm.
        thing: what is pinched.
        way: along its long side, from that end (3,).
        askew: how much less than along it the hand is turned, degrees.
    """
    (_, width), (_, length) = thing.sides()
    bearing = arm.bearing(way)
    turned = min(abs(bearing), MOST_YAW) - askew
    yaw = math.copysign(max(0.0, turned), bearing)
    off = math.radians(abs(bearing - yaw))
    if off > MOST_ASKEW or width / math.cos(off) + PAD * math.tan(off) > GAP:
        return None
    hand = arm.hand(PITCH, yaw=yaw)
    approach = hand[:, 2]
    high = thing.height / 2.0 - DEEP
    nearest = float(((thing.corners - thing.centre) @ approach).min())
    tip = math.radians(PITCH)
    back = (OFF_PALM - PALM - nearest - high * math.cos(tip)) / math.sin(tip)
    back = float(np.clip(back, 0.0, length / 2.0 - END))
    return Grasp(thing.centre - back * way + np.array((0.0, 0.0, high)), hand, 1.0)
