"""Taking something off the lowest shelf of an open wall cabinet."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed
from pytest_safemanip.policies.scripted.encircling import HANDLE, OFF_HANDLE, around, yaws_around
from pytest_safemanip.policies.scripted.grasping import PALM, Grasp, come_in, lift
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.standing import nearest
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.policies.scripted.torso import lift_torso

PITCHES = (50.0, 62.0)
"""Degrees from straight down for a hand that is straight ahead, and for one that is turned by 45
degrees: steeper, the arm is at the end of its reach; more level, the palm keeps the pads off the
middle of what they grip, which swings then."""
CUP_SIDES, JAR_SIDES = 45.0, 90.0
"""Degrees from one side on which the pads lie flat to the next. A pad on an edge is a hinge."""
OUTSIDE = 0.24
"""From the grip point to the front of the cabinet before the hand goes in, m: the palm's room."""
TUCKED = 0.45
"""Base to hand while the hand is raised between the open doors, m."""
INSIDE = 0.50
"""Base to hand inside the cabinet, m."""
ENTRY = 0.05
"""Before the grip point along the approach, m, from where the hand goes straight: the fingertips
come in above the rim."""
RISE, BACK = 0.045, 0.05
"""How far it is lifted off the shelf and drawn back meanwhile, m: stretched out, the arm does not
rise."""
KNUCKLES, HAND = 0.07, (0.10, 0.03)
"""From the grip point back to the middle of the hand, and its half width along the fingers' travel
and across, m."""
WRIST, WRIST_ROOM, ASIDE = 0.21, 0.20, 0.05
"""From the grip point back to the wrist, m; half of the wrist's width, the thickness of an open
door, by which it stands inside the cabinet's side, and 5 cm for it to lean in and the arm to sway;
how far aside of its way in the hand passes at most."""
SQUEEZE = 0.06
"""What a wrist may lack beside a door all the same, m: half of the room above is for swaying."""
ELBOW, LEAN = 0.30, 0.10
"""How far beside the base's middle the elbow and an open door's edge reach together, and how far
beside the hand the base can stand, m."""
GENTLY = 0.4
"""Speed at which what hangs by its rim hardly swings."""
FROM_ABOVE, LIFTED = ((0.17, 0.0), (0.0, 60.0), (0.16, 45.0)), 0.23
"""Where the torso is raised, from the front of the shelf to the grip point, m, with a hand turned
by so many degrees about the vertical to either side, and how far, m: from below, the forearm would
lie on the shelf's edge, and an arm that is stretched out to one side would not come back.
"""
FAR_TURNED = 70.0
"""Degrees to either side that a hand is turned for want of room: farther, it is across the arm."""
LOW = 1.15
"""Height at which the hand passes below a cabinet and its doors with a load, m."""


def pick_from_shelf(arm: Arm, role: str, cabinet_role: str) -> Motion:
    """Pinch something upright in an open cabinet, bring it out and down in front of the counter.

    Raises:
        SkillFailed: if it is too wide or too close to a side, or was not lifted.
    """
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    front, _ = cabinet.opening()
    grasp = with_room(arm, thing, cabinet)
    approach = grasp.hand[:, 2]
    entry = grasp.point - ENTRY * approach
    aside, in_front = arm.aside(entry), arm.ahead(arm.position) - (front - OUTSIDE)
    passing = aside + off_door(arm, cabinet, arm.aside(entry - WRIST * approach))
    # The hand passes sideways before what stands on the counter.
    start = min(front - OUTSIDE - TUCKED, arm.ahead(arm.base) - max(0.0, in_front))
    beside = aside + lean(arm, cabinet, aside)
    yield from arm.drive(arm.floor_point(start, arm.aside(arm.base)))
    yield from arm.drive(arm.floor_point(start, beside))
    raised = LIFTED if _from_above(arm, grasp, front) else 0.0
    yield from lift_torso(arm, raised)
    yield from arm.open_to(grasp.opening)
    before = arm.point(start + TUCKED, passing, entry[2])
    yield from arm.move(before, grasp.hand, tolerance=0.035, turn_tolerance=0.2, steps=140)
    inside = min(arm.ahead(grasp.point) - INSIDE, nearest(arm, beside, beside))
    yield from arm.drive(
        arm.floor_point(inside, beside),
        speed=0.5,
        until=lambda: arm.ahead(entry) - arm.ahead(arm.position) < 0.015,
    )
    speed = 0.3 if raised else 0.6
    back_in_line = [(ENTRY, 0.010, speed)] if passing != aside else []
    stops = (*back_in_line, (ENTRY / 2.0, 0.015, speed), (0.0, 0.006, speed / 2.0))
    yield from come_in(arm, grasp, stops, 0.08)
    yield from lift(arm, thing, grasp.hand, RISE, BACK)
    tucked = arm.point(arm.ahead(arm.base) + TUCKED, arm.aside(arm.position), arm.position[2])
    yield from arm.move(
        tucked, grasp.hand, tolerance=0.02, turn_tolerance=0.15, speed=GENTLY, steps=60
    )
    yield from arm.drive(arm.floor_point(start - BACK, beside), speed=GENTLY)
    yield from lift_torso(arm, -raised)
    low = np.append(arm.position[:2], LOW)
    yield from arm.move(
        low, grasp.hand, tolerance=0.03, turn_tolerance=0.15, speed=GENTLY, steps=140
    )


