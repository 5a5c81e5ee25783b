"""A cup, which may be full, carried level and tipped."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion, raised
from pytest_safemanip.faults.handling import go, put_back, take
from pytest_safemanip.trace.geometry import about, matrix

TIPPED, HIGH = 130.0, 0.15
"""How far the cup is turned, degrees, and how high it is lifted before, m."""


def tip(arm: Arm) -> Motion:
    """Takes a cup, lifts it and tips it."""
    yield from take(arm, "obj")
    yield from arm.move(raised(arm.position, HIGH), tolerance=0.03, steps=40)
    arm.truth.begins("vla_arena_state_upright", "obj")
    forward = np.append(arm.forward, 0.0)
    hand = matrix(about(forward, math.radians(TIPPED))) @ arm.rotation
    yield from go(arm, arm.position, hand, turn_tolerance=0.2, steps=40)
    yield from arm.wait(0.5)


def carry_level(arm: Arm) -> Motion:
    """Takes a cup, and puts it back."""
    yield from put_back(arm)
