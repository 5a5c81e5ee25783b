"""All faults and near misses, by name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType, ModuleType
from typing import NamedTuple

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.expert.faults.action_onset import burners, pick_and_place, switching
from pytest_safemanip.expert.faults.collision_contact import bumps, sweep
from pytest_safemanip.expert.faults.cross_contamination import passed_on, raw_food
from pytest_safemanip.expert.faults.enclosure_access import fridge, not_open
from pytest_safemanip.expert.faults.enclosure_clearance import microwave
from pytest_safemanip.expert.faults.enclosure_release import cabinet, dishwasher_rack, shelves
from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.grasp_stability import loosened
from pytest_safemanip.expert.faults.mechanism_recovery import appliances, drawer
from pytest_safemanip.expert.faults.mechanism_recovery import cabinet as cabinet_door
from pytest_safemanip.expert.faults.object_containment import beside, bowl, pouring
from pytest_safemanip.expert.faults.packs import appliances as packs_appliances
from pytest_safemanip.expert.faults.packs import cups as packs_cups
from pytest_safemanip.expert.faults.packs import food as packs_food
from pytest_safemanip.expert.faults.packs import obstacles as packs_obstacles
from pytest_safemanip.expert.faults.packs import sink as packs_sink
from pytest_safemanip.expert.faults.packs import unseen as packs_unseen
from pytest_safemanip.expert.faults.packs import worktop as packs_worktop
from pytest_safemanip.expert.faults.release_stability import any_task, drops
from pytest_safemanip.expert.faults.sweeps import FAMILIES, MARK, Family

MODULES: tuple[ModuleType, ...] = (
    drops,
    loosened,
    cabinet,
    shelves,
    dishwasher_rack,
    drawer,
    cabinet_door,
    appliances,
    not_open,
    fridge,
    sweep,
    bumps,
    pick_and_place,
    switching,
    burners,
    microwave,
    bowl,
    beside,
    pouring,
    raw_food,
    passed_on,
    any_task,
    packs_worktop,
    packs_sink,
    packs_appliances,
    packs_food,
    packs_obstacles,
    packs_unseen,
    packs_cups,
)
"""Each has a tuple ``FAULTS``."""

FAULTS: Mapping[str, Fault] = MappingProxyType(
    {fault.name: fault for module in MODULES for fault in module.FAULTS}
)

HOMES: Mapping[str, str] = MappingProxyType(
    {fault.name: module.__name__ for module in MODULES for fault in module.FAULTS}
)
"""The module that each fault is defined in."""


def find(text: str) -> Fault:
    """A fault or near miss by its name, or one of a family of events: ``slip@0.03``.

    Raises:
        ConfigError: if there is none.
    """
    name, _, value = text.partition(MARK)
    if name in FAMILIES:
        return FAMILIES[name].at(value)
    if text not in FAULTS:
        known = {*FAULTS, *(f"{name}{MARK}NUMBER" for name in FAMILIES)}
        hint = did_you_mean(text, known, "safemanip faults")
        raise ConfigError(f"unknown fault 'scripted:{text}'; {hint}")
    return FAULTS[text]


def home(name: str) -> str:
    """The module that a fault, a near miss or an event of a family is defined in."""
    return HOMES.get(name, Family.__module__)


class Row(NamedTuple):
    """One fault or near miss, as a table lists it.

    Attributes:
        name: what comes after ``scripted:``.
        property_id: the property that it violates, or nearly does.
        near_miss: whether it is safe.
        safe_twin: of a fault, the near miss that comes after it in its module; empty if none does.
        doc: what it does.
        tasks: the tasks in which it can do it.
    """

    name: str
    property_id: str
    near_miss: bool
    safe_twin: str
    doc: str
    tasks: tuple[str, ...]


def rows() -> list[Row]:
    """All faults and near misses, those of a property together."""
    twins, twin = {}, ""
    for name, fault in reversed(list(FAULTS.items())):
        twin = name if fault.near_miss else twin if HOMES.get(twin) == HOMES[name] else ""
        twins[name] = "" if fault.near_miss else twin
    properties = list(dict.fromkeys(fault.property_id for fault in FAULTS.values()))
    found = [
        Row(name, fault.property_id, fault.near_miss, twins[name], fault.doc, tuple(fault.plans))
        for name, fault in FAULTS.items()
    ]
    return sorted(found, key=lambda row: properties.index(row.property_id))
