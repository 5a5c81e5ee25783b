"""Attitudes: how a held thing may be turned where it is put."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from pytest_safemanip.expert.motions.handholds import UP, required_handle_way
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.rotations import Array, about_z, upright
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.geometry import about, matrix

TURNS = (0.0, 20.0, -20.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0)
"""How far a load may be turned about the vertical from how it is held, degrees."""
TIPS = (75.0, 60.0, 50.0, 40.0)
"""How far a slice is tipped over, away from the robot, degrees."""
TIPPINGS = (25.0, 50.0, -25.0)
"""How far what goes into a vessel may be tipped, for the hand to fit between its walls, degrees.
"""
SLOPES = (70.0, 60.0, 80.0, 50.0)
"""How steeply a stick is dipped, degrees."""
MIDDLE = 0.02
"""A stick that is held no farther from its middle is held in its middle, m."""
ASKEW, FLIPPED = math.radians(2.0), math.radians(170.0)
"""How askew something hangs that is set upright again, at least and at most, rad."""
LEANT = math.cos(math.radians(35.0))
"""What leaned no more than this, as a cosine, is set upright too."""

Attitudes = Callable[[Arm, Thing], Sequence[tuple[Array, float]]]
"""Turns (3, 3) of a held thing from how it is now, and what speaks against each."""


def standing(arm: Arm, thing: Thing) -> list[tuple[Array, float]]:
    """As it stood before it was grasped, turned about the vertical."""
    right = righted(arm, thing)
    return [(about_z(turn) @ right, 0.1 * number) for number, turn in enumerate(TURNS)]


def tipped(arm: Arm, hand: Array) -> list[tuple[Array, float]]:
    """Tipped towards the robot or away from it, as what falls into a vessel may be, or until the
    hand (3, 3) points straight down, which takes the least room.
    """
    left, (line, _, approach) = np.append(arm.left, 0.0), hand.T
    steep = math.atan2(float(np.cross(approach, -UP) @ line), float(approach @ -UP))
    tips = [(left, math.radians(tip), TURNS[:3]) for tip in TIPPINGS]
    return [
        (about_z(turn) @ np.asarray(matrix(about(axis, tip))), 0.4 + 0.1 * number)
        for number, (axis, tip, turns) in enumerate([(line, steep, TURNS), *tips])
        for turn in turns
    ]


def laid(arm: Arm, thing: Thing) -> list[tuple[Array, float]]:
    """Tipped over, away from the robot."""
    left = np.append(arm.left, 0.0)
    return [
        (about_z(turn) @ np.asarray(matrix(about(left, -math.radians(tip)))), 0.1 * number + other)
        for number, tip in enumerate(TIPS)
        for turn, other in ((0.0, 0.0), (20.0, 0.2), (-20.0, 0.2))
    ]


def dipped(arm: Arm, thing: Thing) -> list[tuple[Array, float]]:
    """With its longest axis steep, the end down that is not held, and before the robot, for then
    the hand points ahead; either end, if it is held near its middle.
    """
    off = float((thing.centre - arm.position) @ thing.longest)
    free = thing.longest * math.copysign(1.0, off)
    ends = [(free, 0.0)] if abs(off) > MIDDLE else [(free, 0.0), (-free, 0.3)]
    found = []
    for way, other in ends:
        level = way * (1.0, 1.0, 0.0) / np.linalg.norm(way[:2])
        to_robot = -arm.bearing(-level)
        for number, slope in enumerate(SLOPES):
            down = math.cos(math.radians(slope)) * level
            down[2] = -math.sin(math.radians(slope))
            axis = np.cross(way, down)
            angle = math.atan2(float(np.linalg.norm(axis)), float(way @ down))
            turn = np.asarray(matrix(about(axis / np.linalg.norm(axis), angle)))
            found += [
                (about_z(to_robot + yaw) @ turn, other + 0.1 * number + 0.002 * abs(yaw))
                for yaw in (0.0, 30.0, -30.0, 60.0, -60.0)
            ]
    return found


def handle_first(arm: Arm, thing: Thing) -> list[tuple[Array, float]]:
    """Upright, its handle towards the robot.

    Raises:
        SkillFailed: if it has none.
    """
    to_robot = -arm.bearing(-required_handle_way(thing))
    right = righted(arm, thing)
    return [
        (about_z(to_robot + turn) @ right, 0.01 * abs(turn))
        for turn in (0.0, 15.0, -15.0, 30.0, -30.0, 45.0, -45.0)
    ]


def righted(arm: Arm, thing: Thing) -> Array:
    """The turn (3, 3) that sets something upright that hangs askew."""
    axis = np.asarray(matrix(thing.pose[3:]) @ upwards(arm, thing), np.float64)
    askew = math.acos(float(np.clip(axis[2], -1.0, 1.0)))
    return upright(axis) if ASKEW < askew < FLIPPED else np.eye(3)


def upwards(arm: Arm, thing: Thing) -> Array:
    """What pointed upwards when a thing was taken hold of, or does now, in its own frame (3,)."""
    axes = matrix(arm.stood.get(thing.entity, thing.pose)[3:])
    number = int(np.argmax(np.abs(axes[2])))
    if abs(axes[2, number]) < LEANT:
        return np.asarray(axes[2])
    return np.asarray(np.eye(3)[number] * math.copysign(1.0, axes[2, number]))
