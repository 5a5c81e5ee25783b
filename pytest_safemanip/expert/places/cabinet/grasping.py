"""Taking something off the lowest shelf of an open wall cabinet: what stands upright, a cup whose
handle has to be pushed round first, what lies along the shelf.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.cup_grasps import (
    CUP_SIDES,
    HANDLE_SHARE,
    OFF_HANDLE,
    around,
    yaws_around,
)
from pytest_safemanip.expert.motions.grasping import lift
from pytest_safemanip.expert.motions.handles import handle, lug_length
from pytest_safemanip.expert.places.cabinet.doorway import (
    DRAW_BACK,
    TUCKED,
    go_in,
    go_out,
    in_the_way,
    room_behind,
    room_beside,
    room_between,
    short_of_door,
    way_in,
    wrist_aside,
)
from pytest_safemanip.expert.places.cabinet.pans import (
    ENTRY,
    come_before,
    grasp_and_bring_out,
    wrist_room_beside,
)
from pytest_safemanip.expert.places.cabinet.placing import DOWN_REACH, come_down
from pytest_safemanip.expert.robot.arm import GENTLY, Arm, Motion, SkillFailed
from pytest_safemanip.expert.robot.hand import GAP, PALM, Grasp, hand_corners
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.robot.torso import TORSO_LIFTED
from pytest_safemanip.expert.world.standing import HAND_ROOM
from pytest_safemanip.expert.world.things import Furniture, Thing

END_MOST_YAW = 78.0
"""Degrees to either side that the hand turns."""
LYING_PITCH = 40.0
"""Degrees from straight down, towards the thing's far end: more upright, the wrist meets the
cabinet."""
ASKEW = (0.0, 6.0, 12.0, 18.0)
"""By how much less than along it the hand may be turned, degrees: the wrist is less far beside the
thing."""
MOST_ASKEW, PAD = math.radians(30.0), 0.016
"""How far askew a thing is straightened by closing fingers, rad, and their pads' width, m."""
GRIP_DOWN = 0.013
"""From the top of a thing down to the grip point, m: the pads, 16 mm wide, lie on its sides."""
OFF_PALM = 0.003
"""Free space between it and the palm, m."""
OFF_END = 0.015
"""From its end to the grip point at least, m."""
BACK_WALL = 0.005
"""Kept free between the palm and the back wall of a cabinet, m."""
TOWARDS_HAND = 0.15
"""How far to the side that the hand comes from the base stands, m: so the wrist turns by less."""
BASE_OFF_DOOR = 0.19
"""From the side of the cabinet, and its open door, to the middle of the base, m."""
LOW_PITCH = 35.0
"""Degrees from straight down that the hand is pitched to then, below the cabinet."""


def grasp_end_on_shelf(arm: Arm, role: str, cabinet_role: str) -> Motion:
    """Pinch something long that lies in an open cabinet, bring it out, and turn it and bring it
    down before the counter.

    Raises:
        SkillFailed: if there is no room, hand or base does not get there, or it was not lifted.
    """
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    grasp = from_an_end(arm, thing, cabinet)
    yield from before_doors(arm, cabinet)
    entry = grasp.point - ENTRY * grasp.hand[:, 2]
    base = base_beside(arm, cabinet, entry, grasp.hand)
    yield from come_before(arm, cabinet, entry, grasp.hand, base, TORSO_LIFTED)
    yield from grasp_and_bring_out(arm, thing, cabinet, grasp, LOW_PITCH)


def base_beside(arm: Arm, cabinet: Furniture, entry: Array, hand: Array) -> float:
    """Where the base stands along its left direction for a hand (3, 3) to come in at a point (3,):
    to the side that the hand comes from, the elbow off the open door there, m.
    """
    pose, half = cabinet.interior()
    side = arm.aside(hand[:, 2]) / float(np.linalg.norm(hand[:2, 2]))
    middle, room = arm.aside(pose), float(half[0]) - BASE_OFF_DOOR
    return float(np.clip(arm.aside(entry) - TOWARDS_HAND * side, middle - room, middle + room))


def before_doors(arm: Arm, cabinet: Furniture) -> Motion:
    """Bring the hand before and below the open doors of a cabinet, from beside one of them."""
    before = (
        cabinet.door_front()
        - HAND_ROOM
        - max(DOWN_REACH, arm.ahead(arm.position) - arm.ahead(arm.base))
    )
    yield from arm.drive(arm.floor_point(min(before, arm.ahead(arm.base)), arm.aside(arm.base)))
    yield from come_down(arm)


