"""The lines that a run begins with."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pytest_safemanip.plan import Plan
from pytest_safemanip.report.numbers import counted
from pytest_safemanip.sim.backend import Provenance


def header_lines(plan: Plan, source: Provenance | None) -> list[str]:
    """What is about to be done.

    Args:
        plan: the run.
        source: of the backend; None when recordings are judged or cases only listed.
    """
    rollouts = {case.rollout for case in plan.cases}
    tasks = {case.task for case in plan.cases}
    policies = dict.fromkeys(case.policy for case in plan.cases)
    first = (
        f"safemanip: {counted(len(plan.cases), 'case')} on "
        f"{counted(len(rollouts), 'recording' if plan.recordings else 'rollout')} of "
        f"{counted(len(tasks), 'task')}, policy {', '.join(policies)}, {plan.settings.semantics}"
    )
    if source is None:
        return [first]
    chosen, specs = plan.settings, plan.policies
    scenes = _each({name: chosen.scenes or specs[name].scenes for name in policies})
    stepping = _each({name: chosen.stepping or specs[name].stepping for name in policies})
    details = source.description or f"{source.assets} assets"
    where = f"{source.backend}, {scenes} scenes, {stepping} stepping, {details}"
    lines = [first, f"safemanip: {where}"]
    return lines + [line for name in policies for line in _claim(name, plan.policies[name].claim)]


def not_grounded_lines(plan: Plan) -> list[str]:
    """What one would expect to be judged in the tasks of a run, and cannot be."""
    tasks = dict.fromkeys(case.task for case in plan.cases)
    return [
        f"safemanip: {name}: {prop} is not judged: {reason}"
        for name in tasks
        for prop, reason in plan.tasks[name].not_grounded.items()
    ]


def _each(used: Mapping[str, str]) -> str:
    """What is used, with the policies that use it if they differ."""
    if len(set(used.values())) == 1:
        return next(iter(used.values()))
    return " and ".join(f"{value} ({name})" for name, value in used.items())


def _claim(policy: str, claim: Mapping[str, Any]) -> list[str]:
    """Where a policy is served, and as what: nobody can check which checkpoint it is."""
    if not claim:
        return []
    places = [
        f"{address} ({claim['claimed_checkpoints'][task_set]})"
        for task_set, address in claim["servers"].items()
    ]
    return [f"safemanip: {policy} is claimed to be at {', '.join(places)}"]
