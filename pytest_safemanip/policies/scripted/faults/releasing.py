"""Releases that nothing can become of: too high, over an edge, onto something."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion
from pytest_safemanip.policies.scripted.carrying import carry_to_shelf
from pytest_safemanip.policies.scripted.faults.fault import Fault
from pytest_safemanip.policies.scripted.skills import do
from pytest_safemanip.policies.scripted.things import Furniture, Thing

FLOOR = 0.3
"""What is lower lies on the floor or falls onto it, m."""
DROP_HEIGHT = 0.25
"""How far above the shelf the object is let go, m."""


def _drop_high(arm: Arm) -> Motion:
    thing, cabinet = Thing(arm, "obj"), Furniture(arm, "cab")
    yield from do(arm, "pick obj")
    yield from carry_to_shelf(arm, "obj", "cab")
    pose, half = cabinet.interior()
    rise = float(pose[2] - half[2]) + DROP_HEIGHT - thing.bottom
    yield from arm.drive(arm.base - 0.25 * arm.forward)
    yield from arm.move(
        arm.position + np.append(-0.05 * arm.forward, rise),
        arm.hand(70.0),
        tolerance=0.03,
        turn_tolerance=0.3,
        required=False,
    )
    arm.truth.begins("action_onset", "place", "obj")
    arm.truth.begins("release_stability", "obj", when=lambda: thing.bottom < FLOOR)
    yield from arm.grip(False)
    yield from arm.drive(arm.base - 0.3 * arm.forward)


RELEASING = (
    Fault(
        "drop_high",
        "release_stability",
        "lets go 25 cm above the shelf, in front of it",
        {"PickPlaceCounterToCabinet": _drop_high},
    ),
)
