"""A counter where things stand close: grasping one of them, and a free spot to put it."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.grasping import (
    FRONT_PITCH,
    FRONT_STAND,
    grasp_and_lift,
    narrow_roll,
)
from pytest_safemanip.expert.motions.putting import carry_before, held_over, leave, set_down
from pytest_safemanip.expert.places.cabinet.placing import HANG_PITCH, lower
from pytest_safemanip.expert.robot.arm import GENTLY, Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.robot.hand import Grasp
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.hand_room import room_on_way
from pytest_safemanip.expert.world.standing import stand
from pytest_safemanip.expert.world.things import Furniture, Thing, counter, other_things

NEXT_TO = (0.15, 0.18, 0.21, 0.24)
"""Middle to middle of what is put down and what it is put beside, m."""
PALM_WIDE = 0.15
"""Middle to middle of two things between which the opening hand does not touch the other, m: half
of its 20 cm, and half of what is 7 cm wide and taller."""
YAWS = (0.0, 15.0, -15.0, 30.0, -30.0, 45.0, -45.0)
"""Turns about the vertical that a level hand can take, degrees; the least first."""
FINGERS_END, FINGER_HALF_WIDE = 0.055, 0.012
"""From the grip point to the far side of an open finger, and half of a finger's other side, m."""
PALM_END = 0.105
"""From the grip point to the end of the palm, m."""
ENOUGH_ROOM = 0.01
"""Free space beside the fingers that is as good as more, m."""
WAY = 0.12
"""Length of the straight way in, m."""
SLIM = 0.010
"""How far the hand's way in may lead into the pillar around something taller, m: a bottle's upper
part is slimmer than its box."""
SHELF_REACH = 0.62
"""Base to hand at which the arm holds that pitch at the height of a bottle's neck, m."""
BELOW_TOP = 0.025
"""Grip point below the top of what stands, m."""
STILL = 0.5
"""Until a load that swung hangs still, s."""
SET_DOWN_FROM = 0.015
"""Free space below a load before it is set down, m."""
DRAWN_OFF = 0.42
"""How far the base draws back, m: RoboCasa wants the hand 25 cm off everything, what stands nearer
than the last thing too."""
FROM_EDGE = 0.06
"""From the middle of what stands on a counter to the counter's edge, m."""


def grasp_neck(arm: Arm, role: str) -> Motion:
    """Pinch something round that others stand close to: the fingers go in where there is most room.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    yield from _grasp_neck(arm, role, FRONT_PITCH, FRONT_STAND)


def grasp_neck_for_shelf(arm: Arm, role: str) -> Motion:
    """Pinch something tall and round, to hang from the fingers as it will hang over the shelf of a
    cabinet: a hand that tips later turns about the neck of a bottle.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    yield from _grasp_neck(arm, role, HANG_PITCH, SHELF_REACH)


def _grasp_neck(arm: Arm, role: str, pitch: float, distance: float) -> Motion:
    thing = Thing(arm, role)
    yield from stand(arm, arm.ahead(thing.centre) - distance, arm.aside(thing.centre))
    best = max(YAWS, key=lambda yaw: min(_room(arm, thing, yaw), ENOUGH_ROOM))
    if _room_on_way(arm, thing, pitch, best) < -SLIM:
        best = max(YAWS, key=lambda yaw: _room_on_way(arm, thing, pitch, yaw))
    yield from grasp_and_lift(arm, thing, _neck_grasp(arm, thing, pitch, best), rise=0.05, back=WAY)


def _neck_grasp(arm: Arm, thing: Thing, pitch: float, yaw: float) -> Grasp:
    return Grasp(raised(thing.top, -BELOW_TOP), arm.hand(pitch, yaw=yaw), 1.0)


def _room_on_way(arm: Arm, thing: Thing, pitch: float, yaw: float) -> float:
    return room_on_way(arm, _neck_grasp(arm, thing, pitch, yaw), thing, WAY)


def _room(arm: Arm, thing: Thing, yaw: float) -> float:
    """Least distance from the fingers, and from the palm above them, to what stands around, m."""
    axis = arm.hand(yaw=yaw)[:2, 0]
    room = math.inf
    for other in other_things(arm, thing):
        way = (other.centre - thing.centre)[:2]
        along, across = abs(float(way @ axis)), abs(float(axis[0] * way[1] - axis[1] * way[0]))
        radius = other.sides()[1][1] / 2.0
        reach = PALM_END if other.highest > thing.highest else FINGERS_END
        gap = math.hypot(max(0.0, along - reach), max(0.0, across - FINGER_HALF_WIDE))
        room = min(room, gap - radius)
    return room


