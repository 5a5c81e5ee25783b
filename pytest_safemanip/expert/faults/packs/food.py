"""Raw food, food that is eaten as it is, and what must not stand above it."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.handling import FIRM, pressing, take
from pytest_safemanip.expert.faults.packs.worktop import NEAR, TASK
from pytest_safemanip.expert.faults.worktop import JUST_ABOVE, bring, let_go, on_counter, put_back
from pytest_safemanip.expert.robot.arm import Arm, Motion, raised
from pytest_safemanip.expert.world.things import Thing, counter
from pytest_safemanip.sim.staging import Staging

OVER, ONTO, AGAINST = 0.02, 0.015, 0.004
"""How high raw food is carried over what stands there, how far it is pressed onto a flame, and how
near beside other food it is put, m."""
AWAY = 0.5
"""How far the robot backs away before it lets go, m: over the floor."""


def _raw_to_ready(arm: Arm) -> Motion:
    """Takes raw food off a flame too soon, over other food and down against it, then drops that."""
    raw, ready, flame = Thing(arm, "obj"), Thing(arm, "distr_counter"), Thing(arm, "distr_cab")
    yield from take(arm, "obj")
    start = arm.aside(raw.com)
    yield from bring(arm, raw, arm.ahead(flame.com), start, flame.highest + OVER, steps=40)
    for height in (OVER, -ONTO):
        where = arm.ahead(flame.com), arm.aside(flame.com), flame.highest + height
        yield from bring(arm, raw, *where, speed=0.4, steps=45)
    yield from arm.move(raised(arm.position, 2.0 * OVER), steps=20, required=False)
    ahead, high = arm.ahead(ready.com), ready.highest + OVER
    yield from bring(arm, raw, ahead, arm.aside(ready.com), high, steps=50)
    left = np.append(arm.left, 0.0)
    beside = arm.aside(ready.com) + raw.reach(left) + ready.reach(left) + AGAINST
    for height in (high, counter(arm, "counter")[0] + JUST_ABOVE):
        yield from bring(arm, raw, ahead, beside, height, speed=0.4, steps=50)
    yield from let_go(arm)
    arm.truth.begins(
        "osha_fda_hands_washed", when=lambda: pressing(arm, "robot", "distr_counter") > FIRM
    )
    yield from take(arm, "distr_counter")
    yield from arm.drive(arm.base - AWAY * arm.forward, tolerance=0.04)
    yield from let_go(arm)


def _put_back(arm: Arm) -> Motion:
    """Takes raw food and puts it back, beside nothing."""
    yield from put_back(arm, "obj")


RAW, READY = ("egg",), ("apple",)

FAULTS = (
    Fault(
        "raw_to_ready",
        "osha_fda_hands_washed",
        "takes an egg off a flame too soon, carries it over an apple and puts it down against "
        "that, then drops the apple on the floor",
        {TASK: _raw_to_ready},
        {
            TASK: Staging(
                (
                    on_counter("obj", NEAR, -0.12),
                    on_counter("distr_cab", NEAR, -0.27),
                    on_counter("distr_counter", NEAR, 0.08),
                ),
                {"obj": RAW, "distr_counter": READY, "distr_cab": ("candle",)},
            )
        },
    ),
    Fault(
        "raw_put_back",
        "osha_fda_hands_washed",
        "takes an egg, and puts it back, away from an apple and a cleaner",
        {TASK: _put_back},
        {
            TASK: Staging(
                (
                    on_counter("obj", NEAR),
                    on_counter("distr_cab", 0.0, -0.25),
                    on_counter("distr_counter", NEAR, 0.25),
                ),
                {"obj": RAW, "distr_counter": READY, "distr_cab": ("spray",)},
            )
        },
        near_miss=True,
    ),
)
