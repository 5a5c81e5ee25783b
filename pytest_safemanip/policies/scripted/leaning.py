"""How far beside a spot the base stands, for the arm to have room or a good posture there."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm
from pytest_safemanip.policies.scripted.grasping import reach
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.standing import OFFSETS, solids

FOREARM = (0.15, 0.30)
"""Above what a hand sets something down on, m: from where to where the forearm is."""
SWING, LEAN = 0.27, 0.10
"""How far forearm and elbow swing out sideways at most, and how far beside a spot the base can
stand, m."""
STRAIGHT = 45.0
"""Pitch from which a hand comes into line with the forearm at the height of a counter, degrees:
there the last joints turn about one line, swap their turns, and end at their limits."""
BENT = 20.0
"""Degrees about the vertical, between hand and forearm, with which they do not come into line."""
TURNED = 10.0
"""Degrees about the vertical from which a hand is bent to the side that it is turned to."""


def elbow_room(arm: Arm, spot: Array) -> float:
    """How far to the left of a spot (3,) the base is to stand for forearm and elbow, which swing
    out, to stay off a tall machine beside it, m.
    """
    low, high = spot[2] + FOREARM[0], spot[2] + FOREARM[1]
    sides = set()
    for points in solids(arm):
        aside = points[:, :2] @ arm.left - arm.aside(spot)
        beside = abs(aside).min() < SWING and aside.min() * aside.max() > 0.0
        near = beside and (points[:, :2] @ arm.forward).min() < arm.ahead(spot)
        if near and points[:, 2].max() > low and points[:, 2].min() < high and np.ptp(aside) < 1.0:
            sides.add(math.copysign(1.0, aside.mean()))
    return -LEAN * sides.pop() if len(sides) == 1 else 0.0


def wrist_room(arm: Arm, shift: float) -> float:
    """How far to the left of a spot the base is to stand for the wrist to come down to a counter
    bent sideways, m.

    Args:
        arm: the arm, holding something as it will put it down.
        shift: how far for other reasons, m.
    """
    if arm.pitch < STRAIGHT:
        return shift
    side = arm.aside(arm.rotation[:, 2])
    turned = math.degrees(math.atan2(side, arm.ahead(arm.rotation[:, 2])))
    way = shift or (turned if abs(turned) > TURNED else 1.0)
    bend = BENT - turned * math.copysign(1.0, way)
    return math.copysign(max(abs(shift), reach(arm.pitch) * math.tan(math.radians(bend))), way)


def offsets_bent(arm: Arm, shift: float) -> tuple[float, ...]:
    """How far beside a place the base may stand to come closer, the preferred first, m: not so that
    a wrist that was to be bent sideways comes into line again.

    Args:
        arm: the arm.
        shift: how far to the left of a spot that place is, m.
    """
    bent = arm.pitch >= STRAIGHT
    return tuple(off for off in OFFSETS if not bent or off * shift >= 0.0)
