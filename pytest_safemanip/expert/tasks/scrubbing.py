"""Rubbing a board with what is held."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.lowering import set_down, withdraw
from pytest_safemanip.expert.motions.placing import bring
from pytest_safemanip.expert.motions.spots import on_thing
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing

STROKE = (0.095, 0.025)
"""Half the length and width of the rounds that a scrubbing hand goes, m."""
PRESSED = 0.01
"""How far below itself the hand aims, m: the arm yields to that with some newtons."""
ROUND = 10
"""Points of a round."""
PASSED = 0.012
"""Distance on the level at which the hand turns to the next point, m."""


def scrub(arm: Arm, board_role: str, role: str) -> Motion:
    """Rub a held thing round on another one, along its long side, then let go of it there.

    Raises:
        SkillFailed: if there is no way for it.
    """
    thing, board = Thing(arm, role), Thing(arm, board_role)
    reach = yield from bring(arm, thing, lambda: on_thing(arm, board))
    yield from set_down(arm, thing)
    across, along = (side[0] for side in board.sides())
    middle, hand = arm.position, arm.rotation
    for angle in np.linspace(0.0, 4.0 * math.pi, 2 * ROUND + 1).tolist():
        way = STROKE[0] * math.cos(angle) * along + STROKE[1] * math.sin(angle) * across
        target = (middle + way)[:2]

        def pressing(target: Array = target) -> Array:
            return np.append(target, arm.position[2] - PRESSED)

        def passed(target: Array = target) -> bool:
            return float(np.linalg.norm(target - arm.position[:2])) < PASSED

        yield from arm.move(pressing, hand, speed=0.4, steps=40, until=passed, required=False)
    yield from arm.grip(False)
    yield from withdraw(arm, reach)
