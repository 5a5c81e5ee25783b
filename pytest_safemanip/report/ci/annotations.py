"""GitHub's annotations: lines of the log that it shows beside the run and the changed files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pytest_safemanip.errors import printable
from pytest_safemanip.report.ci.places import below
from pytest_safemanip.report.ci.reading import Run, is_open, worst

MAX_ANNOTATIONS = 10
"""GitHub shows ten of a kind for each step, and drops the others."""
MAX_TEXT = 500
"""Characters of a message."""


@dataclass(frozen=True)
class Annotation:
    """A message of the run.

    Attributes:
        level: ``error`` of what fails the run, ``warning`` of what gates tolerate.
        title: what it is about.
        message: in one line.
        file: that it is shown at, relative to the checkout; empty for none.
    """

    level: Literal["error", "warning"]
    title: str
    message: str
    file: str = ""

    def command(self) -> str:
        """The workflow command, one line whatever the texts are."""
        place = f"file={_value(self.file)},line=1," if self.file else ""
        return f"::{self.level} {place}title={_value(self.title)}::{_escaped(self.message)}"


def annotations_of(run: Run, root: Path, skip_open: bool = False) -> list[Annotation]:
    """What failed: gates, rollouts without a verdict, then the worst violations; ten at most.

    Args:
        run: the run.
        root: the folder of the checkout.
        skip_open: whether what too few rollouts were run for does not fail the run.
    """
    found = [
        Annotation("error", f"{row.verdict}: {row.name}", f"{row.policy}: {row.found}")
        for row in run.gates
        if row.fails and not (skip_open and is_open(row))
    ]
    if run.refused:
        found.append(Annotation("error", "no comparison with the baseline", run.refused))
    failed = [record for record in run.summary.records if record.error]
    if failed:
        first = failed[0]
        found.append(
            Annotation(
                "error",
                f"{len(failed)} rollouts without a verdict" if len(failed) > 1 else "no verdict",
                f"{first.task}, {first.policy}, seed {first.seed}: {first.reason}",
            )
        )
    for violation in worst(run.summary.records, MAX_ANNOTATIONS):
        record = violation.record
        file = run.summary.rules.get(violation.property_id, {}).get("file", "")
        place = below(Path(file), root) if file else None
        found.append(
            Annotation(
                "warning" if run.decided else "error",
                f"{violation.property_id} violated",
                f"{record.task}, {record.policy}, seed {record.seed}: {violation.what}",
                str(place or ""),
            )
        )
    return found[:MAX_ANNOTATIONS]


def _escaped(text: str) -> str:
    shown = printable(text, MAX_TEXT)
    return shown.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _value(text: str) -> str:
    """Of a property of a command, which ends at a colon or a comma."""
    return _escaped(text).replace(":", "%3A").replace(",", "%2C")