def room_behind_palm(arm: Arm, cabinet: Furniture, grasp: Grasp) -> float:
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
        grasps = [g for g in found if g and room_behind_palm(arm, cabinet, g) >= BACK_WALL]
        room = {wrist_room_beside(arm, cabinet, grasp): grasp for grasp in grasps}
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
    turned = min(abs(bearing), END_MOST_YAW) - askew
    yaw = math.copysign(max(0.0, turned), bearing)
    off = math.radians(abs(bearing - yaw))
    if off > MOST_ASKEW or width / math.cos(off) + PAD * math.tan(off) > GAP:
        return None
    hand = arm.hand(LYING_PITCH, yaw=yaw)
    approach = hand[:, 2]
    high = thing.height / 2.0 - GRIP_DOWN
    nearest = float(((thing.corners - thing.centre) @ approach).min())
    tip = math.radians(LYING_PITCH)
    back = (OFF_PALM - PALM - nearest - high * math.cos(tip)) / math.sin(tip)
    back = float(np.clip(back, 0.0, length / 2.0 - OFF_END))
    return Grasp(thing.centre - back * way + np.array((0.0, 0.0, high)), hand, 1.0)


HANDLE_ASIDE = (55.0, 125.0)
"""Degrees from the base's forward direction to a handle that is pushed round."""
HANDLE_AWAY = 42.0
"""Likewise until it is: a hand that comes straight then has a finger to either side of it."""
PUSH_PITCH, PUSH_YAW = 62.0, 60.0
"""Of the hand that pushes, degrees from straight down, and about the vertical to the cup: the palm
stays off the cup while the handle goes round."""
BAR, LEAST_LUG = 0.008, 0.02
"""From the far end of a handle to where it is pushed, and how long it is at least, m."""
BEFORE_HANDLE, PUSH_BEYOND = 0.022, 0.020
"""From there to the farther one of the open fingers before it touches it, and how far beyond it
that one aims to push, m."""
OUTER_FINGER = 0.054
"""From the grip point to the outer side of an open finger, m."""
ROOM_BESIDE, ROOM_BEHIND = 0.04, 0.08
"""Free space that the palm needs where it begins: on its way in, beside what stands there; on its
way round, before a cabinet's back, m."""
MOST_SHORT = 0.05
"""What the wrist of a hand that comes straight then may lack beside an open door, m: with 8 cm, the
forearm met it with 227 N."""
PUSHING = 0.25
"""Share of the hand's top speed meanwhile."""
OFF_HANDLE_BACK, DRAWN_OUT = 0.04, 0.08
"""How far the hand draws back from the handle, and then along its own direction, m."""


def grasp_turned_first(arm: Arm, role: str, cabinet_role: str) -> Motion:
    """Pinch something upright in an open cabinet and bring it out; a cup that there is no room to
    grip as it stands is turned first.

    Raises:
        SkillFailed: if there is no room, or it was not lifted.
    """
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    pushing = push_grasp(arm, cabinet, thing)
    if pushing and not grasp_with_room(arm, cabinet, thing):
        yield from push_handle(arm, cabinet, thing, pushing)
    yield from grasp_on_shelf(arm, role, cabinet_role)


def in_reach(arm: Arm, role: str, cabinet_role: str) -> bool:
    """Whether there is room to grip something upright in an open cabinet, or to turn it first."""
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    return bool(grasp_with_room(arm, cabinet, thing) or push_grasp(arm, cabinet, thing))


def push_grasp(arm: Arm, cabinet: Furniture, thing: Thing) -> Grasp | None:
    """Where and how the open hand begins to push a cup's handle, which points to one side, away
    from the robot, with its farther finger: both fingers of a closed hand would press on it. None
    if the handle points elsewhere, or the hand has no room beside the cup, now or then.
    """
    straight = Grasp(thing.middle, arm.hand(PUSH_PITCH), 1.0)
    beside_door = short_of_door(arm, cabinet, wrist_aside(arm, straight)) > MOST_SHORT
    if lug_length(thing) < LEAST_LUG or room_beside(arm, cabinet, straight) < 0.0 or beside_door:
        return None
    bearing = arm.bearing(handle(thing)[1])
    hand = arm.hand(PUSH_PITCH, yaw=-math.copysign(PUSH_YAW, bearing))
    grasp = Grasp(before_end(arm, thing, BEFORE_HANDLE) - to_finger(arm, hand), hand, 1.0)
    tight = (
        room_between(arm, thing, grasp) < ROOM_BESIDE
        or room_behind(arm, cabinet, grasp) < ROOM_BEHIND
    )
    sideways = HANDLE_ASIDE[0] < abs(bearing) < HANDLE_ASIDE[1]
    return grasp if sideways and not tight and not in_the_way(arm, cabinet, thing, grasp) else None


