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
    outcomes = (name.replace("_", "\n", 1).replace("_", " ") for name in OUTCOMES)
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
    """A row for each group, with its number of tasks: of one policy a column for each share, of
    several a table for each share with a column for each policy.
    """
    if not rows:
        return []
    names = [f"{row[kind]} ({row['tasks']})" for row in rows]
    shares = list(next(iter(rows[0]["policies"].values())))

    def column(head: str, policy: str, share: str) -> list[str]:
        return [head, *(percent(row["policies"].get(policy, {}).get(share)) for row in rows)]

    if len(metrics) == 1:
        (policy,) = metrics
        own = [column(_SHORT[share], policy, share) for share in shares]
        return aligned(zip([f"{kind} (tasks)", *names], *own, strict=True))
    lines: list[str] = []
    for share in shares:
        columns = [column(policy, policy, share) for policy in metrics]
        labels = [f"{_SHORT[share]} by {kind} (tasks)", *names]
        lines += blocks(labels, columns, width)
    return lines
