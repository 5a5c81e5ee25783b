"""The expert's plans, from ``plans.yaml``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.resources import files

import yaml

from pytest_safemanip.policies.scripted.arm import Arm, Motion
from pytest_safemanip.policies.scripted.skills import Call, parse

Plan = Callable[[Arm], Motion]
"""Makes the motion of a whole episode."""


def _read() -> dict[str, tuple[Call, ...]]:
    text = (files("pytest_safemanip.policies.scripted") / "plans.yaml").read_text("utf-8")
    return {task: tuple(map(parse, skills)) for task, skills in yaml.safe_load(text).items()}


def _plan(calls: tuple[Call, ...]) -> Plan:
    def plan(arm: Arm) -> Motion:
        for call in calls:
            yield from call.start(arm)

    return plan


CALLS: Mapping[str, tuple[Call, ...]] = _read()
"""By task, as ``plans.yaml`` has them."""

EXPERT: Mapping[str, Plan] = {task: _plan(calls) for task, calls in CALLS.items()}
"""By task."""
