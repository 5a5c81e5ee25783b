"""What stands around a hand: where its palm has room, and what it is drawn back over."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm
from pytest_safemanip.policies.scripted.grasping import FINGERTIP, HAND, PALM, Grasp, hand_corners
from pytest_safemanip.policies.scripted.rims import overhung
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.things import Thing

WRIST = 0.05
"""How far beyond the flange the wrist is as thick as the hand, m."""
BESIDE = 0.004
"""Kept free around a hand that comes in, m: it arrives within 6 mm, bottles are narrower than their
boxes."""
LEVELS = np.linspace(0.0, 1.0, 9)
"""Heights of a thing that are looked at, shares of its own."""
SPAN = np.linspace(-1.0, 1.0, 9)
"""Where along their width fingers and palm are looked at, shares of half of it."""
FINGERS = (0.055, 0.012)
"""Half the length, along their travel, and half the thickness of two open fingers, m."""
BEFORE = 0.03
"""What ends so far before the grip point stands in front of the hand, m."""
OVER = 0.02
"""Free space below a hand that is drawn back over something, m."""
MOST = 0.15
"""How far it is raised for that at most, m."""


def palm_has_room(arm: Arm, grasp: Grasp, own: Thing) -> bool:
    """Whether nothing stands where the palm and the wrist are at a grasp.

    Args:
        arm: the arm.
        grasp: the grasp.
        own: what is grasped; what lies in it or under it does not count either.
    """
    x, y, deep = HAND
    for other in _others(arm, own):
        local = (_outline(other) - grasp.point) @ grasp.hand
        inside = (np.abs(local[:, 0]) < x + BESIDE) & (np.abs(local[:, 1]) < y + BESIDE)
        behind = -local[:, 2]
        if (inside & (behind > PALM - BESIDE) & (behind < PALM + deep + WRIST)).any():
            return False
    return True


def room_on_way(arm: Arm, grasp: Grasp, own: Thing, back: float) -> float:
    """Least distance of fingers, palm and wrist that come in to a grasp along its approach from
    what stands beside it, as if that were upright pillars, m; below 0 they would go into one.

    Args:
        arm: the arm.
        grasp: the grasp.
        own: what is grasped; what lies in it or under it does not count either.
        back: length of the approach, m.
    """
    ways = np.linspace(0.0, back, len(LEVELS))[:, None, None] * -grasp.hand[:, 2]
    points = (ways + _shell(grasp.hand) + grasp.point).reshape(-1, 3)
    room = math.inf
    for other in _others(arm, own):
        beside = np.linalg.norm((points - other.centre)[:, :2], axis=1) - other.sides()[1][1] / 2.0
        above = points[:, 2] - other.highest
        outside = np.hypot(np.maximum(beside, 0.0), np.maximum(above, 0.0))
        room = min(room, float((outside + np.minimum(np.maximum(beside, above), 0.0)).min()))
    return room


def rise_over_front(arm: Arm, back: float) -> float:
    """How far a hand is to be raised before it is drawn back, for it to pass over what stands in
    front of it, m; not below what hangs there.

    Args:
        arm: the arm.
        back: how far it is drawn back, m.
    """
    if overhung(arm, arm.position):
        return 0.0
    here, reach = arm.ahead(arm.position), max(HAND)
    rise = 0.0
    for body in arm.scene.bodies:
        thing = Thing(arm, body.entity)
        far = thing.extent_ahead()[1]
        if far > here - BEFORE or far < here - back - reach:
            continue
        sides = [arm.aside(corner) for corner in thing.corners]
        for points in (hand_corners(arm.rotation), _finger_corners(arm.rotation)):
            across = [arm.aside(point + arm.position) for point in points]
            bottom = float(arm.position[2] + points[:, 2].min())
            beside = min(sides) > max(across) + BESIDE or max(sides) < min(across) - BESIDE
            if not beside and bottom - BESIDE < thing.highest < bottom + MOST:
                rise = max(rise, thing.highest + OVER - bottom)
    return min(rise, MOST)


def _finger_corners(hand: Array) -> Array:
    """Corners (8, 3) of two open fingers, from the grip point, m."""
    x, y = FINGERS
    ends = (-FINGERTIP, PALM)
    return np.array([(i * x, j * y, -k) for i in (-1, 1) for j in (-1, 1) for k in ends]) @ hand.T


def _shell(hand: Array) -> Array:
    """Points (K, 3) on open fingers, palm and wrist, from the grip point, m."""
    parts = ((FINGERS, (-FINGERTIP, PALM)), (HAND[:2], (PALM, PALM + HAND[2] + WRIST)))
    grids = [
        np.stack(np.meshgrid(x * SPAN, (-y, y), -np.linspace(*ends, 3), indexing="ij"), axis=-1)
        for (x, y), ends in parts
    ]
    points: Array = np.concatenate([grid.reshape(-1, 3) for grid in grids]) @ hand.T
    return points


def _others(arm: Arm, own: Thing) -> list[Thing]:
    """What stands beside a thing."""
    bodies = [Thing(arm, body.entity) for body in arm.scene.bodies]
    radius = own.sides()[0][1] / 2.0
    return [t for t in bodies if math.dist(t.centre[:2].tolist(), own.middle[:2].tolist()) > radius]


def _outline(thing: Thing) -> Array:
    """Points (45, 3) of a thing, as if its box were a pillar with round edges."""
    arms = [side * sign * width / 2.0 for side, width in thing.sides() for sign in (1.0, -1.0)]
    flat = thing.centre + np.array([np.zeros(3), *arms]) * (1.0, 1.0, 0.0)
    points = np.repeat(flat, len(LEVELS), axis=0)
    points[:, 2] = np.tile(thing.bottom + LEVELS * thing.height, len(flat))
    return points
