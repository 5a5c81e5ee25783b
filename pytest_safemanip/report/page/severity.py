"""How bad a violation is, for their order on the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pytest_safemanip.metrics.records import RolloutRecord

Violations = list[Mapping[str, Any]]


def severity(violation: Mapping[str, Any]) -> tuple[float, int]:
    """The measure that violations are ranked by, larger is worse: for how many seconds it was
    unsafe, then how many entities it is about.

    Args:
        violation: its ``duration_s`` and its ``entities``.
    """
    return float(violation["duration_s"]), len(violation["entities"])


def worst(record: RolloutRecord) -> tuple[float, int]:
    """The severity of the worst violation of a rollout; that of nothing if it has none."""
    found = [severity(v) for p in record.properties.values() for v in p.violations]
    return max(found, default=(0.0, 0))


def ranks(records: list[RolloutRecord]) -> dict[tuple[int, str, int], int]:
    """Rank of each violation in a run, 1 for the worst, the same for those that are as bad; by the
    number of its rollout, its property and its number there.
    """
    every = [
        (severity(violation), (number, name, place))
        for number, record in enumerate(records)
        for name, verdict in record.properties.items()
        for place, violation in enumerate(verdict.violations)
    ]
    ordered = sorted((measure for measure, _ in every), reverse=True)
    first: dict[tuple[float, int], int] = {}
    for rank, measure in enumerate(ordered, start=1):
        first.setdefault(measure, rank)
    return {key: first[measure] for measure, key in every}
