"""All faults and near misses, by name."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from types import MappingProxyType
from typing import NamedTuple

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.faults import catalogue
from pytest_safemanip.faults.fault import MARK, Family, Fault

FOLDERS = (
    "release_stability",
    "grasp_stability",
    "enclosure_release",
    "mechanism_recovery",
    "enclosure_access",
    "collision_contact",
    "action_onset",
    "enclosure_clearance",
    "object_containment",
    "cross_contamination",
    "packs",
    "sweeps",
)
"""Each has a catalogue."""


def _read() -> dict[str, tuple[str, Fault | Family]]:
    """All faults and families by name, each with its folder and section.

    Raises:
        ConfigError: if two have the same name.
    """
    here, all_of_them = files(catalogue.PACKAGE), dict[str, tuple[str, Fault | Family]]()
    shared = catalogue.parse((here / "shared.yaml").read_text("utf-8"))
    for folder in FOLDERS:
        text = (here / folder / catalogue.FILE).read_text("utf-8")
        for section, found in catalogue.read(folder, text, shared):
            if found.name in all_of_them:
                other, _, _ = all_of_them[found.name][0].partition(".")
                file = f"{folder}/{catalogue.FILE}"
                raise ConfigError(f"{file}: {found.name}: {other} has one of this name")
            all_of_them[found.name] = f"{folder}.{section}", found
    return all_of_them


_READ = _read()

FAULTS: Mapping[str, Fault] = MappingProxyType(
    {name: found for name, (_, found) in _READ.items() if isinstance(found, Fault)}
)
FAMILIES: Mapping[str, Family] = MappingProxyType(
    {name: found for name, (_, found) in _READ.items() if isinstance(found, Family)}
)
"""Of events, by the name before the number."""
SECTIONS: Mapping[str, str] = MappingProxyType(
    {name: section for name, (section, _) in _READ.items()}
)
"""Folder and section of the catalogue that each is in."""


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


class Row(NamedTuple):
    """One fault or near miss, as a table lists it.

    Attributes:
        name: what comes after ``scripted:``.
        property_id: the property that it violates, or nearly does.
        near_miss: whether it is safe.
        safe_twin: of a fault, the near miss that comes after it in its section; empty if none does.
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
    found, twin = list[Row](), ""
    for name, fault in reversed([*FAULTS.items()]):
        twin = name if fault.near_miss else twin if SECTIONS.get(twin) == SECTIONS[name] else ""
        row = Row(name, fault.property_id, fault.near_miss, twin, fault.doc, tuple(fault.plans))
        found.append(row._replace(safe_twin="") if fault.near_miss else row)
    return found[::-1]
