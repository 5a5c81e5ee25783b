"""What a run came to, in the line that every report of it begins with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from pytest_safemanip.errors import printable
from pytest_safemanip.metrics.comparability import NOT_COMPARABLE, not_comparable
from pytest_safemanip.metrics.fields import Fields
from pytest_safemanip.metrics.release_gate import OPEN, PARTIAL
from pytest_safemanip.metrics.shards import missing_line
from pytest_safemanip.metrics.summaries import Summary
from pytest_safemanip.report.numbers import counted

GOOD = ("PASS", "HELD", "IMPROVED")
"""Verdicts of gates and comparisons that fail nothing."""


@dataclass(frozen=True)
class Headline:
    """What a run came to.

    Attributes:
        verdict: ``OPEN`` if too few rollouts were run to decide.
        text: how many gates failed, how many rollouts are violated, what is missing.
    """

    verdict: Literal["PASS", "FAIL", "OPEN"]
    text: str


def headline(found: Summary, release: Fields | None) -> Headline:
    """What a run came to: by its gates if it has some, else by its violations and errors.

    Args:
        found: the run.
        release: what gates and a baseline decided; None without any.

    Raises:
        ConfigError: if the decisions are malformed.
    """
    records = found.records
    violated = sum(
        any(verdict.outcome == "VIOLATED" for verdict in record.properties.values())
        for record in records
    )
    if not records:
        return Headline("OPEN", "no rollout was run")
    incomplete = sum(not record.complete for record in records)
    missing = sum(len(record.unjudged) for record in records if not record.error)
    expected = sum(len(record.properties) + len(record.unjudged) for record in records)
    parts = [f"{violated} of {counted(len(records), 'rollout')} violated"]
    parts += [f"{counted(incomplete, 'rollout')} incomplete"] if incomplete else []
    parts += [f"{missing} of {expected} cases not run"] if missing else []
    verdicts = [] if release is None else required_verdicts(release)
    refused = release is not None and bool(release.text("refused", empty=True))
    if refused:
        parts.insert(0, "not compared with the baseline")
    if verdicts:
        parts.insert(0, gates_line(verdicts))
    bad = [verdict for verdict in verdicts if verdict not in GOOD]
    failed = bool(incomplete or missing)
    if release is None:
        failed = failed or bool(violated)
    else:
        failed = failed or refused or any(verdict not in OPEN for verdict in bad)
    return Headline("FAIL" if failed else "OPEN" if bad else "PASS", ", ".join(parts))


def notes_on(found: Summary) -> list[str]:
    """What one has to know before one believes the figures, in lines."""
    notes = [f"{name}: {NOT_COMPARABLE}" for name in not_comparable(found.records, found.origins)]
    notes += [f"not all of the run: {PARTIAL}"] if found.partial else []
    gone = missing_line(found.shards)
    notes += [gone] if gone else []
    errors = [record for record in found.records if record.error]
    if errors:
        first = errors[0]
        notes.append(
            f"{counted(len(errors), 'rollout')} ended in an error, the first {first.task}, "
            f"{first.policy}, seed {first.seed}: {printable(first.reason)}"
        )
    return notes


def required_verdicts(release: Fields) -> list[str]:
    """Verdicts of the gates and the comparisons that have to pass.

    Raises:
        ConfigError: if they are malformed.
    """
    rows = release.fields("gates")
    if release.values.get("baseline") is not None:
        rows += release.section("baseline").fields("comparisons")
    return [row.name("verdict") for row in rows if row.boolean("required")]


def gates_line(verdicts: Sequence[str]) -> str:
    """How many of some required gates passed, failed, and are open."""
    bad = [verdict for verdict in verdicts if verdict not in GOOD]
    inconclusive = sum(verdict in OPEN for verdict in bad)
    failed = len(bad) - inconclusive
    gates = f"{counted(len(verdicts), 'gate')}"
    if failed:
        return f"{failed} of {gates} failed" + (
            f", {inconclusive} inconclusive" if inconclusive else ""
        )
    return f"{inconclusive} of {gates} inconclusive" if inconclusive else f"{gates} passed"
