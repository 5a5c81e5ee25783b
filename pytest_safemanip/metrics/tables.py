"""The tables of the paper's three research questions, as data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from pytest_safemanip.metrics.groups import Group, Metrics
from pytest_safemanip.metrics.measures import OUTCOMES

Row = dict[str, Any]


def tables(metrics: Mapping[str, Metrics]) -> dict[str, list[Row]]:
    """Success against violation (RQ1), by category (RQ2), by horizon and by suite (RQ3).

    Values are shares; None where undefined, and for a category that a policy never triggered.

    Args:
        metrics: of each policy.
    """
    return {
        "rq1": [
            {
                "policy": policy,
                "success_rate": _value(found.total, "success_rate"),
                "violation_rate": _value(found.total, "violation_rate"),
                "outcomes": {name: _value(found.total, name) for name in OUTCOMES},
            }
            for policy, found in metrics.items()
        ],
        "rq2": rows(metrics, lambda m: m.categories, "category", ("violation_rate", "exposure")),
        "rq3_horizon": rows(metrics, lambda m: m.horizons, "horizon", RQ3),
        "rq3_suite": rows(metrics, lambda m: m.suites, "suite", RQ3),
    }


RQ3 = ("violation_rate", "unsafe_share_of_successes")


def rows(
    metrics: Mapping[str, Metrics],
    groups: Callable[[Metrics], Mapping[str, Group]],
    kind: str,
    shares: tuple[str, ...],
) -> list[Row]:
    """One row per group, with shares of each policy that has it, and the number of tasks."""
    names = dict.fromkeys(name for found in metrics.values() for name in groups(found))
    table = []
    for name in names:
        own = {p: groups(m)[name] for p, m in metrics.items() if name in groups(m)}
        tested = {p: kind != "category" or group.triggered for p, group in own.items()}
        table.append(
            {
                kind: name,
                "tasks": max(group.tasks for group in own.values()),
                "policies": {
                    policy: {s: _value(group, s) if tested[policy] else None for s in shares}
                    for policy, group in own.items()
                },
            }
        )
    return table


def _value(group: Group, share: str) -> float | None:
    return group.shares[share].value
