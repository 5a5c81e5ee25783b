"""What a hand that sets something down may touch: a vessel's rim, what hangs over it."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.hand import hand_corners
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.standing import solids
from pytest_safemanip.expert.world.things import Thing

SHIFTS = (0.0, 0.01, 0.02, 0.03, 0.04)
"""How far from the middle of a vessel something is put down in it, m: RoboCasa takes what is less
than 7 cm from a pan's middle for in it, and round things roll a little."""
VESSEL_WALL = 0.006
"""Of a vessel, m."""
RIM_ROOM = 0.010
"""Kept free between the palm and the inside of a rim, m."""
HAND_WIDE = 0.095
"""Least inner radius of a vessel that a hand goes into, m: half its own length, near enough."""
OVERHEAD = (0.15, 0.45)
"""Above a spot, m: from where to where the wrist is, 30 cm above a hand that is still 10 cm up."""
WRIST_ASIDE = 0.12
"""How far to either side of a spot the wrist may be, m."""
STEEP, DEEP_UNDER = math.sin(math.radians(25.0)), 0.15
"""Tipped by less, as a sine, and farther than this behind the front of what hangs over it, m, a
hand has its wrist close to that, and goes no further in."""
LEAST_SHIFTED = math.sin(math.radians(5.0))
"""Tipped by less, a hand has no side on which its palm hangs down, as a sine."""


def rim_shift(arm: Arm, thing: Thing, target: Thing) -> Array:
    """How far off the middle of a vessel to put down what is held (3,), for a tipped hand, whose
    palm hangs down behind its fingers, to go in and draw back without touching the rim.

    Args:
        arm: the arm.
        thing: what is held.
        target: the vessel.
    """
    approach, radius = arm.rotation[:, 2], target.sides()[0][1] / 2.0 - VESSEL_WALL
    level = np.linalg.norm(approach[:2])
    # Above where the thing will stand.
    palm = hand_corners(arm.rotation) + arm.position - np.append(thing.middle[:2], thing.bottom)
    below = target.height - VESSEL_WALL - palm[:, 2]
    if level < STEEP and overhung(arm, target.middle, DEEP_UNDER):
        return np.zeros(3)
    if radius < HAND_WIDE or level < LEAST_SHIFTED or not (below > 0.0).any():
        return np.zeros(3)
    palm, back = palm[below > 0.0, :2], below[below > 0.0, None] / -approach[2] * approach[:2]
    ahead = approach[:2] / level

    def outermost(shift: float) -> float:
        """The palm's farthest corner from the middle, now and on its way out, m."""
        here = palm + shift * ahead
        return float(np.linalg.norm(np.concatenate((here, here - back)), axis=1).max())

    free = [shift for shift in SHIFTS if outermost(shift) < radius - RIM_ROOM]
    chosen = free[0] if free else min(SHIFTS, key=outermost)
    return np.append(chosen * ahead, 0.0)


def overhung(arm: Arm, spot: Array, deep: float = 0.0) -> bool:
    """Whether something hangs over a spot (3,) and reaches so much farther to the front, m: a
    microwave over a stove.
    """
    low, high = spot[2] + OVERHEAD[0], spot[2] + OVERHEAD[1]
    for points in solids(arm):
        aside = points[:, :2] @ arm.left - arm.aside(spot)
        over = aside.min() < WRIST_ASIDE and aside.max() > -WRIST_ASIDE
        before = (points[:, :2] @ arm.forward).min() < arm.ahead(spot) - deep
        if over and before and low < points[:, 2].min() < high:
            return True
    return False
