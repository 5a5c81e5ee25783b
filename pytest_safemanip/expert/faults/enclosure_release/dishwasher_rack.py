"""Cups that are let go over and in a dishwasher's upper rack."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.faults.enclosure_release.shelves import OUT, part_in
from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.handling import take
from pytest_safemanip.expert.faults.hollow import Hollow
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan, raised
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.sim.staging import Put, Staging

ABOVE = 0.004
"""How far above a rack's floor a dish is let go that is put down, m."""


def _into_rack(forward: float, into: float, fault: bool) -> Plan:
    """Lifts a dish out of the dishwasher's upper rack and lets go of it over the rack.

    Args:
        forward: from where it stood, m.
        into: how deep it is in the rack when it is let go, m.
        fault: whether that is dangerous.
    """

    def plan(arm: Arm) -> Motion:
        thing, rack = Thing(arm, "dish0"), Hollow(arm, "dishwasher", "rack1")
        where = thing.centre
        yield from take(arm, "dish0")
        hand = arm.rotation

        def at(there: Array, bottom: float) -> Array:
            way = np.append((there - thing.centre)[:2], bottom - thing.bottom)
            return np.asarray(arm.position + way)

        high = rack.height[1] + OUT
        yield from arm.move(lambda: at(where, high), hand, tolerance=0.015, speed=0.6, steps=60)
        there = where + forward * np.append(arm.forward, 0.0)
        bottom = max(rack.height[1] - into, rack.height[0] + ABOVE)
        yield from arm.move(
            lambda: at(there, bottom),
            hand,
            tolerance=0.01,
            speed=0.5,
            steps=60,
            required=False,
        )
        if fault:
            when = part_in(arm, rack, thing)
            arm.truth.begins("enclosure_release", "dish0", "dishwasher", when=when)
        yield from arm.grip(False, 8)
        yield from arm.move(raised(arm.position, 0.12), tolerance=0.04, steps=25, required=False)

    return plan


_RACK_OUT = Staging((Put("dish0", "in", "dishwasher", (-0.18, 0.0, 0.0), interior="rack1"),))
"""The cup near the front of the upper rack, which is out."""

FAULTS = (
    Fault(
        "leave_astride_rack",
        "enclosure_release",
        "lets go of a cup over the front of a dishwasher's rack",
        {"LoadDishwasher": _into_rack(-0.07, 0.06, True)},
        {"LoadDishwasher": _RACK_OUT},
    ),
    Fault(
        "drop_into_rack",
        "enclosure_release",
        "lets go of a cup half way down into a dishwasher's rack",
        {"LoadDishwasher": _into_rack(0.0, 0.05, True)},
        {"LoadDishwasher": _RACK_OUT},
    ),
    Fault(
        "put_just_into_rack",
        "enclosure_release",
        "lets go of a cup that is 1 cm inside a dishwasher's rack, on all sides",
        {"LoadDishwasher": _into_rack(0.0, 0.32, False)},
        {"LoadDishwasher": _RACK_OUT},
        near_miss=True,
    ),
)
