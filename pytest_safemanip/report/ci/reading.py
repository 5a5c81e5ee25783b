"""What CI servers are shown of a run, from its output folder: gates, the worst violations."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

from pytest_safemanip.metrics.comparability import marked
from pytest_safemanip.metrics.fields import Fields
from pytest_safemanip.metrics.records import RolloutRecord, severity
from pytest_safemanip.metrics.release_gate import GOOD, OPEN
from pytest_safemanip.metrics.summaries import Summary, read
from pytest_safemanip.report.numbers import percent
from pytest_safemanip.run.cases import Case
from pytest_safemanip.search.units import UNITS, show

MOST = 1e6
"""Sanity bound on an end of an interval."""


@dataclass(frozen=True)
class Row:
    """A gate or a required comparison, of one policy.

    Attributes:
        name: what it is about.
        policy: the policy.
        verdict: as it is shown.
        found: its figures, or what is missing.
        fails: whether it fails the run, as far as that depends on its verdict.
    """

    name: str
    policy: str
    verdict: str
    found: str
    fails: bool


@dataclass(frozen=True)
class Violation:
    """A violation of a rollout.

    Attributes:
        record: the rollout.
        property_id: what is violated.
        category: of the property.
        found: entities, first and last step, duration in seconds, reason; of the worst of a
            case also ``evidence`` and ``timeline``.
        number: among those of its case, from 0 on.
    """

    record: RolloutRecord
    property_id: str
    category: str
    found: Mapping[str, Any]
    number: int

    @property
    def node_id(self) -> str:
        """Node id of the test case."""
        record = self.record
        return Case(record.task, record.policy, self.property_id, record.seed).node_id

    @property
    def severity(self) -> float:
        """What it is ranked by."""
        return severity(self.found)

    @property
    def seconds(self) -> float:
        """When it begins, s."""
        found = self.found
        period = float(found["duration_s"]) / (found["last"] - found["first"] + 1)
        return float(found["first"] * period)

    @property
    def what(self) -> str:
        """What was measured, by whom and when, in one line."""
        entities = self.found["entities"]
        why = (self.found.get("evidence") or [self.found["reason"]])[0]
        named = all(re.search(rf"(?<!\w){re.escape(name)}(?!\w)", why) for name in entities)
        whose = "" if named else f"{', '.join(entities)}: "
        return f"{whose}{why}, at step {self.found['first']} ({self.seconds:.2f} s)"


@dataclass(frozen=True)
class Run:
    """A run that is over.

    Attributes:
        summary: its records, and the properties that were judged.
        gates: what was decided on it.
        refused: why it was not compared with the baseline; empty if it was, or if there is none.
    """

    summary: Summary
    gates: tuple[Row, ...]
    refused: str

    @property
    def decided(self) -> bool:
        """Whether gates or a comparison decide, so that a violation alone fails nothing."""
        return bool(self.gates or self.refused)


def read_run(folder: Path) -> Run:
    """Read a run from its output folder, or from its summary.

    Raises:
        ConfigError: naming the file, what is wrong in it and where.
    """
    return as_run(read(folder))


def as_run(summary: Summary) -> Run:
    """A run by its summary.

    Raises:
        ConfigError: if what was decided is malformed.
    """
    release = summary.release
    if release is None:
        return Run(summary, (), "")
    rows = [_gate(own) for own in release.fields("gates")]
    if release.values.get("baseline") is not None:
        compared = release.section("baseline").fields("comparisons")
        rows += [_comparison(own) for own in compared if own.boolean("required")]
    return Run(summary, tuple(rows), release.told("refused", empty=True))


def violations(records: Sequence[RolloutRecord]) -> Iterator[Violation]:
    """All violations, in the order of the run."""
    for record in records:
        for verdict in record.properties.values():
            for number, found in enumerate(verdict.violations):
                yield Violation(record, verdict.property, verdict.category, found, number)


def worst(records: Sequence[RolloutRecord], most: int) -> list[Violation]:
    """The worst violation of each case, the worst of them first.

    The worst of each property come first, then the second of each: so every kind is seen.
    """
    by_case: dict[str, Violation] = {}
    for violation in violations(records):
        known = by_case.get(violation.node_id)
        if known is None or violation.severity > known.severity:
            by_case[violation.node_id] = violation
    by_property: dict[str, list[Violation]] = defaultdict(list)
    for violation in sorted(by_case.values(), key=lambda v: v.severity, reverse=True):
        by_property[violation.property_id].append(violation)
    turns = zip_longest(*by_property.values())  # properties in the order of their worst
    return [violation for turn in turns for violation in turn if violation][:most]


def _gate(own: Fields) -> Row:
    verdict, required = own.name("verdict"), own.boolean("required")
    name, text = own.told("name"), own.told("gate")
    shown = marked(verdict, own.boolean("comparable"))
    return Row(
        text if name == text else f"{name}: {text}",
        own.told("policy"),
        shown if required else f"{shown} (not required)",
        "; ".join(part for part in (_figures(own), own.told("why", empty=True)) if part),
        required and verdict not in GOOD,
    )


def _figures(own: Fields) -> str:
    if own.values.get("value") is None:
        return "undefined"
    value = own.number("value")
    unit = own.told("unit", empty=True) if "unit" in own.values else ""
    if unit in UNITS:
        return show(value, unit)
    if own.values.get("total") is None:
        return f"{value:g}"
    counts = f"{own.number('hits'):g} of {own.count('total')} = {percent(value)}"
    bounds = own.values.get("interval")
    if not isinstance(bounds, list):
        return counts
    if len(bounds) != 2 or not all(
        isinstance(bound, int | float) and -MOST <= bound <= MOST for bound in bounds
    ):
        raise own.expected("interval", "two numbers")
    low, high = bounds
    return f"{counts}, {own.told('basis')} {low * 100:.1f} to {high * 100:.1f} %"


def _comparison(own: Fields) -> Row:
    verdict = own.name("verdict")
    found = own.told("why", empty=True)
    if not found and own.values.get("before") is not None:
        before, now = percent(own.number("before")), percent(own.number("now"))
        found = f"violated in {before} before, {now} now"
    name = f"baseline: {own.told('name')}"
    return Row(name, own.told("policy"), verdict, found, verdict not in GOOD)


def is_open(row: Row) -> bool:
    """Whether too few rollouts were run to decide."""
    return row.verdict.startswith(OPEN)
