"""Bowls in each other on a shelf: the large one first, then the small one is let into it.

The hand holds the small one by its lug, and its fingers stay above the large one's rim: what fits
through falls the rest of the way, up to 4 cm, else the lug comes to rest on that rim.
"""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.motions.grasping import MOST_YAW, grasp_and_lift
from pytest_safemanip.expert.motions.handles import (
    HANDLE_RISE,
    LEAVE_BACK,
    OFF_WALL,
    UNDER_RIM,
    bring_in,
    handle,
    lug_length,
    put_in,
)
from pytest_safemanip.expert.motions.putting import leave
from pytest_safemanip.expert.places.cabinet.placing import come_down
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.hand import Grasp, finger_angle
from pytest_safemanip.expert.robot.rotations import Array, fold
from pytest_safemanip.expert.world.standing import duck, stand_before
from pytest_safemanip.expert.world.things import Furniture, Thing

PITCH, REACH = 42.0, 0.63
"""Degrees from straight down, and base to hand at the counter, m: nearer or more tipped, the wrist
is at its limit there; less tipped, the arm is stretched before a shelf."""
ON_LUG = 0.5
"""From a bowl's wall to the grip point at most, share of its lug: while the fingers close, the hand
gives way by up to 9 mm, and a pad at the end of a short lug slips off."""
SHELF_TUCKED = 0.46
"""Base to hand before a shelf, m."""
DEPTH = 0.03
"""Free space between the front of a shelf and a bowl there, m."""
OVER_RIM = 0.024
"""From a large bowl's rim up to the grip point, m: the tips of fingers that are tipped stay above
it."""


def move_nested(arm: Arm, role: str, other_role: str, cabinet_role: str) -> Motion:
    """Put the larger of two bowls on the lowest shelf of an open cabinet, the other one into it.

    Raises:
        SkillFailed: if one was not lifted, or hand or base do not get there.
    """
    cabinet = Furniture(arm, cabinet_role)
    small, large = by_width(arm, role, other_role)
    yield from grasp_lug(arm, large)
    yield from put_in(arm, large.entity, cabinet, on_shelf(arm, large, cabinet), SHELF_TUCKED)
    yield from come_down(arm)
    yield from grasp_lug(arm, small)
    yield from drop_into_bowl(arm, small, large, cabinet)


def by_width(arm: Arm, role: str, other_role: str) -> tuple[Thing, Thing]:
    """Two things, the narrower one first."""
    things = Thing(arm, role), Thing(arm, other_role)
    first, second = sorted(things, key=lambda thing: thing.sides()[0][1])
    return first, second


def grasp_lug(arm: Arm, thing: Thing) -> Motion:
    """Pinch a bowl's lug, the hand as it will be before a shelf, and lift the bowl level.

    Raises:
        SkillFailed: if it was not lifted.
    """
    root, way = handle(thing)
    yaw = fold(finger_angle(arm, np.cross((0.0, 0.0, 1.0), way)), 90.0)
    hand = arm.hand(PITCH, yaw=float(np.clip(yaw, -MOST_YAW, MOST_YAW)))
    off = min(OFF_WALL, ON_LUG * lug_length(thing))
    point = root + off * way - np.array((0.0, 0.0, UNDER_RIM))
    yield from duck(arm, arm.aside(point))
    yield from stand_before(arm, point, REACH)
    yield from grasp_and_lift(arm, thing, Grasp(point, hand, 1.0), rise=HANDLE_RISE)


def on_shelf(arm: Arm, thing: Thing, cabinet: Furniture) -> Array:
    """Where the middle of a held bowl goes on a shelf, its lug to the front (3,)."""
    front, shelf = cabinet.opening()
    ahead = front + DEPTH + lug_length(thing) + thing.sides()[0][1] / 2.0
    return arm.point(ahead, arm.aside(cabinet.interior()[0]), shelf)


def drop_into_bowl(arm: Arm, small: Thing, large: Thing, cabinet: Furniture) -> Motion:
    """Let a held bowl fall into a larger one in a cabinet, its lug towards the robot."""
    off = lug_length(small) / 2.0
    spot = np.append(large.middle[:2] + off * arm.forward, large.highest)
    yield from bring_in(arm, small, cabinet, spot, SHELF_TUCKED)
    hand = arm.rotation

    def over() -> Array:
        way = large.middle - small.centre
        return np.append(arm.position[:2] + way[:2], large.highest + OVER_RIM)

    yield from arm.move(
        over, hand, tolerance=0.003, speed=0.3, steps=80, required=False, exact=True
    )
    yield from arm.grip(False)
    yield from leave(arm, LEAVE_BACK)
