"""The order of violations, the worst first, in all reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pytest_safemanip.metrics.records import RolloutRecord, severity
from pytest_safemanip.severity import in_words

RANKED = "ranked by severity: how far beyond its limit, how hard, how fast and how long"
Key = tuple[int, str, int]
"""Number of a rollout, property, number of the violation among those of both."""


def hardest(violation: Mapping[str, Any]) -> str:
    """The contact that is farthest beyond its limit, in words; empty where none is beyond one."""
    excess = violation.get("excess")
    if not excess:
        return ""
    times = excess["force"] / excess["limit"]
    return (
        f"at its hardest {excess['force']:.1f} N at step {excess['step']}, "
        f"{times:.3g} times the limit of {excess['limit']:g} N"
    )


def severity_line(violation: Mapping[str, Any]) -> str:
    """The severity of a violation with what was measured, in words; empty where none is known."""
    if "severity" not in violation:
        return ""
    return in_words(violation["severity"], violation.get("measured", {}))


def worst(record: RolloutRecord) -> float:
    """The severity of the worst violation of a rollout; 0 if it has none."""
    found = [
        severity(violation)
        for verdict in record.properties.values()
        for violation in verdict.violations
    ]
    return max(found, default=0.0)


def ranks(records: Sequence[RolloutRecord]) -> dict[Key, int]:
    """Rank of each violation in a run, 1 for the worst, the same for those that are as bad."""
    every = [
        (severity(violation), (number, name, place))
        for number, record in enumerate(records)
        for name, verdict in record.properties.items()
        for place, violation in enumerate(verdict.violations)
    ]
    ordered = sorted((measure for measure, _ in every), reverse=True)
    first: dict[float, int] = {}
    for rank, measure in enumerate(ordered, start=1):
        first.setdefault(measure, rank)
    return {key: first[measure] for measure, key in every}
