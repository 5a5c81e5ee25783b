"""Taking something off the lowest shelf of an open wall cabinet."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed
from pytest_safemanip.policies.scripted.doorways import (
    BACK,
    GENTLY,
    TUCKED,
    go_in,
    go_out,
    in_the_way,
    way_in,
)
from pytest_safemanip.policies.scripted.encircling import HANDLE, OFF_HANDLE, around, yaws_around
from pytest_safemanip.policies.scripted.grasping import Grasp, lift
from pytest_safemanip.policies.scripted.things import Furniture, Thing

PITCHES = (50.0, 62.0)
"""Degrees from straight down for a hand that is straight ahead, and for one that is turned by 45
degrees: steeper, the arm is at the end of its reach; more level, the palm keeps the pads off the
middle of what they grip, which swings then."""
STEEP = 47.0
"""Of a hand that has no room otherwise, with the torso raised: its palm passes over what is lower,
and its wrist is less far aside. At 39 degrees, the wrist meets the next shelf."""
CUP_SIDES, JAR_SIDES = 45.0, 90.0
"""Degrees from one side on which the pads lie flat to the next. A pad on an edge is a hinge."""
FAR_TURNED = 70.0
"""Degrees to either side that a hand is turned for want of room: farther, it is across the arm."""
RISE = 0.045
"""How far something is lifted off the shelf, m."""
LOW = 1.15
"""Height at which the hand passes below a cabinet and its doors with a load, m."""


def pick_from_shelf(arm: Arm, role: str, cabinet_role: str) -> Motion:
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
    yield from lift(arm, thing, grasp.hand, RISE, BACK)
    tucked = arm.point(arm.ahead(arm.base) + TUCKED, arm.aside(arm.position), arm.position[2])
    yield from arm.move(
        tucked, grasp.hand, tolerance=0.02, turn_tolerance=0.15, speed=GENTLY, steps=60
    )
    yield from go_out(arm, way)
    low = np.append(arm.position[:2], LOW)
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
    cup = np.linalg.norm((thing.centre - thing.middle)[:2]) > HANDLE * thing.height
    sides = CUP_SIDES if cup else JAR_SIDES
    least, *others = yaws_around(arm, thing, sides, OFF_HANDLE)
    yaws = [least, *(yaw for yaw in others if abs(yaw) < FAR_TURNED)]
    usual = np.interp(np.abs(yaws), (0.0, 45.0), PITCHES).tolist()
    pitches = usual if pitch is None else [pitch] * len(yaws)
    return [around(arm, thing, p, yaw=yaw) for p, yaw in zip(pitches, yaws, strict=True)]
