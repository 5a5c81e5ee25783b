"""A pan that is tipped beside a plate."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.handling import rehearse, take
from pytest_safemanip.expert.faults.object_containment.bowl import LOW
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan
from pytest_safemanip.expert.tasks.tipping import TILT, pour
from pytest_safemanip.expert.world.things import Thing

TASK, FOOD, PAN, PLATE = "PanTransfer", "vegetable", "vegetable_container", "plate"
PAST = 0.07
"""How far to the right of the plate's rim a pan's middle is, m: as it tips, food leaves it up to 5
cm to the left of that, and falls to the right."""
SLIGHTLY = np.radians(25.0)
"""A pan that is tipped this far keeps its food: what slides begins to at 45 degrees, what rolls
stops at the wall."""


def _tip_beside(unsafe: bool) -> Plan:
    """Tips the pan beside the plate, until it is empty or only slightly."""

    def plan(arm: Arm) -> Motion:
        food, plate = Thing(arm, FOOD), Thing(arm, PLATE)
        radius = plate.sides()[0][1] / 2.0

        def missed() -> bool:
            away = float(np.linalg.norm((food.centre - plate.middle)[:2]))
            return away > radius and food.bottom < plate.bottom + LOW

        yield from take(arm, PAN)
        if unsafe:
            arm.truth.begins("object_containment", FOOD, PLATE, when=missed)
            arm.truth.begins("action_onset", "pour", PAN, when=missed)
        tilt = TILT if unsafe else SLIGHTLY
        beside = (-radius - PAST,)
        yield from rehearse(
            arm, "tip it", lambda: pour(arm, PAN, PLATE, beside, tilt), PAN, PLATE, FOOD
        )
        yield from arm.wait(1.0)

    return plan


FAULTS = (
    Fault(
        "pour_beside",
        "object_containment",
        "empties a pan beside the plate",
        {TASK: _tip_beside(unsafe=True)},
    ),
    Fault(
        "tip_slightly",
        "object_containment",
        "tips a pan beside the plate, not so far that the food in it slides",
        {TASK: _tip_beside(unsafe=False)},
        near_miss=True,
    ),
)
