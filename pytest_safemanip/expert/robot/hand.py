"""The hand: its measures, how it closes on something, how far the arm reaches with it."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.rotations import Array

GAP = 0.076
"""Widest side that fits between the fingers, m."""
FINGERTIP = 0.012
"""Grip point above a surface at which the fingertips do not touch it, m."""
FINGER_SIDE, OPENING = 0.010, 0.08
"""Half a finger's width, and between the fingers where they are open, m: tipped, the lower side of
level fingers, or the lower one of two that are not, is what meets a surface first."""
WRIST = 0.21
"""From the grip point back to the wrist, m."""
FINGER_THICK = 0.0145
"""Of a finger, along the fingers' travel, m."""
PALM = 0.026
"""From the grip point to the palm, m."""
REACHES = ((0.0, 35.0, 45.0), (0.52, 0.63, 0.57))
"""Pitch of the hand, degrees, and base to hand, m, at which the arm holds it well."""
HAND = (0.102, 0.032, 0.066)
"""Half the Panda hand's length, along the fingers' travel, half its thickness, and from its palm to
its flange, m."""


def reach_at(pitch: float) -> float:
    """Base to hand at which the arm holds a pitch well, at the height of a counter, m."""
    return float(np.interp(pitch, *REACHES))


def palm_points(rows: int = 7) -> Array:
    """Points (P, 3) on the palm and on the wrist behind it, in the hand's frame, m.

    Args:
        rows: of them along the palm.
    """
    x, y, deep = HAND
    grid = np.meshgrid(
        np.linspace(-x, x, rows), (-y, 0.0, y), np.linspace(PALM, PALM + deep + 0.02, 3)
    )
    points = np.stack([axis.ravel() for axis in grid], axis=1)
    return np.asarray(points * (1.0, 1.0, -1.0))


def finger_points(opening: float, along: tuple[float, ...] = ()) -> Array:
    """Points (F, 3) on the two fingers, likewise.

    Args:
        opening: share of the full opening.
        along: how far behind the grip point they have more, m, for what is thin.
    """
    near = opening * OPENING / 2.0
    side = np.linspace(-FINGER_SIDE, FINGER_SIDE, 3)
    far = (near, near + FINGER_THICK)
    # At its tip, a vessel's wall would fit between the corners.
    places = [(x, FINGERTIP - 0.002) for x in (*far, near + FINGER_THICK / 2.0)]
    places += [(far[1] + 0.004, -PALM), (far[1] + 0.002, -0.008)]
    places += [(x, -behind) for x in far for behind in along]
    one = np.array([(x, y, z) for x, z in places for y in side])
    return np.concatenate((one, one * (-1.0, 1.0, 1.0)))


def finger_angle(arm: Arm, axis: Array) -> float:
    """Degrees about the vertical from the fingers' direction to an axis."""
    fingers = arm.hand()[:, 0]
    return math.degrees(math.atan2(np.cross(fingers, axis)[2], fingers @ axis))
