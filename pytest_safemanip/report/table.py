"""The summary that a run ends with, as lines of text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pytest_safemanip.metrics.rates import Group, Metrics, Rate, by_policy, measure
from pytest_safemanip.metrics.records import RolloutRecord
from pytest_safemanip.plan import Plan
from pytest_safemanip.report.results import Results
from pytest_safemanip.sim.backend import Provenance

_COLUMNS = ("category", "triggered", "violated", "rate (95 %)", "exposure", "unresolved")


def summary_lines(results: Results) -> list[str]:
    """Metrics of each policy, then what is incomplete."""
    lines: list[str] = []
    for policy, records in by_policy(results.records).items():
        lines += ["", *_policy_lines(policy, measure(records)), *_served_lines(records)]
    missing = len(results.missing)
    if missing:
        lines += ["", f"{missing} of {len(results.expected)} cases were not run"]
    return lines[1:]


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
    used = {name: plan.settings.scenes or plan.policies[name].scenes for name in policies}
    scenes = next(iter(used.values()))
    if len(set(used.values())) > 1:
        scenes = " and ".join(f"{family} ({name})" for name, family in used.items())
    details = source.description or f"{source.assets} assets"
    lines = [first, f"safemanip: {source.backend}, {scenes} scenes, {details}"]
    return lines + [line for name in policies for line in _claim(name, plan.policies[name].claim)]


def _claim(policy: str, claim: Mapping[str, Any]) -> list[str]:
    """Where a policy is served, and as what: nobody can check which checkpoint it is."""
    if not claim:
        return []
    places = [
        f"{address} ({claim['claimed_checkpoints'][task_set]})"
        for task_set, address in claim["servers"].items()
    ]
    return [f"safemanip: {policy} is claimed to be at {', '.join(places)}"]


def _policy_lines(policy: str, metrics: Metrics) -> list[str]:
    complete = metrics.rollouts - metrics.errors
    errors = f", {metrics.errors} with errors" if metrics.errors else ""
    lines = [f"{policy}: {counted(complete, 'complete rollout')}{errors}"]
    if not complete:
        return lines
    outcomes = ", ".join(f"{n} {name.replace('_', ' ')}" for name, n in metrics.outcomes.items())
    return [
        *lines,
        f"  success    {_rate(metrics.success)}",
        f"  violation  {_rate(metrics.violated)}",
        f"  outcomes   {outcomes}",
        f"  unsafe successes  {_rate(metrics.unsafe_successes)}",
        "",
        *_group_table(metrics.categories),
    ]


def _served_lines(records: Sequence[RolloutRecord]) -> list[str]:
    """What was exchanged with a policy's server, and what is not known about it."""
    served = [record.served for record in records if record.served]
    if not served:
        return []
    protocols = ", ".join(dict.fromkeys(facts["protocol"] for facts in served))
    calls, actions, clipped = (
        sum(int(facts[name]) for facts in served) for name in ("calls", "actions", "clipped")
    )
    lines = [
        f"  server     {protocols}; {counted(calls, 'call')}, {counted(actions, 'action')}, "
        f"{clipped} of their {12 * actions} entries outside [-1, 1] and clipped"
    ]
    if any(facts["seeded"] == "no" for facts in served):
        lines.append("  seeds      of the simulator only: the server takes none")
    return lines


def _group_table(groups: Mapping[str, Group]) -> list[str]:
    """One row per category; where it applies and is not triggered, it is vacuous."""
    rows = [_COLUMNS]
    for name, group in groups.items():
        violated = group.violated
        rows.append(
            (
                name,
                f"{group.triggered.hits} of {group.triggered.total}",
                f"{violated.hits} of {violated.total}",
                f"{_percent(violated.value)} ({_interval(violated)})",
                _percent(group.exposure),
                str(group.unresolved),
            )
        )
    widths = [max(len(row[n]) for row in rows) for n in range(len(_COLUMNS))]
    return [
        f"  {row[0]:<{widths[0]}}"
        + "".join(f"  {cell:>{width}}" for cell, width in zip(row[1:], widths[1:], strict=True))
        for row in rows
    ]


def _rate(rate: Rate) -> str:
    if rate.value is None:
        return "undefined (no case)"
    return f"{rate.hits} of {rate.total} = {_percent(rate.value)} ({_interval(rate)})"


def _interval(rate: Rate) -> str:
    bounds = rate.interval
    return "-" if bounds is None else f"{bounds[0] * 100:.0f} to {bounds[1] * 100:.0f} %"


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{value * 100:.1f} %"


def counted(number: int, noun: str) -> str:
    """A number of things, in words: "1 case", "2 cases"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"
