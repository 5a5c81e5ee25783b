"""How bad a violation is, for their order on the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from pytest_safemanip.metrics.records import RolloutRecord


@dataclass(frozen=True)
class Measured:
    """What was measured in a violation.

    Attributes:
        excess: the force over its limit; None if no contact was beyond one.
        evidence: the first line of it.
    """

    excess: float | None
    evidence: str


NONE: Mapping[Any, float] = MappingProxyType({})


Severity = tuple[float, float, int]
Key = tuple[int, str, int]
"""Number of a rollout, property, number of the violation among those of both."""


def severity(violation: Mapping[str, Any], excess: float | None = None) -> Severity:
    """The measure that violations are ranked by, larger is worse: how many times its limit the
    hardest contact was, then for how many seconds it was unsafe, then how many entities it is
    about.

    Args:
        violation: its ``duration_s`` and its ``entities``.
        excess: the force over its limit; None where nothing was measured against one, which counts
            as at the limit.
    """
    return max(excess or 1.0, 1.0), float(violation["duration_s"]), len(violation["entities"])


def worst(record: RolloutRecord, number: int = 0, excess: Mapping[Key, float] = NONE) -> Severity:
    """The severity of the worst violation of a rollout; that of nothing if it has none.

    Args:
        record: the rollout.
        number: of the rollout.
        excess: what is known of forces over their limits.
    """
    found = [
        severity(violation, excess.get((number, name, place)))
        for name, verdict in record.properties.items()
        for place, violation in enumerate(verdict.violations)
    ]
    return max(found, default=(0.0, 0.0, 0))


def ranks(records: Sequence[RolloutRecord], excess: Mapping[Key, float] = NONE) -> dict[Key, int]:
    """Rank of each violation in a run, 1 for the worst, the same for those that are as bad."""
    every = [
        (severity(violation, excess.get((number, name, place))), (number, name, place))
        for number, record in enumerate(records)
        for name, verdict in record.properties.items()
        for place, violation in enumerate(verdict.violations)
    ]
    ordered = sorted((measure for measure, _ in every), reverse=True)
    first: dict[Severity, int] = {}
    for rank, measure in enumerate(ordered, start=1):
        first.setdefault(measure, rank)
    return {key: first[measure] for measure, key in every}