def push_handle(arm: Arm, cabinet: Furniture, thing: Thing, grasp: Grasp) -> Motion:
    """Push a cup's handle away from the robot until it points ahead more than aside.

    Args:
        arm: the arm.
        cabinet: where the cup stands.
        thing: the cup.
        grasp: how the hand begins.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    hand, way = grasp.hand, way_in(arm, cabinet, grasp)

    def pushing() -> Array:
        return before_end(arm, thing, -PUSH_BEYOND) - to_finger(arm, hand)

    def done() -> bool:
        return abs(arm.bearing(handle(thing)[1])) < HANDLE_AWAY

    yield from go_in(arm, grasp, way)
    yield from arm.grip(False, 2)
    yield from arm.move(pushing, hand, speed=PUSHING, steps=100, until=done, required=False)
    for away in (np.append(arm.forward, 0.0) * OFF_HANDLE_BACK, hand[:, 2] * DRAWN_OUT):
        yield from arm.move(
            arm.position - away, hand, tolerance=0.01, speed=0.5, steps=40, required=False
        )
    yield from go_out(arm, way)


def to_finger(arm: Arm, hand: Array) -> Array:
    """From the grip point to the outer side of the farther one of the open fingers (3,), m."""
    return np.asarray(hand[:, 0] * math.copysign(OUTER_FINGER, arm.ahead(hand[:, 0])), np.float64)


def before_end(arm: Arm, thing: Thing, back: float) -> Array:
    """The point (3,) so far before the end of a cup's handle, m, along the way that the end goes
    when it is pushed away from the robot; half as high as the cup.
    """
    root, way = handle(thing)
    onward = np.append(arm.forward, 0.0)
    onward -= (onward @ way) * way
    end = root + (lug_length(thing) - BAR) * way - back * onward / np.linalg.norm(onward)
    return np.append(end[:2], thing.middle[2])


PITCHES = (50.0, 62.0)
"""Degrees from straight down for a hand that is straight ahead, and for one that is turned by 45
degrees: steeper, the arm is at the end of its reach; more level, the palm keeps the pads off the
middle of what they grip, which swings then."""
STEEP = 47.0
"""Of a hand that has no room otherwise, with the torso raised: its palm passes over what is lower,
and its wrist is less far aside. At 39 degrees, the wrist meets the next shelf."""
JAR_SIDES = 90.0
"""From one flat side of a jar to the next, degrees: a pad on an edge is a hinge."""
FAR_TURNED = 70.0
"""Degrees to either side that a hand is turned for want of room: farther, it is across the arm."""
SHELF_RISE = 0.045
"""How far something is lifted off the shelf, m."""
LOW_UNDER_CABINET = 1.15
"""Height at which the hand passes below a cabinet and its doors with a load, m."""


def grasp_on_shelf(arm: Arm, role: str, cabinet_role: str) -> Motion:
    """Pinch something upright in an open cabinet, bring it out and down in front of the counter.

    Raises:
        SkillFailed: if it is too wide or too close to a side, or was not lifted.
    """
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    found = grasp_with_room(arm, cabinet, thing)
    if not found:
        obstacle = in_the_way(arm, cabinet, thing, off_the_shelf(arm, thing)[0])
        raise SkillFailed(f"there is no room for {obstacle}")
    grasp, steep = found
    way = way_in(arm, cabinet, grasp, steep)
    yield from go_in(arm, grasp, way)
    yield from lift(arm, thing, grasp.hand, SHELF_RISE, DRAW_BACK)
    tucked = arm.point(arm.ahead(arm.base) + TUCKED, arm.aside(arm.position), arm.position[2])
    yield from arm.move(
        tucked, grasp.hand, tolerance=0.02, turn_tolerance=0.15, speed=GENTLY, steps=60
    )
    yield from go_out(arm, way)
    low = np.append(arm.position[:2], LOW_UNDER_CABINET)
    yield from arm.move(
        low, grasp.hand, tolerance=0.03, turn_tolerance=0.15, speed=GENTLY, steps=140
    )


def grasp_with_room(arm: Arm, cabinet: Furniture, thing: Thing) -> tuple[Grasp, bool] | None:
    """How something upright is gripped on a shelf: of what leaves hand and wrist room, what turns
    the hand least; and whether that is so steep that the torso has to be raised. None if nothing
    does.

    Raises:
        SkillFailed: if it is too wide.
    """
    for pitch in (None, STEEP):
        for grasp in off_the_shelf(arm, thing, pitch):
            if not in_the_way(arm, cabinet, thing, grasp):
                return grasp, pitch is not None
    return None


def off_the_shelf(arm: Arm, thing: Thing, pitch: float | None = None) -> list[Grasp]:
    """How something upright may be gripped on a shelf, at the height of the robot's shoulder; what
    turns the hand least comes first.

    Args:
        arm: the arm.
        thing: what is gripped.
        pitch: of the hand, degrees from straight down; None for what an arm reaches best whose
            torso is not raised.

    Raises:
        SkillFailed: if it is too wide.
    """
    cup = np.linalg.norm((thing.centre - thing.middle)[:2]) > HANDLE_SHARE * thing.height
    sides = CUP_SIDES if cup else JAR_SIDES
    least, *others = yaws_around(arm, thing, sides, OFF_HANDLE)
    yaws = [least, *(yaw for yaw in others if abs(yaw) < FAR_TURNED)]
    usual = np.interp(np.abs(yaws), (0.0, 45.0), PITCHES).tolist()
    pitches = usual if pitch is None else [pitch] * len(yaws)
    return [around(arm, thing, p, yaw=yaw) for p, yaw in zip(pitches, yaws, strict=True)]
