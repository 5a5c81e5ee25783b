"""What a run came to, in the line that every report of it begins with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from pytest_safemanip.errors import printable
from pytest_safemanip.metrics.comparability import NOT_COMPARABLE, not_comparable
from pytest_safemanip.metrics.fields import Fields
from pytest_safemanip.metrics.records import RolloutRecord
from pytest_safemanip.metrics.release_gate import GOOD, OPEN, PARTIAL, required_rows
from pytest_safemanip.metrics.shards import missing_line
from pytest_safemanip.metrics.summaries import Summary
from pytest_safemanip.report.floor import left_out_lines
from pytest_safemanip.report.numbers import counted


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
    searched = sum(bool(own.fails) for own in found.searches)
    parts, failed = _of_rollouts(found) if found.records else ([], False)
    if searched:
        parts.append(f"{counted(searched, 'search')} found a violation")
    verdicts = [] if release is None else [r.name("verdict") for r in required_rows(release)]
    refused = release is not None and bool(release.text("refused", empty=True))
    if refused:
        parts.insert(0, "not compared with the baseline")
    if verdicts:
        parts.insert(0, gates_line(verdicts))
    bad = [verdict for verdict in verdicts if verdict not in GOOD]
    if release is None:
        failed = failed or bool(searched) or any(map(_is_violated, found.records))
    else:
        failed = failed or refused or any(verdict not in OPEN for verdict in bad)
    is_open = bool(bad) or not (found.records or found.searches or verdicts)
    nothing = "no search found a violation" if found.searches else "no rollout was run"
    text = ", ".join(parts) or nothing
    return Headline("FAIL" if failed else "OPEN" if is_open else "PASS", text)


def _of_rollouts(found: Summary) -> tuple[list[str], bool]:
    """What the rollouts of a run came to, in words, and whether some of it is missing."""
    complete = [own for own in found.records if own.complete and not own.unjudged]
    violated = sum(map(_is_violated, complete))
    incomplete = len(found.records) - len(complete)
    missing = sum(len(record.unjudged) for record in found.records if not record.error)
    expected = sum(len(record.properties) + len(record.unjudged) for record in found.records)
    among = counted(len(complete), "complete rollout" if incomplete else "rollout")
    parts = [f"{violated} of {among} violated"]
    parts += [f"{counted(incomplete, 'rollout')} incomplete"] if incomplete else []
    parts += [f"{missing} of {expected} cases not run"] if missing else []
    return parts, bool(incomplete or missing)


def _is_violated(record: RolloutRecord) -> bool:
    return any(verdict.outcome == "VIOLATED" for verdict in record.properties.values())


def notes_on(found: Summary) -> list[str]:
    """What one has to know before one believes the figures, in lines."""
    notes = [f"{name}: {NOT_COMPARABLE}" for name in not_comparable(found.records, found.origins)]
    notes += [f"not all of the run: {PARTIAL}"] if found.partial else []
    gone = missing_line(found.shards)
    notes += [gone] if gone else []
    notes += left_out_lines(found.floor)
    notes += [
        f"a search found what {own.policy} does not stand in {own.task}: it {own.fails}"
        for own in found.searches
        if own.fails
    ]
    errors = [record for record in found.records if record.error]
    if errors:
        first = errors[0]
        notes.append(
            f"{counted(len(errors), 'rollout')} ended in an error, the first {first.task}, "
            f"{first.policy}, seed {first.seed}: {printable(first.reason)}"
        )
    return notes


def gates_line(verdicts: Sequence[str]) -> str:
    """How many of some required gates passed, failed, and are open, in the words of their rows."""
    gates = counted(len(verdicts), "gate")
    failed = sum(verdict not in (*GOOD, *OPEN) for verdict in verdicts)
    kinds = [(failed, "failed"), *((verdicts.count(word), word.lower()) for word in OPEN)]
    found = [(number, word) for number, word in kinds if number]
    if not found:
        return f"{gates} passed"
    (number, word), *others = found
    return ", ".join([f"{number} of {gates} {word}", *(f"{n} {word}" for n, word in others)])
