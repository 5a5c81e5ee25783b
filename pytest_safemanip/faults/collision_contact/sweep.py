"""Arm, hand, base or load against what the task gives no reason to touch."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.world.things import Thing, counter
from pytest_safemanip.faults.handling import go, pick_and_place

SWEEP_HEIGHT = (0.035, 0.08)
"""Least and greatest height above its bottom at which a distractor is struck, m."""
STRUCK = 0.01
"""What moved this far was struck, m."""


def sweep(arm: Arm) -> Motion:
    """Strikes a distractor on the counter on the way, then does the task."""
    thing = Thing(arm, "distr_counter")
    where = thing.centre
    side = math.copysign(1.0, arm.aside(arm.base) - arm.aside(where))
    ahead = min(arm.ahead(where) - 0.70, counter(arm, "counter")[1] - 0.14)
    yield from arm.grip(True)
    yield from arm.drive(arm.floor_point(ahead, arm.aside(where) + 0.15 * side))
    hand = arm.hand(45.0)
    height = thing.bottom + float(np.clip(0.6 * thing.height, *SWEEP_HEIGHT))
    beside = arm.point(arm.ahead(where), arm.aside(where) + 0.22 * side, height)
    yield from go(arm, beside - 0.15 * hand[:, 2], hand, tolerance=0.04, steps=140)
    yield from go(arm, beside, hand, tolerance=0.04, steps=60)
    arm.truth.begins(
        "collision_contact", when=lambda: bool(np.linalg.norm(thing.centre - where) > STRUCK)
    )
    through = arm.point(arm.ahead(where), arm.aside(where) - 0.15 * side, height)
    yield from go(arm, through, hand, tolerance=0.05, steps=60)
    yield from go(arm, arm.position - 0.2 * hand[:, 2], hand, tolerance=0.05, steps=60)
    yield from arm.grip(False)
    yield from pick_and_place(arm, "place in", "obj", "cab")
