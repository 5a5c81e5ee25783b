"""A share with what it was counted from."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from pytest_safemanip.metrics.statistics.intervals import Interval, below, clustered, wilson


@dataclass(frozen=True)
class Rate:
    """A share of rollouts, or a mean of values in [0, 1]; undefined without a case.

    Attributes:
        hits: number of hits, or sum of the values.
        total: number of cases.
        tasks: the same for each task.
    """

    hits: float
    total: int
    tasks: Mapping[str, tuple[float, int]] = field(default_factory=dict, compare=False)

    @classmethod
    def count(cls, cases: Iterable[tuple[str, float]]) -> Rate:
        """From the task and the value of each case; a hit is 1, a miss 0."""
        sums: defaultdict[str, float] = defaultdict(float)
        counts: defaultdict[str, int] = defaultdict(int)
        for task, value in cases:
            sums[task] += value
            counts[task] += 1
        tasks = {task: (sums[task], counts[task]) for task in sorted(counts)}
        return cls(sum(sums[task] for task in tasks), sum(counts.values()), tasks)

    @property
    def value(self) -> float | None:
        """The point estimate, or None."""
        return self.hits / self.total if self.total else None

    def interval(self, confidence: float = 0.95) -> Interval | None:
        """Wilson's, for these tasks; None without a case."""
        return wilson(self.hits, self.total, confidence) if self.total else None

    def clustered(self, confidence: float = 0.95) -> Interval | None:
        """Clustered by task, for new tasks like these; None with less than two tasks."""
        return clustered(list(self.tasks.values()), confidence)

    @property
    def below(self) -> float | None:
        """The rate is below this at 95 %, if there was no hit."""
        return below(self.total) if self.total and not self.hits else None

    def to_json(self) -> dict[str, Any]:
        """Plain builtins: counts, point estimate, both intervals, the bound after no hit."""
        return {
            "hits": self.hits,
            "total": self.total,
            "value": self.value,
            "wilson95": _listed(self.interval()),
            "clustered95": _listed(self.clustered()),
            "below95": self.below,
        }


def _listed(bounds: Interval | None) -> list[float] | None:
    return None if bounds is None else list(bounds)
