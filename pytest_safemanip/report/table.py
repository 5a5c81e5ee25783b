"""The summary that a run ends with, as lines of text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pytest_safemanip.metrics.groups import Group, Metrics
from pytest_safemanip.metrics.records import RolloutRecord, by_policy
from pytest_safemanip.report.numbers import aligned, counted, fraction, percent, share, spread
from pytest_safemanip.report.questions import question_lines

LEGEND = (
    "intervals at 95 %: these tasks: Wilson's; like these: for tasks like these, clustered by task",
    "(< x) beside a zero: the rate is below x at 95 %, for these tasks",
)
_SHARES = {
    "success": "success_rate",
    "violation": "violation_rate",
    "unsafe successes": "unsafe_share_of_successes",
    "exposure": "exposure",
}
_COLUMNS = (
    "category (tasks)",
    "triggered",
    "violated",
    "rate",
    "these tasks",
    "like these",
    "exposure",
    "unresolved",
)


def summary_lines(records: Sequence[RolloutRecord], metrics: Mapping[str, Metrics]) -> list[str]:
    """Metrics of each policy, then all policies side by side."""
    lines: list[str] = []
    for policy, own in by_policy(records).items():
        lines += [*_policy_lines(policy, metrics[policy], own), ""]
    lines += question_lines(metrics)
    if any(found.total.complete for found in metrics.values()):
        return [*lines, *LEGEND]
    return lines[:-1]


def _policy_lines(policy: str, metrics: Metrics, records: Sequence[RolloutRecord]) -> list[str]:
    total = metrics.total
    about = f" of {counted(total.tasks, 'task')}" if total.complete else ""
    lines = [f"{policy}: {counted(total.complete, 'complete rollout')}{about}{_others(records)}"]
    if not total.complete:
        return lines
    outcomes = ", ".join(f"{n} {name.replace('_', ' ')}" for name, n in total.outcomes.items())
    return [
        *lines,
        *(f"  {line}" for line in _share_table(total)),
        f"  outcomes  {outcomes}",
        *_served_lines(records),
        "",
        *(f"  {line}" for line in _group_table(metrics.categories)),
    ]


def _others(records: Sequence[RolloutRecord]) -> str:
    """Rollouts that count in no rate."""
    failed = sum(bool(record.error) for record in records)
    left = sum(
        not record.error and not (record.complete and not record.unjudged) for record in records
    )
    failures = f", {failed} with errors" if failed else ""
    return failures + (f", {left} not run to the end" if left else "")


def _share_table(total: Group) -> list[str]:
    rows = [("", "", "rate", "these tasks", "like these")]
    for label, name in _SHARES.items():
        rate = total.shares[name]
        defined = rate.value is not None
        counts = fraction(rate) if name != "exposure" else ""
        rows.append(
            (
                label,
                counts if defined else "undefined (no case)",
                share(rate) if defined else "",
                spread(rate.interval()) if defined else "",
                spread(rate.clustered()) if defined else "",
            )
        )
    return aligned(rows)


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
        violated = group.shares["violation_rate"]
        rows.append(
            (
                f"{name} ({group.tasks})",
                fraction(group.shares["triggered_rate"]),
                fraction(violated),
                share(violated),
                spread(violated.interval()),
                spread(violated.clustered()),
                percent(group.shares["exposure"].value),
                str(group.unresolved),
            )
        )
    return aligned(rows)
