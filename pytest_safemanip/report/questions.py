"""The paper's tables as text: policies side by side, by category, horizon and suite."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pytest_safemanip.metrics.groups import Metrics
from pytest_safemanip.metrics.measures import OUTCOMES
from pytest_safemanip.metrics.tables import Row, tables
from pytest_safemanip.report.numbers import aligned, percent

_SHORT = {
    "violation_rate": "violated",
    "exposure": "exposure",
    "unsafe_share_of_successes": "unsafe successes",
}


def question_lines(metrics: Mapping[str, Metrics]) -> list[str]:
    """Those tables that have something to compare."""
    found = tables(metrics)
    lines: list[str] = []
    if len(metrics) > 1:
        lines += [*_policies(found["rq1"]), "", *_groups(found["rq2"], "category", metrics), ""]
    for kind in ("horizon", "suite"):
        rows = found[f"rq3_{kind}"]
        if len(rows) > 1:
            lines += [*_groups(rows, kind, metrics), ""]
    return lines


def _policies(rows: Sequence[Row]) -> list[str]:
    head = ("policy", "success", "violation", *(name.replace("_", " ") for name in OUTCOMES))
    body = [
        (
            row["policy"],
            percent(row["success_rate"]),
            percent(row["violation_rate"]),
            *(percent(row["outcomes"][name]) for name in OUTCOMES),
        )
        for row in rows
    ]
    return aligned([head, *body])


def _groups(rows: Sequence[Row], kind: str, metrics: Mapping[str, Metrics]) -> list[str]:
    """A column per share and policy, the number of tasks in parentheses."""
    shares = list(next(iter(rows[0]["policies"].values()))) if rows else []
    several = len(metrics) > 1
    head = [f"{kind} (tasks)"]
    for share in shares:
        head += [f"{_SHORT[share]}, {p}" if several else _SHORT[share] for p in metrics]
    body = [
        [
            f"{row[kind]} ({row['tasks']})",
            *(percent(row["policies"].get(p, {}).get(s)) for s in shares for p in metrics),
        ]
        for row in rows
    ]
    return aligned([head, *body])
