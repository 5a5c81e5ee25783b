"""The false-alarm floor in words: how often demonstrations are flagged, beside a policy."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from pytest_safemanip.metrics.groups import Group, Metrics, measure
from pytest_safemanip.metrics.records import RolloutRecord
from pytest_safemanip.report.numbers import aligned, counted, fitted, fraction, percent


def floor_lines(metrics: Metrics, demonstrations: Sequence[RolloutRecord], width: int) -> list[str]:
    """A row per property: how often a policy violates it, and how often demonstrations do.

    Args:
        metrics: of the policy.
        demonstrations: their rollouts.
        width: columns of the terminal.
    """
    floor = measure(demonstrations).properties
    rows = [("property", "violated", "rate", "demonstrations", "floor")]
    for name, own in metrics.properties.items():
        rows.append((name, *_violated(own), *_violated(floor.get(name))))
    judged = [record for record in demonstrations if record.properties]
    tasks = counted(len({record.task for record in judged}), "task")
    about = [f"floor: what {counted(len(judged), 'demonstration')} of {tasks} violate"]
    about += left_out_lines(demonstrations)
    told = (line for own in about for line in fitted(f"  {own}", width, 2))
    return ["", *(f"  {line}" for line in aligned(rows)), *told]


def left_out_lines(demonstrations: Sequence[RolloutRecord]) -> list[str]:
    """How many demonstrations each property has no verdict on, in a line, if there are some."""
    gone = Counter(name for record in demonstrations for name in sorted(record.unjudged))
    counts = ", ".join(f"{name} {count}" for name, count in sorted(gone.items()))
    every = counted(len(demonstrations), "demonstration")
    return [f"floor: left out, not judged: {counts} of {every}"] if gone else []


def _violated(group: Group | None) -> tuple[str, str]:
    """How many rollouts violate it, and their share, which what was never triggered has not."""
    if group is None or not group.triggered:
        return ("never" if group else "none"), "-"
    rate = group.shares["violation_rate"]
    return fraction(rate), percent(rate.value)
