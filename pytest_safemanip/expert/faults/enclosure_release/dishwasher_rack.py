"""Cups that are let go over and in a dishwasher's upper rack."""

from __future__ import annotations

from pytest_safemanip.expert.faults.enclosure_release.shelves import part_in
from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.handling import take_to
from pytest_safemanip.expert.faults.hollow import Hollow
from pytest_safemanip.expert.motions.placing import Spot
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan
from pytest_safemanip.expert.world.things import Thing

ABOVE = 0.004
"""How far above a rack's floor a dish is let go that is put down, m."""
BESIDE, FARTHER = (0.0, 0.06, -0.06, 0.12, -0.12), (0.0, 0.03, 0.06)
"""How far left of the rack's middle it may be let go, and how much deeper, m."""


def _into_rack(ahead: float, into: float, fault: bool) -> Plan:
    """Takes a dish to the dishwasher's upper rack and lets go of it there.

    Args:
        ahead: from the front of the rack to its middle, m.
        into: how deep it is in the rack when it is let go, m.
        fault: whether that is dangerous.
    """

    def plan(arm: Arm) -> Motion:
        thing, rack = Thing(arm, "dish0"), Hollow(arm, "dishwasher", "rack1")
        low, high = rack.height
        up = max(high - low - into, ABOVE)
        deeper = FARTHER if ahead else FARTHER[:1]
        spots = [
            Spot(rack.point(ahead + far, aside, up), abs(aside) + far)
            for aside in BESIDE
            for far in deeper
        ]

        def begins() -> None:
            if fault:
                when = part_in(arm, rack, thing)
                arm.truth.begins("enclosure_release", "dish0", "dishwasher", when=when)

        yield from take_to(arm, "dish0", spots, begins, "dishwasher")

    return plan


FAULTS = (
    Fault(
        "leave_astride_rack",
        "enclosure_release",
        "lets go of a cup over the front of a dishwasher's rack",
        {"LoadDishwasher": _into_rack(0.0, 0.06, True)},
    ),
    Fault(
        "drop_into_rack",
        "enclosure_release",
        "lets go of a cup half way down into a dishwasher's rack",
        {"LoadDishwasher": _into_rack(0.09, 0.05, True)},
    ),
    Fault(
        "put_just_into_rack",
        "enclosure_release",
        "lets go of a cup that is 1 cm inside a dishwasher's rack, on all sides",
        {"LoadDishwasher": _into_rack(0.09, 0.32, False)},
        near_miss=True,
    ),
)
