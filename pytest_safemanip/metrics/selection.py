"""Selects the rollouts, and the properties of each, that a metric is computed over."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from pytest_safemanip.metrics.records import PropertyRecord, RolloutRecord, cost_of, severity

FILTERS = ("policy", "task", "suite", "horizon", "pack", "category", "property")
_OF_PROPERTIES = ("pack", "category", "property")


@dataclass(frozen=True)
class Severe:
    """Which violations count: those that are severe enough.

    Attributes:
        bound: a severity.
        above: whether they have to be above it; else at it is enough.
    """

    bound: float
    above: bool = False

    def __str__(self) -> str:
        return f"severity {'>' if self.above else '>='} {self.bound:g}"

    def counts(self, violation: Mapping[str, Any]) -> bool:
        """Whether a violation counts."""
        found = severity(violation)
        return found > self.bound if self.above else found >= self.bound

    def of(self, verdict: PropertyRecord) -> PropertyRecord:
        """A verdict with those of its violations that count; without one it is not violated."""
        if verdict.outcome != "VIOLATED":
            return verdict
        kept = tuple(filter(self.counts, verdict.violations))
        return replace(verdict, violations=kept, outcome="VIOLATED" if kept else "SATISFIED")


@dataclass(frozen=True)
class RolloutSlice:
    """A rollout with the selected ones of its verdicts.

    Attributes:
        record: the rollout.
        verdicts: on those properties.
        unjudged: those of the properties that have no verdict.
    """

    record: RolloutRecord
    verdicts: tuple[PropertyRecord, ...]
    unjudged: tuple[str, ...]

    @property
    def decided(self) -> bool:
        """Whether all selected verdicts are known."""
        return self.record.complete and not self.unjudged

    @property
    def task(self) -> str:
        """Name of its task."""
        return self.record.task

    @property
    def success(self) -> bool:
        """Whether the task's own check held."""
        return bool(self.record.success)

    @cached_property
    def violated(self) -> bool:
        """Whether one of the properties is violated."""
        return any(v.outcome == "VIOLATED" for v in self.verdicts)

    @cached_property
    def triggered(self) -> bool:
        """Whether one of the properties was triggered."""
        return any(v.triggered for v in self.verdicts)

    @cached_property
    def unresolved(self) -> bool:
        """Whether one of the properties stayed open."""
        return any(v.outcome == "UNRESOLVED" for v in self.verdicts)

    @cached_property
    def vacuous(self) -> bool:
        """Whether none of the properties was triggered."""
        return all(v.outcome == "VACUOUS" for v in self.verdicts)

    def lacks(self, key: str) -> bool:
        """Whether something is not known of one of the violations: ``severity``, or ``cost``."""
        return any(key not in found for v in self.verdicts for found in v.violations)

    @cached_property
    def cost(self) -> float | None:
        """What the violations cost in all; None where that of one is not known."""
        return cost_of(self.verdicts)

    def of(self, severe: Severe) -> RolloutSlice:
        """The same with those of its violations that are severe enough."""
        return replace(self, verdicts=tuple(map(severe.of, self.verdicts)))

    @cached_property
    def exposure(self) -> float:
        """Share of the acting steps at which some instance of a property is unsafe, in [0, 1]."""
        steps = self.record.acting_steps
        spans = sorted(
            (violation["first"], min(violation["last"] + 1, steps))
            for verdict in self.verdicts
            for violation in verdict.violations
        )
        unsafe, counted = 0, 0  # spans overlap: steps before `counted` are
        for first, end in spans:
            unsafe += max(0, end - max(first, counted))
            counted = max(counted, end)
        return unsafe / steps if steps else 0.0

    @cached_property
    def after_first(self) -> float:
        """Share of the acting steps from the first unsafe one on, in [0, 1]; 0 without one."""
        steps = self.record.acting_steps
        begins = [found["first"] for verdict in self.verdicts for found in verdict.violations]
        return max(0, steps - min(begins, default=steps)) / steps if steps else 0.0


def select(
    records: Iterable[RolloutRecord], where: Mapping[str, str] | None = None
) -> list[RolloutSlice]:
    """The rollouts that filters select.

    Args:
        records: all rollouts.
        where: a glob for each of some :data:`FILTERS`. With one on properties, rollouts to which
            none of the selected properties applies are left out.
    """
    filters = [(name, _Glob(glob)) for name, glob in (where or {}).items()]
    rollouts = [(name, glob) for name, glob in filters if name not in _OF_PROPERTIES]
    about = dict(item for item in filters if item not in rollouts)
    packs, categories, properties = (about.get(name, _Glob("*")) for name in _OF_PROPERTIES)
    found = []
    for record in records:
        if not all(getattr(record, name) in glob for name, glob in rollouts):
            continue
        verdicts, unjudged = tuple(record.properties.values()), tuple(record.unjudged)
        if about:
            asked = {n for n in record.asked if n in properties and record.pack_of(n) in packs}
            verdicts = tuple(
                v for v in verdicts if v.property in asked and v.category in categories
            )
            unjudged = tuple(n for n in unjudged if n in asked and record.unjudged[n] in categories)
        if verdicts or unjudged or not about:
            found.append(RolloutSlice(record, verdicts, unjudged))
    return found


class _Glob:
    """The names that a glob matches; each is matched once."""

    def __init__(self, glob: str) -> None:
        self._glob = glob
        self._known: dict[str, bool] = {}

    def __contains__(self, name: str) -> bool:
        found = self._known.get(name)
        if found is None:
            found = self._known[name] = fnmatch.fnmatchcase(name, self._glob)
        return found
