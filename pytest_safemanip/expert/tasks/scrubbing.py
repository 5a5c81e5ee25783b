"""Rubbing a board with what is held."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.putting import carry_over, leave, set_down, set_upon
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing

STROKE = (0.095, 0.025)
"""Half the length and width of the rounds that a scrubbing hand goes, m."""
PRESSED = 0.01
"""How far below itself the hand aims, m: the arm yields to that with some newtons."""
ALONG_COUNTER_BACK = 0.25
"""How far the base draws back before it drives along the counter, m: appliances stand on it."""
ROUND = 10
"""Points of a round."""
PASSED = 0.012
"""Distance on the level at which the hand turns to the next point, m."""


def scrub(arm: Arm, board_role: str, role: str) -> Motion:
    """Rub a held thing round on another one, along its long side, then let go of it there."""
    board = Thing(arm, board_role)
    across, along = (side[0] for side in board.sides())
    yield from arm.drive(arm.base - ALONG_COUNTER_BACK * arm.forward)
    yield from carry_over(arm, role, board.centre, board.highest)
    yield from set_upon(arm, role)
    middle, hand = arm.position, arm.rotation
    for angle in np.linspace(0.0, 4.0 * math.pi, 2 * ROUND + 1).tolist():
        way = STROKE[0] * math.cos(angle) * along + STROKE[1] * math.sin(angle) * across
        target = (middle + way)[:2]

        def pressing(target: Array = target) -> Array:
            return np.append(target, arm.position[2] - PRESSED)

        def passed(target: Array = target) -> bool:
            return float(np.linalg.norm(target - arm.position[:2])) < PASSED

        yield from arm.move(pressing, hand, speed=0.4, steps=40, until=passed, required=False)
    yield from set_down(arm, role)
    yield from leave(arm)
