"""Room for the hand on a counter: between what stands there, and beside furniture."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm
from pytest_safemanip.policies.scripted.grasping import GAP, HAND, PALM, Grasp, hand_corners
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.spotting import others
from pytest_safemanip.policies.scripted.standing import solids
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.trace.geometry import corners

FINGER = (0.015, 0.012)
"""Thickness of a finger, and half its width, m."""


def beside_things(arm: Arm, thing: Thing, grasp: Grasp) -> float:
    """Least distance from the fingers, and from the palm above them, to what stands around, m."""
    axis, least = grasp.hand[:2, 0] / np.linalg.norm(grasp.hand[:2, 0]), math.inf
    fingers = grasp.opening * GAP / 2.0 + FINGER[0], FINGER[1]
    for other in others(arm, thing):
        way = (other.centre - grasp.point)[:2]
        along, off = abs(float(way @ axis)), abs(float(axis[0] * way[1] - axis[1] * way[0]))
        tall = other.highest > grasp.point[2] + PALM
        reach, half = HAND[:2] if tall else fingers
        gap = math.hypot(max(0.0, along - reach), max(0.0, off - half))
        least = min(least, gap - other.sides()[0][1] / 2.0)
    return least


def beside_furniture(arm: Arm, point: Array, hand: Array) -> float:
    """Least distance, on the level, from a hand that points down to furniture that is as high, m.

    Args:
        arm: the arm.
        point: its grip point (3,).
        hand: its orientation (3, 3).
    """
    palm = hand_corners(hand) + point
    axes = np.array([[*arm.forward], [*arm.left], hand[:2, 0], hand[:2, 1]])
    least = math.inf
    for points in [*solids(arm), *handles(arm)]:
        if points[:, 2].max() > palm[:, 2].min() and points[:, 2].min() < palm[:, 2].max():
            ours, theirs = palm[:, :2] @ axes.T, points[:, :2] @ axes.T
            beside = np.maximum(ours.min(0) - theirs.max(0), theirs.min(0) - ours.max(0))
            least = min(least, float(beside.max()))
    return least


def handles(arm: Arm) -> list[Array]:
    """Corners (8, 3) of what is pulled or pressed on furniture."""
    boxes, poses = arm.scene.boxes, arm.step.box_pose
    return [
        np.asarray(corners(np.asarray(poses[k], np.float64), box.half), np.float64)
        for k, box in enumerate(boxes)
        if box.kind in ("handle", "control")
    ]
