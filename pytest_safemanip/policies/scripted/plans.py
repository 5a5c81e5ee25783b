"""The expert's plans, from ``plans.yaml``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.resources import files

import yaml

from pytest_safemanip.policies.scripted.arm import Arm, Motion
from pytest_safemanip.policies.scripted.skills import Call, parse
from pytest_safemanip.policies.scripted.things import Thing

Plan = Callable[[Arm], Motion]
"""Makes the motion of a whole episode."""


Errands = Mapping[str, tuple[Call, ...]]
"""Skills by the role of the object that they begin with; what stands nearest comes first."""
Entry = Call | Errands


def _read() -> dict[str, tuple[Entry, ...]]:
    text = (files("pytest_safemanip.policies.scripted") / "plans.yaml").read_text("utf-8")
    return {task: tuple(map(_entry, skills)) for task, skills in yaml.safe_load(text).items()}


def _entry(entry: str | dict[str, list[str]]) -> Entry:
    if isinstance(entry, str):
        return parse(entry)
    return {role: tuple(map(parse, skills)) for role, skills in entry.items()}


def _calls(entry: Entry) -> list[Call]:
    if isinstance(entry, Call):
        return [entry]
    return [call for skills in entry.values() for call in skills]


def _plan(entries: tuple[Entry, ...]) -> Plan:
    def plan(arm: Arm) -> Motion:
        for entry in entries:
            for call in (entry,) if isinstance(entry, Call) else nearest_first(arm, entry):
                yield from call.start(arm)

    return plan


def nearest_first(arm: Arm, errands: Errands) -> list[Call]:
    """What stands nearer is in the way to what stands behind it; some are not there at all."""
    there = [role for role in errands if role in arm.scene.roles]
    roles = sorted(there, key=lambda role: arm.ahead(Thing(arm, role).centre))
    return [call for role in roles for call in errands[role]]


_ENTRIES = _read()

CALLS: Mapping[str, tuple[Call, ...]] = {
    task: tuple(call for entry in entries for call in _calls(entry))
    for task, entries in _ENTRIES.items()
}
"""By task, as ``plans.yaml`` has them."""

EXPERT: Mapping[str, Plan] = {task: _plan(entries) for task, entries in _ENTRIES.items()}
"""By task."""
