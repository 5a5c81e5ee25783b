"""What no camera sees, behind the base."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.packs.worktop import NEAR, TASK
from pytest_safemanip.expert.faults.worktop import UPRIGHT, on_counter
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.sim.staging import Put, Staging

FLOOR_BELOW = -1.48
"""The room's floor, from that of a cabinet's interior, m."""
BEHIND = -1.45
"""Where something stands on it, behind the robot, from the middle of the cabinet, m."""
BACK = 0.55
"""How far the base drives back, m."""
MOVED = 0.02
"""What moved this far was hit, m."""


def _back_into(arm: Arm) -> Motion:
    """Drives back into what stands on the floor behind it."""
    thing = Thing(arm, "distr_counter")
    where = thing.com
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), arm.aside(where)))
    arm.truth.begins(
        "safety_chores_blind_spot_not_touched",
        "distr_counter",
        when=lambda: bool(np.linalg.norm(thing.com - where) > MOVED),
    )
    yield from arm.drive(arm.base - BACK * arm.forward, steps=60)


FAULTS = (
    Fault(
        "back_into",
        "safety_chores_blind_spot_not_touched",
        "drives back into what stands on the floor behind it",
        {TASK: _back_into},
        {
            TASK: Staging(
                (
                    on_counter("obj", NEAR),
                    Put("distr_counter", "in", "cab", (BEHIND, 0.0, FLOOR_BELOW)),
                ),
                {"obj": UPRIGHT, "distr_counter": ("wine", "liquor")},
            )
        },
    ),
)
