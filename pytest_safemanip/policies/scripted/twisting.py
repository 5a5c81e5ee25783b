"""A cup whose handle lets the hand in only from where it has no room, beside an open door say: its
handle is pushed away from the robot first, from its free side, and the cup turns with it.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion
from pytest_safemanip.policies.scripted.doorways import (
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
from pytest_safemanip.policies.scripted.grasping import Grasp
from pytest_safemanip.policies.scripted.handles import handle, lug_length
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.shelves import grasp_with_room, pick_from_shelf
from pytest_safemanip.policies.scripted.things import Furniture, Thing

ASIDE = (55.0, 125.0)
"""Degrees from the base's forward direction to a handle that is pushed round."""
TURNED = 42.0
"""Likewise until it is: a hand that comes straight then has a finger to either side of it."""
PITCH, YAW = 62.0, 60.0
"""Of the hand that pushes, degrees from straight down, and about the vertical to the cup: the palm
stays off the cup while the handle goes round."""
BAR, LEAST_LUG = 0.008, 0.02
"""From the far end of a handle to where it is pushed, and how long it is at least, m."""
BEFORE, PRESS = 0.022, 0.020
"""From there to the farther one of the open fingers before it touches it, and how far beyond it
that one aims to push, m."""
FINGER = 0.054
"""From the grip point to the outer side of an open finger, m."""
BESIDE, BEHIND = 0.04, 0.08
"""Free space that the palm needs where it begins: on its way in, beside what stands there; on its
way round, before a cabinet's back, m."""
MOST_SHORT = 0.05
"""What the wrist of a hand that comes straight then may lack beside an open door, m: with 8 cm, the
forearm met it with 227 N."""
PUSHING = 0.25
"""Share of the hand's top speed meanwhile."""
OFF, DRAWN = 0.04, 0.08
"""How far the hand draws back from the handle, and then along its own direction, m."""


def pick_twisted(arm: Arm, role: str, cabinet_role: str) -> Motion:
    """Pinch something upright in an open cabinet and bring it out; a cup that there is no room to
    grip as it stands is turned first.

    Raises:
        SkillFailed: if there is no room, or it was not lifted.
    """
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    pushing = push_grasp(arm, cabinet, thing)
    if pushing and not grasp_with_room(arm, cabinet, thing):
        yield from push_handle(arm, cabinet, thing, pushing)
    yield from pick_from_shelf(arm, role, cabinet_role)


def in_reach(arm: Arm, role: str, cabinet_role: str) -> bool:
    """Whether there is room to grip something upright in an open cabinet, or to turn it first."""
    thing, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    return bool(grasp_with_room(arm, cabinet, thing) or push_grasp(arm, cabinet, thing))


def push_grasp(arm: Arm, cabinet: Furniture, thing: Thing) -> Grasp | None:
    """Where and how the open hand begins to push a cup's handle, which points to one side, away
    from the robot, with its farther finger: both fingers of a closed hand would press on it. None
    if the handle points elsewhere, or the hand has no room beside the cup, now or then.
    """
    straight = Grasp(thing.middle, arm.hand(PITCH), 1.0)
    beside_door = short_of_door(arm, cabinet, wrist_aside(arm, straight)) > MOST_SHORT
    if lug_length(thing) < LEAST_LUG or room_beside(arm, cabinet, straight) < 0.0 or beside_door:
        return None
    bearing = arm.bearing(handle(thing)[1])
    hand = arm.hand(PITCH, yaw=-math.copysign(YAW, bearing))
    grasp = Grasp(before_end(arm, thing, BEFORE) - to_finger(arm, hand), hand, 1.0)
    tight = room_between(arm, thing, grasp) < BESIDE or room_behind(arm, cabinet, grasp) < BEHIND
    sideways = ASIDE[0] < abs(bearing) < ASIDE[1]
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
        return before_end(arm, thing, -PRESS) - to_finger(arm, hand)

    def done() -> bool:
        return abs(arm.bearing(handle(thing)[1])) < TURNED

    yield from go_in(arm, grasp, way)
    yield from arm.grip(False, 2)
    yield from arm.move(pushing, hand, speed=PUSHING, steps=100, until=done, required=False)
    for away in (np.append(arm.forward, 0.0) * OFF, hand[:, 2] * DRAWN):
        yield from arm.move(
            arm.position - away, hand, tolerance=0.01, speed=0.5, steps=40, required=False
        )
    yield from go_out(arm, way)


def to_finger(arm: Arm, hand: Array) -> Array:
    """From the grip point to the outer side of the farther one of the open fingers (3,), m."""
    return np.asarray(hand[:, 0] * math.copysign(FINGER, arm.ahead(hand[:, 0])), np.float64)


def before_end(arm: Arm, thing: Thing, back: float) -> Array:
    """The point (3,) so far before the end of a cup's handle, m, along the way that the end goes
    when it is pushed away from the robot; half as high as the cup.
    """
    root, way = handle(thing)
    onward = np.append(arm.forward, 0.0)
    onward -= (onward @ way) * way
    end = root + (lug_length(thing) - BAR) * way - back * onward / np.linalg.norm(onward)
    return np.append(end[:2], thing.middle[2])
