"""The torso: raised, the arm reaches over a shelf, and not up to its edge."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion

THERE = 0.004
"""Distance that counts as there, m."""
GAIN, DEAD_BAND = 6.0, 0.3
"""Share of the torso's top speed, 0.5 m/s, by metres that are left, above that which its friction
takes."""
STEPS = 40
"""Twice as many as its whole way of 0.3 m takes."""


def lift_torso(arm: Arm, by: float) -> Motion:
    """Raise the torso, and the hand with it, as far as it goes.

    Args:
        arm: the arm.
        by: how far, m; negative to lower it.
    """
    if by == 0.0:
        return
    goal = arm.position[2] + by
    for _ in range(STEPS):
        left = goal - float(arm.position[2])
        if abs(left) < THERE:
            break
        action = arm.hold()
        action[10] = np.clip(math.copysign(DEAD_BAND, left) + GAIN * left, -1.0, 1.0)
        yield action
    yield from arm.wait(0.2)
    arm.torso += by - (goal - float(arm.position[2]))