def _from_above(arm: Arm, grasp: Grasp, front: float) -> bool:
    """Whether a grasp is so deep, or so far turned, that the torso is raised for it."""
    deep, yaw = arm.ahead(grasp.point) - front, turned(arm, grasp.hand)
    return any(deep > far and yaw >= most for far, most in FROM_ABOVE)


def off_door(arm: Arm, cabinet: Furniture, wrist: float) -> float:
    """How far to the left a hand is to pass between the open doors for its wrist to stay off the
    nearer one, m.

    Args:
        arm: the arm.
        cabinet: whose doors are open.
        wrist: where the wrist would be, along the base's left direction, m.
    """
    short = short_of_door(arm, cabinet, wrist)
    off = wrist - arm.aside(cabinet.interior()[0])
    return -math.copysign(float(np.clip(short, 0.0, ASIDE)), off)


def short_of_door(arm: Arm, cabinet: Furniture, wrist: float) -> float:
    """How much room a wrist lacks beside the nearer of the open doors, m; arguments as above."""
    pose, half = cabinet.interior()
    return float(abs(wrist - arm.aside(pose)) + WRIST_ROOM - half[0])


def lean(arm: Arm, cabinet: Furniture, aside: float) -> float:
    """How far to the left of the hand the base is to stand for the elbow, between the open doors,
    to stay off the nearer one, m.

    Args:
        arm: the arm.
        cabinet: whose doors are open.
        aside: where the hand is, along the base's left direction, m.
    """
    pose, half = cabinet.interior()
    off = aside - arm.aside(pose)
    return -math.copysign(float(np.clip(abs(off) + ELBOW - half[0], 0.0, LEAN)), off)


def room_beside(arm: Arm, cabinet: Furniture, grasp: Grasp) -> float:
    """Free space between a gripping hand and the nearer side of a cabinet, m."""
    pose, half = cabinet.interior()
    knuckles = grasp.point - KNUCKLES * grasp.hand[:, 2]
    reach = np.abs(arm.left @ grasp.hand[:2, :2]) @ HAND
    return float(half[0] - abs(arm.aside(knuckles) - arm.aside(pose)) - reach)


def room_between(arm: Arm, thing: Thing, grasp: Grasp) -> float:
    """Free space between a gripping palm and what else stands there, as if that were round and
    had no handle, m.
    """
    gaps, palm = [math.inf], palm_points(grasp.hand) + grasp.point
    for body in arm.scene.bodies:
        other = Thing(arm, body.entity)
        beside = palm[(palm[:, 2] < other.highest) & (palm[:, 2] > other.bottom)]
        if other.entity != thing.entity and len(beside):
            away = np.linalg.norm(beside[:, :2] - other.middle[:2], axis=1).min()
            gaps.append(float(away) - other.sides()[0][1] / 2.0)
    return min(gaps)


def palm_points(hand: Array) -> Array:
    """Points of the near side of a palm (P, 3), from the grip point, m."""
    x, y = HAND
    along, across = np.meshgrid(np.linspace(-x, x, 21), np.linspace(-y, y, 7))
    points: Array = np.stack((along.ravel(), across.ravel(), np.full(along.size, -PALM)), axis=1)
    return points @ hand.T


def with_room(arm: Arm, thing: Thing, cabinet: Furniture) -> Grasp:
    """How something upright is gripped on a shelf: of what leaves hand and wrist room, what turns
    the hand least.

    Raises:
        SkillFailed: if it is too wide, or nothing does.
    """
    failures = []
    for grasp in off_the_shelf(arm, thing):
        approach = grasp.hand[:, 2]
        wrist = arm.aside(grasp.point - (ENTRY + WRIST) * approach)
        if room_beside(arm, cabinet, grasp) < 0.0 or room_between(arm, thing, grasp) < 0.0:
            failures.append("there is no room for the hand beside it")
        elif short_of_door(arm, cabinet, wrist) > ASIDE + SQUEEZE:
            failures.append("there is no room for the wrist beside the open door")
        else:
            return grasp
    raise SkillFailed(failures[0])


def off_the_shelf(arm: Arm, thing: Thing) -> list[Grasp]:
    """How something upright may be gripped on a shelf, at the height of the robot's shoulder; what
    turns the hand least comes first.

    Raises:
        SkillFailed: if it is too wide.
    """
    cup = np.linalg.norm((thing.centre - thing.middle)[:2]) > HANDLE * thing.height
    sides = CUP_SIDES if cup else JAR_SIDES
    least, *others = yaws_around(arm, thing, sides, OFF_HANDLE)
    yaws = [least, *(yaw for yaw in others if abs(yaw) < FAR_TURNED)]
    pitches = np.interp(np.abs(yaws), (0.0, 45.0), PITCHES).tolist()
    return [around(arm, thing, p, yaw=yaw) for p, yaw in zip(pitches, yaws, strict=True)]


def turned(arm: Arm, hand: Array) -> float:
    """How far a hand (3, 3) is turned from straight ahead about the vertical, degrees."""
    return abs(arm.bearing(hand[:, 2]))
