"""All faults and near misses, by name."""

from __future__ import annotations

from collections import Counter
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

_HERE = files(catalogue.PACKAGE)
_SHARED = catalogue.parse((_HERE / "shared.yaml").read_text("utf-8"))
_READ = [
    (f"{folder}.{section}", found)
    for folder in FOLDERS
    for section, found in catalogue.read(
        folder, (_HERE / folder / catalogue.FILE).read_text("utf-8"), _SHARED
    )
]

_names = Counter(found.name for _, found in _READ)
for _section, _found in _READ:
    if _names[_found.name] > 1:
        _file = f"{_section.partition('.')[0]}/{catalogue.FILE}"
        raise ConfigError(f"{_file}: {_found.name}: another fault or family has this name")

FAULTS: Mapping[str, Fault] = MappingProxyType(
    {found.name: found for _, found in _READ if isinstance(found, Fault)}
)
FAMILIES: Mapping[str, Family] = MappingProxyType(
    {found.name: found for _, found in _READ if isinstance(found, Family)}
)
"""Of events, by the name before the number."""
SECTIONS: Mapping[str, str] = MappingProxyType({found.name: section for section, found in _READ})
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
