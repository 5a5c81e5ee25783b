"""The hand in fridges and freezers that are not open, and in open ones."""

from __future__ import annotations

from dataclasses import replace

from pytest_safemanip.policies.scripted.arm import Arm, Motion
from pytest_safemanip.policies.scripted.closing import FOLDED, push_door
from pytest_safemanip.policies.scripted.faults.fault import Fault
from pytest_safemanip.policies.scripted.faults.reaching import opened, pair
from pytest_safemanip.policies.scripted.faults.way import ROUND_COUNTER, Way, reach
from pytest_safemanip.policies.scripted.plans import Plan
from pytest_safemanip.policies.scripted.things import Furniture
from pytest_safemanip.sim.staging import SetOpen, Staging

PUSHED_TO = 0.79
"""Openness at which a door that is pushed is left: any further, it is in the base's way."""
_FREEZER = Way(
    "fridge",
    "freezer_shelf3",
    # Round the open door, and not into that of the fridge either.
    stands=((-0.95, None), (-0.95, -0.31), (-0.42, -0.31)),
    before=((-0.13, -0.05, 0.13),),
    within=(0.10, -0.05, 0.13),
    pitch=75.0,
    roll=90.0,
    door="freezer_door_joint",
)
_FRIDGE = Way(
    "fridge",
    "fridge_shelf3",
    # From the left: its door opens to the right.
    stands=((-0.95, None), (-0.95, 0.32), (-0.42, 0.32)),
    before=((-0.13, 0.06, 0.15),),
    within=(0.10, 0.06, 0.15),
    pitch=75.0,
    roll=90.0,
    door="fridge_door_joint",
)
_FAR_FRIDGE = replace(
    _FRIDGE,
    stands=(*ROUND_COUNTER, (-0.95, 0.32), (-0.42, 0.32)),
)


def _push_and_reach(way: Way) -> Plan:
    """Pushes a fridge's open door some way shut, then reaches into it."""

    def plan(arm: Arm) -> Motion:
        fixture = Furniture(arm, way.role)
        joint = fixture.joint(way.door)
        yield from arm.grip(True)
        yield from push_door(arm, fixture, joint, PUSHED_TO)
        # Stretched out, it would meet the freezer's door before the base is where it has to be.
        ahead, height, pitch = FOLDED
        tucked = arm.point(arm.ahead(arm.base) + ahead, arm.aside(arm.base), height)
        yield from arm.move(tucked, arm.hand(pitch), tolerance=0.05, turn_tolerance=0.3)
        yield from reach(way, True)(arm)

    return plan


_FREEZER_DOOR, _FRIDGE_DOOR = "freezer_door_joint", "fridge_door_joint"

_AT_FRIDGE = ("GarnishPancake", "MakeIceLemonade", "PackIdenticalLunches")
"""Tasks that begin so close to a fridge that its door cannot stand half open."""

CHILLED = (
    *pair(
        "freezer",
        "a freezer, its door half open, beside an open fridge",
        {"SeparateFreezerRack": "fridge"},
        _FREEZER,
        opened((0.75, _FREEZER_DOOR), (1.0, _FRIDGE_DOOR)),
        opened((0.94, _FREEZER_DOOR), (1.0, _FRIDGE_DOOR)),
    ),
    *pair(
        "fridge",
        "a fridge, its door half open",
        {"StoreLeftoversInBowl": "fridge"},
        _FAR_FRIDGE,
        opened((0.75, _FRIDGE_DOOR)),
        opened((0.94, _FRIDGE_DOOR)),
    ),
    Fault(
        "push_and_reach",
        "enclosure_access",
        "pushes a fridge's door some way shut, and reaches past it",
        dict.fromkeys(_AT_FRIDGE, _push_and_reach(_FRIDGE)),
        dict.fromkeys(_AT_FRIDGE, Staging((SetOpen("fridge", 0.94, _FRIDGE_DOOR),))),
    ),
    Fault(
        "reach_past_open_door",
        "enclosure_access",
        "reaches past a fridge's door that is open",
        dict.fromkeys(_AT_FRIDGE, reach(_FRIDGE, False)),
        dict.fromkeys(_AT_FRIDGE, Staging((SetOpen("fridge", 0.94, _FRIDGE_DOOR),))),
        near_miss=True,
    ),
)
