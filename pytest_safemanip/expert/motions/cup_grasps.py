"""Grasps around upright cups, the fingers beside the handle."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.robot.hand import GAP, PALM, Grasp, finger_angle
from pytest_safemanip.expert.robot.rotations import about_z, fold
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.geometry import matrix

CUP_DEPTH = 0.010
"""Grip point below the rim of a cup, m: low enough for the pads, high enough for the palm."""
CUP_SIDES = 45.0
"""From one flat side of a cup to the next, degrees: between them, it turns in the fingers."""
HANDLE_SHARE = 0.05
"""Off the middle by more than this share of the radius, a box shows where the handle is."""
OFF_HANDLE = 45.0
"""Least angle from the fingers' line to a cup's handle, degrees: a finger fits beside it."""
PALM_BEHIND_PITCH = 45.0
"""Pitch, any but 0, at which a hand has its palm behind what it grips, degrees."""


def around(
    arm: Arm, thing: Thing, pitch: float, handle: float = 90.0, yaw: float | None = None
) -> Grasp:
    """Around an upright cup, the fingers level and off its handle, the palm just off its rim.

    A rim alone cannot hold one: the gripper is a position servo, and presses with 1 N for each
    millimetre that is between a finger and where it would go, 1.5 N on a wall of 3 mm.

    Args:
        arm: the arm.
        thing: the cup.
        pitch: of the hand, degrees.
        handle: least angle from the fingers' line to the handle, degrees.
        yaw: of the hand, degrees; None for the least of those that suit the cup.

    Raises:
        SkillFailed: if it is too wide.
    """
    width = thing.sides()[0][1]
    if width > GAP:
        raise SkillFailed("the cup is too wide for the gripper")
    turned = yaws_around(arm, thing, CUP_SIDES, handle)[0] if yaw is None else yaw
    hand, tip = arm.hand(pitch, yaw=turned), math.radians(pitch)
    # The near rim is where the palm would touch first.
    back = (width / 2.0 * math.sin(tip) + CUP_DEPTH * math.cos(tip) - PALM) / math.sin(tip)
    level = hand[:, 2] * (1.0, 1.0, 0.0)
    point = np.append(thing.middle[:2], thing.highest - CUP_DEPTH)
    return Grasp(point - max(0.0, back) * level / np.linalg.norm(level), hand, 1.0)


def yaws_around(arm: Arm, thing: Thing, flat: float, handle: float) -> list[float]:
    """How far a hand around a cup may be turned about the vertical, degrees, the least first.

    Args:
        arm: the arm.
        thing: the cup.
        flat: from one flat side to the next, degrees.
        handle: least angle from the fingers' line to the handle, degrees.

    Raises:
        SkillFailed: if it cannot be.
    """
    width = thing.sides()[0][1]
    out, axes = (thing.centre - thing.middle)[:2], matrix(thing.pose[3:])
    square = HANDLE_SHARE * width
    most = square + np.linalg.norm(out) * math.cos(math.radians(handle))
    found = []
    for turn in np.arange(0.0, 360.0, flat).tolist():
        side = about_z(turn) @ (axes[:, 0] * (1.0, 1.0, 0.0))
        yaw = fold(finger_angle(arm, side), 90.0)
        # A finger on the palm's side of the handle would drag the cup along when it draws back.
        beyond = arm.hand(PALM_BEHIND_PITCH, yaw=yaw)[:2, 2] @ out > 0.0
        if abs(side[:2] @ out) <= (most if beyond else square):
            found.append(yaw)
    if not found:
        raise SkillFailed("no finger fits beside the cup's handle")
    return sorted(found, key=abs)
