"""The way of hand and base in between the open doors of a wall cabinet, and the room for them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.expert.motions.grasping import come_in
from pytest_safemanip.expert.robot.arm import GENTLY, Arm, Motion
from pytest_safemanip.expert.robot.hand import PALM, WRIST, Grasp
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.robot.torso import TORSO_LIFTED, lift_torso
from pytest_safemanip.expert.world.standing import nearest
from pytest_safemanip.expert.world.things import Furniture, Thing, other_things

OUTSIDE = 0.24
"""From the grip point to the front of the cabinet before the hand goes in, m: the palm's room."""
TUCKED = 0.45
"""Base to hand while the hand is raised between the open doors, m."""
INSIDE = 0.50
"""Base to hand inside the cabinet, m."""
ENTRY = 0.05
"""Before the grip point along the approach, m, from where the hand goes straight: the fingertips
come in above the rim."""
DRAW_BACK = 0.05
"""How far an arm that is stretched out draws back while it rises, m: it rises no other way."""
KNUCKLES, HALF_HAND = 0.07, (0.10, 0.03)
"""From the grip point back to the middle of the hand, and its half width along the fingers' travel
and across, m."""
WRIST_ROOM, ASIDE = 0.20, 0.05
"""Half of the wrist's width, the thickness of an open
door, by which it stands inside the cabinet's side, and 5 cm for it to lean in and the arm to sway;
how far aside of its way in the hand passes at most."""
SQUEEZE = 0.06
"""What a wrist may lack beside a door all the same, m: half of the room above is for swaying."""
ELBOW, LEAN = 0.30, 0.10
"""How far beside the base's middle the elbow and an open door's edge reach together, and how far
beside the hand the base can stand, m."""
STOPPED = 0.015
"""How far beyond a cabinet's back a palm may be, m: it stops there and presses with 50 N, and the
fingers still close around a cup's middle. From 2 cm on, it was 100 N.
"""
FROM_ABOVE = ((0.17, 0.0), (0.0, 60.0), (0.16, 45.0))
"""Where the torso is raised: from the front of the shelf to the grip point, m, with a hand turned
by so many degrees about the vertical to either side. From below, the forearm would lie on the
shelf's edge, and an arm that is stretched out to one side would not come back.
"""


def in_the_way(arm: Arm, cabinet: Furniture, thing: Thing, grasp: Grasp) -> str:
    """What of the hand has no room between the sides, the open doors and what else stands there;
    empty if it has.
    """
    if room_beside(arm, cabinet, grasp) < 0.0 or room_between(arm, thing, grasp) < 0.0:
        return "the hand beside it"
    if room_behind(arm, cabinet, grasp) < -STOPPED:
        return "the hand before the cabinet's back"
    if short_of_door(arm, cabinet, wrist_aside(arm, grasp)) > ASIDE + SQUEEZE:
        return "the wrist beside the open door"
    return ""


def wrist_aside(arm: Arm, grasp: Grasp) -> float:
    """Where the wrist is along the base's left direction before the hand goes straight, m."""
    approach = grasp.hand[:, 2]
    return arm.aside(grasp.point - ENTRY * approach - WRIST * approach)


@dataclass(frozen=True)
class DoorwayPath:
    """A way in between open doors: coordinates ahead and to the left of the world's origin, along
    the base's directions.

    Attributes:
        start: where the base stands before the doors, ahead, m.
        beside: where it stands all the while, to the left, m.
        aside: likewise where the hand goes in, m.
        passing: likewise where it passes between the doors, m.
        raised: how far the torso is raised, m.
    """

    start: float
    beside: float
    aside: float
    passing: float
    raised: float


def way_in(arm: Arm, cabinet: Furniture, grasp: Grasp, steep: bool = False) -> DoorwayPath:
    """The way on which base and hand go to a grip point in a cabinet, with the torso raised if the
    hand is steep.
    """
    front, _ = cabinet.opening()
    entry = grasp.point - ENTRY * grasp.hand[:, 2]
    aside, in_front = arm.aside(entry), arm.ahead(arm.position) - (front - OUTSIDE)
    return DoorwayPath(
        # The hand passes sideways before what stands on the counter.
        start=min(front - OUTSIDE - TUCKED, arm.ahead(arm.base) - max(0.0, in_front)),
        beside=aside + lean(arm, cabinet, aside),
        aside=aside,
        passing=aside + off_door(arm, cabinet, wrist_aside(arm, grasp)),
        raised=TORSO_LIFTED if steep or from_above(arm, grasp, front) else 0.0,
    )


