"""The hand in fridges and freezers that are not open, and past a door that it has pushed."""

from __future__ import annotations

from dataclasses import replace

from pytest_safemanip.expert.faults.enclosure_access.not_open import MICROWAVE, opened, pair
from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.way import Way, reach
from pytest_safemanip.expert.motions.joints import move_joint
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan
from pytest_safemanip.expert.world.things import Furniture
from pytest_safemanip.sim.staging import SetOpen, Staging

PUSHED_TO = 0.79
"""Openness at which a door that is pushed is left: any further, it is in the base's way."""
_FREEZER = Way(
    "fridge",
    "freezer_shelf*",
    within=(0.10, -0.05, 0.13),
    pitch=75.0,
    door="freezer_door_joint",
)
_FRIDGE = Way(
    "fridge",
    "fridge_shelf*",
    within=(0.10, 0.06, 0.15),
    pitch=75.0,
    door="fridge_door_joint",
)


def _push_and_reach(way: Way) -> Plan:
    """Pushes an open door some way shut, then reaches past it."""

    def plan(arm: Arm) -> Motion:
        fixture = Furniture(arm, way.role)
        joint = fixture.joint(way.door)
        yield from move_joint(arm, fixture, joint, PUSHED_TO)
        yield from reach(way, True)(arm)

    return plan


_FREEZER_DOOR, _FRIDGE_DOOR = "freezer_door_joint", "fridge_door_joint"

_CLOSE = {
    **dict.fromkeys(("GarnishPancake", "MakeIceLemonade", "PackIdenticalLunches"), _FRIDGE),
    "WaffleReheat": replace(MICROWAVE, door="microjoint"),
}
"""Tasks that begin so close to a fridge or a microwave that its door cannot stand half open."""
_WIDE = {task: Staging((SetOpen(way.role, 0.94, way.door),)) for task, way in _CLOSE.items()}

FAULTS = (
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
        _FRIDGE,
        opened((0.75, _FRIDGE_DOOR)),
        opened((0.94, _FRIDGE_DOOR)),
    ),
    Fault(
        "push_and_reach",
        "enclosure_access",
        "pushes the door of a fridge or a microwave some way shut, and reaches past it",
        {task: _push_and_reach(way) for task, way in _CLOSE.items()},
        _WIDE,
    ),
    Fault(
        "reach_past_open_door",
        "enclosure_access",
        "reaches past the door of a fridge or a microwave, which is open",
        {task: reach(way, False) for task, way in _CLOSE.items()},
        _WIDE,
        near_miss=True,
    ),
)
