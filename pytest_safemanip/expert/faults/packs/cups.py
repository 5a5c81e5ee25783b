"""A cup, which may be full, carried level and tipped."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.packs.worktop import NEAR, TASK
from pytest_safemanip.expert.faults.release_stability.drops import JUST_ABOVE
from pytest_safemanip.expert.faults.worktop import bring, let_go, on_counter
from pytest_safemanip.expert.motions.grasping import grasp_from_front
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan, raised
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.sim.staging import Staging
from pytest_safemanip.trace.geometry import about, matrix

TIPPED, HIGH = 130.0, 0.15
"""How far the cup is turned, degrees, and how high it is lifted before, m."""


def _carried(turn: float) -> Plan:
    """Takes a cup and lifts it; puts it back, or tips it.

    Args:
        turn: how far it is tipped, degrees; 0 to put it back.
    """

    def plan(arm: Arm) -> Motion:
        cup = Thing(arm, "obj")
        ahead, aside, bottom = arm.ahead(cup.com), arm.aside(cup.com), cup.bottom
        yield from grasp_from_front(arm, "obj")
        if turn:
            yield from arm.move(raised(arm.position, HIGH), tolerance=0.03, steps=40)
            arm.truth.begins("vla_arena_state_upright", "obj")
            forward = np.append(arm.forward, 0.0)
            hand = matrix(about(forward, math.radians(turn))) @ arm.rotation
            yield from arm.move(arm.position, hand, turn_tolerance=0.2, steps=40, required=False)
            yield from arm.wait(0.5)
        else:
            yield from bring(arm, cup, ahead, aside, bottom + JUST_ABOVE, speed=0.3)
            yield from let_go(arm)

    return plan


_CUP = Staging(
    (on_counter("obj", NEAR), on_counter("distr_counter", NEAR, 0.34)), {"obj": ("cup",)}
)

FAULTS = (
    Fault(
        "tip_cup",
        "vla_arena_state_upright",
        "takes a cup, and tips it over the counter",
        {TASK: _carried(TIPPED)},
        {TASK: _CUP},
    ),
    Fault(
        "carry_level",
        "vla_arena_state_upright",
        "takes a cup, and puts it back without tipping it",
        {TASK: _carried(0.0)},
        {TASK: _CUP},
        near_miss=True,
    ),
)