def place_beside_any(arm: Arm, role: str, counter_role: str, other_role: str) -> Motion:
    """Put a held object on a counter, beside a drawer below it or near an object on it.

    Raises:
        SkillFailed: if there is no room.
    """
    if arm.scene.roles[other_role] in arm.scene.object_index:
        yield from place_beside_thing(arm, role, counter_role, other_role)
    else:
        yield from place_beside_drawer(arm, role, counter_role, other_role)


def place_beside_thing(arm: Arm, role: str, counter_role: str, other_role: str) -> Motion:
    """Put a held object on a counter, near another object that stands there.

    Raises:
        SkillFailed: if there is no room.
    """
    spot = spot_beside(arm, role, counter_role, Thing(arm, other_role))
    thing, hand = Thing(arm, role), arm.rotation
    yield from carry_before(arm, role, spot, float(spot[2]), GENTLY)
    yield from arm.wait(STILL)
    over = held_over(arm, thing, spot, float(spot[2]) + SET_DOWN_FROM)()
    yield from arm.move(over, hand, tolerance=0.015, turn_tolerance=0.2, speed=GENTLY, steps=200)
    yield from set_down(arm, role)
    yield from leave(arm, DRAWN_OFF)


def place_beside_alike(
    arm: Arm, role: str, counter_role: str, other_role: str, another_role: str
) -> Motion:
    """Put a held object on a counter, near another one if it is of its kind, else near a third."""
    entity, roles = arm.scene.entity, arm.scene.roles
    alike = entity[roles[role]].category == entity[roles[other_role]].category
    beside = other_role if alike else another_role
    yield from place_beside_thing(arm, role, counter_role, beside)


def spot_beside(arm: Arm, role: str, counter_role: str, other: Thing) -> Array:
    """The spot on a counter around an object that has most room, of those the nearest (3,).

    Raises:
        SkillFailed: if there is none.
    """
    things = other_things(arm, Thing(arm, role))
    low, high = Furniture(arm, counter_role).extent()
    low, high = low + FROM_EDGE, high - FROM_EDGE
    spots = [
        other.middle + distance * np.array((math.cos(turn), math.sin(turn), 0.0))
        for distance in NEXT_TO
        for turn in np.arange(0.0, 2.0 * math.pi, math.pi / 8).tolist()
    ]
    spots = [s for s in spots if (s[:2] > low[:2]).all() and (s[:2] < high[:2]).all()]
    if not spots:
        raise SkillFailed(f"there is no room beside {other.entity}")

    def rank(spot: Array) -> tuple[float, float]:
        room = min(float(np.linalg.norm((t.centre - spot)[:2])) for t in things)
        return min(room, PALM_WIDE), -arm.ahead(spot)

    return np.append(max(spots, key=rank)[:2], other.bottom)


BESIDE_DRAWER = 0.40
"""From the side of a drawer to where something is put down beside it, m."""


def place_beside_drawer(arm: Arm, role: str, counter_role: str, drawer_role: str) -> Motion:
    """Put a held object on a counter, to the right of an open drawer below it."""
    pose, half = Furniture(arm, drawer_role).interior()
    aside = arm.aside(pose) - half[0] - BESIDE_DRAWER
    top, edge = counter(arm, counter_role)
    yield from put_on_counter(arm, role, edge + 0.15, aside, top)


def put_on_counter(arm: Arm, role: str, ahead: float, aside: float, top: float) -> Motion:
    """Put a held object down on a counter and draw back.

    Args:
        arm: the arm.
        role: the object.
        ahead: where the hand lets go, along the base's forward direction, m.
        aside: likewise along its left direction, m.
        top: height of the counter, m.
    """
    thing = Thing(arm, role)
    roll = narrow_roll(arm, thing)
    hand = arm.hand(0.0, roll)
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), aside))
    yield from arm.drive(arm.floor_point(ahead - 0.52, aside))
    yield from arm.move(arm.point(ahead, aside, 1.05), hand, tolerance=0.03, speed=0.6, steps=80)
    yield from lower(arm, thing, top, hand)
    yield from arm.grip(False)
    yield from arm.move(raised(arm.position, 0.12), tolerance=0.03, steps=40, required=False)
    yield from arm.drive(arm.base - 0.3 * arm.forward)