def from_above(arm: Arm, grasp: Grasp, front: float) -> bool:
    """Whether a grasp is so deep, or so far turned, that the torso is raised for it."""
    deep, yaw = arm.ahead(grasp.point) - front, turned(arm, grasp.hand)
    return any(deep > far and yaw >= most for far, most in FROM_ABOVE)


def go_in(arm: Arm, grasp: Grasp, way: DoorwayPath) -> Motion:
    """Bring the hand to a grip point in a cabinet.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    entry, beside = grasp.point - ENTRY * grasp.hand[:, 2], way.beside
    yield from arm.drive(arm.floor_point(way.start, arm.aside(arm.base)))
    yield from arm.drive(arm.floor_point(way.start, beside))
    yield from lift_torso(arm, way.raised)
    yield from arm.open_to(grasp.opening)
    before = arm.point(way.start + TUCKED, way.passing, entry[2])
    yield from arm.move(before, grasp.hand, tolerance=0.035, turn_tolerance=0.2, steps=140)
    inside = min(arm.ahead(grasp.point) - INSIDE, nearest(arm, beside, beside))
    yield from arm.drive(
        arm.floor_point(inside, beside),
        speed=0.5,
        until=lambda: arm.ahead(entry) - arm.ahead(arm.position) < 0.015,
    )
    speed = 0.3 if way.raised else 0.6
    back_in_line = [(ENTRY, 0.010, speed)] if way.passing != way.aside else []
    stops = (*back_in_line, (ENTRY / 2.0, 0.015, speed), (0.0, 0.006, speed / 2.0))
    yield from come_in(arm, grasp, stops, 0.08)


def go_out(arm: Arm, way: DoorwayPath) -> Motion:
    """Drive out from between the doors, and lower the torso again.

    Raises:
        SkillFailed: if the base does not get there.
    """
    yield from arm.drive(arm.floor_point(way.start - DRAW_BACK, way.beside), speed=GENTLY)
    yield from lift_torso(arm, -way.raised)


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
    reach = np.abs(arm.left @ grasp.hand[:2, :2]) @ HALF_HAND
    return float(half[0] - abs(arm.aside(knuckles) - arm.aside(pose)) - reach)


def room_behind(arm: Arm, cabinet: Furniture, grasp: Grasp) -> float:
    """Free space between a gripping palm and a cabinet's back, m."""
    pose, half = cabinet.interior()
    palm = palm_points(grasp.hand) + grasp.point
    return arm.ahead(pose) + float(half[1]) - max(arm.ahead(point) for point in palm)


def room_between(arm: Arm, thing: Thing, grasp: Grasp) -> float:
    """Free space between a gripping palm and what else stands there, as if that were round and
    had no handle, m.
    """
    gaps, palm = [math.inf], palm_points(grasp.hand) + grasp.point
    for other in other_things(arm, thing):
        beside = palm[(palm[:, 2] < other.highest) & (palm[:, 2] > other.bottom)]
        if len(beside):
            away = np.linalg.norm(beside[:, :2] - other.middle[:2], axis=1).min()
            gaps.append(float(away) - other.sides()[0][1] / 2.0)
    return min(gaps)


def palm_points(hand: Array) -> Array:
    """Points of the near side of a palm (P, 3), from the grip point, m."""
    x, y = HALF_HAND
    along, across = np.meshgrid(np.linspace(-x, x, 21), np.linspace(-y, y, 7))
    points: Array = np.stack((along.ravel(), across.ravel(), np.full(along.size, -PALM)), axis=1)
    return points @ hand.T


def turned(arm: Arm, hand: Array) -> float:
    """How far a hand (3, 3) is turned from straight ahead about the vertical, degrees."""
    return abs(arm.bearing(hand[:, 2]))
