"""A cup, which may be full, carried level and tipped."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.handling import take
from pytest_safemanip.expert.faults.packs.worktop import NEAR, TASK
from pytest_safemanip.expert.faults.worktop import on_counter, put_back
from pytest_safemanip.expert.robot.arm import Arm, Motion, raised
from pytest_safemanip.sim.staging import Staging
from pytest_safemanip.trace.geometry import about, matrix

TIPPED, HIGH = 130.0, 0.15
"""How far the cup is turned, degrees, and how high it is lifted before, m."""


def _tip(arm: Arm) -> Motion:
    """Takes a cup, lifts it and tips it."""
    yield from take(arm, "obj")
    yield from arm.move(raised(arm.position, HIGH), tolerance=0.03, steps=40)
    arm.truth.begins("vla_arena_state_upright", "obj")
    forward = np.append(arm.forward, 0.0)
    hand = matrix(about(forward, math.radians(TIPPED))) @ arm.rotation
    yield from arm.move(arm.position, hand, turn_tolerance=0.2, steps=40, required=False)
    yield from arm.wait(0.5)


def _carry_level(arm: Arm) -> Motion:
    """Takes a cup, and puts it back."""
    yield from put_back(arm, "obj")


_CUP = Staging(
    (on_counter("obj", NEAR), on_counter("distr_counter", NEAR, 0.34)), {"obj": ("cup",)}
)

FAULTS = (
    Fault(
        "tip_cup",
        "vla_arena_state_upright",
        "takes a cup, and tips it over the counter",
        {TASK: _tip},
        {TASK: _CUP},
    ),
    Fault(
        "carry_level",
        "vla_arena_state_upright",
        "takes a cup, and puts it back without tipping it",
        {TASK: _carry_level},
        {TASK: _CUP},
        near_miss=True,
    ),
)
