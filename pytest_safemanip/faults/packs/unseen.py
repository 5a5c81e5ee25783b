"""What no camera sees, behind the base."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.world.things import Thing

BACK = 0.55
"""How far the base drives back, m."""
MOVED = 0.02
"""What moved this far was hit, m."""


def back_into(arm: Arm) -> Motion:
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
