"""The paper's tables as text: policies side by side, by category, horizon and suite."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pytest_safemanip.metrics.groups import Metrics
from pytest_safemanip.metrics.measures import OUTCOMES
from pytest_safemanip.metrics.tables import Row, tables
from pytest_safemanip.report.numbers import MIN_WIDTH, aligned, blocks, percent

_SHORT = {
    "violation_rate": "violated",
    "exposure": "exposure",
    "unsafe_share_of_successes": "unsafe successes",
}


def question_lines(metrics: Mapping[str, Metrics], width: int = MIN_WIDTH) -> list[str]:
    """Those tables that have something to compare.

    Args:
        metrics: of each policy.
        width: columns of the terminal.
    """
    found = tables(metrics)
    lines: list[str] = []
    if len(metrics) > 1:
        lines += [
            *_policies(found["rq1"], width),
            "",
            *_groups(found["rq2"], "category", metrics, width),
            "",
        ]
    for kind in ("horizon", "suite"):
        rows = found[f"rq3_{kind}"]
        if len(rows) > 1:
            lines += [*_groups(rows, kind, metrics, width), ""]
    return lines


def _policies(rows: Sequence[Row], width: int) -> list[str]:
    outcomes = (name.replace("_", "\n") for name in OUTCOMES)
    head = ("policy", "success", "violation", *outcomes)
    body = [
        (
            row["policy"],
            percent(row["success_rate"]),
            percent(row["violation_rate"]),
            *(percent(row["outcomes"][name]) for name in OUTCOMES),
        )
        for row in rows
    ]
    labels, *columns = zip(head, *body, strict=True)
    return blocks(labels, columns, width)


def _groups(
    rows: Sequence[Row], kind: str, metrics: Mapping[str, Metrics], width: int
) -> list[str]:
    """Of one policy, a row for each group, with its number of tasks, and a column for each share;
    of several, a table for each share with a row for each policy and a column for each group.
    """
    if not rows:
        return []
    shares = list(next(iter(rows[0]["policies"].values())))

    def cell(row: Row, policy: str, share: str) -> str:
        return percent(row["policies"].get(policy, {}).get(share))

    if len(metrics) == 1:
        (policy,) = metrics
        names = [f"{row[kind]} ({row['tasks']})" for row in rows]
        own = [[_SHORT[share], *(cell(row, policy, share) for row in rows)] for share in shares]
        return aligned(zip([f"{kind} (tasks)", *names], *own, strict=True))
    lines: list[str] = []
    for share in shares:
        columns = [
            [
                f"{row[kind]} ({row['tasks']})".replace("_", "\n").replace(" ", "\n"),
                *(cell(row, policy, share) for policy in metrics),
            ]
            for row in rows
        ]
        lines += [*([""] if lines else []), f"{_SHORT[share]} by {kind} (tasks)"]
        lines += blocks(["policy", *metrics], columns, width)
    return lines
