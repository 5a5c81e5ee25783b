"""A run as Markdown, for GitHub's job summaries and for whoever reads a file of it.

GitHub shows no picture there that it cannot fetch: data URIs and inline SVG are removed, and what
is in an artifact has no address. So a violation has a timeline of characters, which stands
everywhere; a picture beside its recording is shown in the file, and named in a job summary.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from pytest_safemanip.errors import printable
from pytest_safemanip.metrics.comparability import NOT_COMPARABLE, not_comparable
from pytest_safemanip.metrics.groups import measure_each
from pytest_safemanip.metrics.rates import Rate
from pytest_safemanip.metrics.records import RolloutRecord, by_policy
from pytest_safemanip.metrics.summaries import Summary
from pytest_safemanip.report.ci.reading import Row, Run, Violation, read_run, worst
from pytest_safemanip.report.headline import headline, notes_on
from pytest_safemanip.report.numbers import fraction, share, spread
from pytest_safemanip.report.pictures import picture_of
from pytest_safemanip.report.severity import RANKED, hardest, severity_line
from pytest_safemanip.report.timeline import timeline_lines
from pytest_safemanip.report.whole import write_whole
from pytest_safemanip.run.invocation import look_at, reproduce

NAME = "summary.md"
MAX_VIOLATIONS = 10
MAX_ROWS = 100
"""Of a table."""
MAX_TEXT = 400
"""Characters of a text from the run; more are cut."""
_MARKS = re.compile(r"[\\`*\[\]#|~<>&@$]|:(?=//)|(?<=www)\.|(?<![^\W_])_|_(?![^\W_])")
"""What means something to Markdown within a line, or makes a link of an address."""


def write_markdown(folder: Path) -> Path:
    """Write `summary.md` into the output folder of a run.

    Raises:
        ConfigError: if the run's summary cannot be read.
        OSError: if the file cannot be written.
    """
    path = folder / NAME
    write_whole(path, (markdown(read_run(folder), folder),))
    return path


def markdown(run: Run, beside: Path | None = None) -> str:
    """What was decided, the rates of each policy, and the worst violations; some 100 kB at most.

    Args:
        run: the run.
        beside: the folder of the text, which pictures are shown from; None where none can be.
    """
    found = headline(run.summary, run.summary.release)
    parts = [f"## Safety: {escaped(f'{found.verdict}: {found.text}')}"]
    parts += [escaped(note) for note in notes_on(run.summary)]
    if run.gates:
        parts.append(_table(("gate", "policy", "verdict", "found"), map(_gate_cells, run.gates)))
    if run.refused:
        parts.append(f"No comparison with the baseline: {escaped(run.refused)}")
    parts.append(_policies(run))
    shown = worst(run.summary.records, MAX_VIOLATIONS)
    if shown:
        parts.append("### The worst violations")
        parts += [_violation(n, v, run.summary, beside) for n, v in enumerate(shown, 1)]
        parts.append(f"{RANKED.capitalize()}; the worst of each property before the second of any.")
    return "\n\n".join(parts) + "\n"


def escaped(text: str) -> str:
    """Text of anybody's, in one line that no renderer takes for Markdown, HTML or a link."""
    return _MARKS.sub(lambda found: f"&#{ord(found[0])};", printable(text, MAX_TEXT))


def code_block(lines: Iterable[str]) -> str:
    """Lines as they are; none of them ends the block."""
    body = [printable(line, MAX_TEXT).replace("`", "'") for line in lines]
    return "\n".join(["```text", *body, "```"])


def _gate_cells(row: Row) -> tuple[str, ...]:
    return row.name, row.policy, row.verdict, row.found


def _policies(run: Run) -> str:
    records = run.summary.records
    metrics = measure_each(records)
    elsewhere = not_comparable(records, run.summary.origins)
    rows = []
    for policy, own in by_policy(records).items():
        total = metrics[policy].total
        shares = total.shares
        rows.append(
            (
                policy + (f" ({NOT_COMPARABLE})" if policy in elsewhere else ""),
                _complete(own),
                fraction(shares["success_rate"]),
                *_violated(shares["violation_rate"]),
                fraction(shares["unsafe_share_of_successes"]),
            )
            if total.complete
            else (policy, _complete(own), "-", "-", "-", "-")
        )
    heads = ("policy", "rollouts", "successful", "violated", "95 % CI", "unsafe successes")
    return _table(heads, rows)


def _complete(records: Sequence[RolloutRecord]) -> str:
    """How many rollouts are complete, and what became of the others."""
    complete = sum(record.complete and not record.unjudged for record in records)
    failed = sum(bool(record.error) for record in records)
    left = len(records) - complete - failed
    others = [f"{failed} with errors"] * bool(failed) + [f"{left} not run"] * bool(left)
    return f"{complete} of {len(records)}, {', '.join(others)}" if others else str(complete)


def _violated(rate: Rate) -> tuple[str, str]:
    """How many are violated, and the interval of their share; one rollout makes no rate."""
    if rate.total == 1:
        return fraction(rate), "-"
    return f"{fraction(rate)} = {share(rate)}", spread(rate.interval())


def _violation(
    number: int,
    violation: Violation,
    summary: Summary,
    beside: Path | None,
) -> str:
    record, found = violation.record, violation.found
    rule = summary.rules.get(violation.property_id, {})
    about = f"{record.task}, {record.policy}, seed {record.seed}"
    blocks = [f"#### {number}. {escaped(violation.property_id)}: {escaped(about)}"]
    said = rule.get("title", "")
    entities = f" for {', '.join(found['entities'])}" if found["entities"] else ""
    beyond = ", ".join(filter(None, (severity_line(found), hardest(found))))
    success = "a success by the task's own check" if record.success else "no success"
    more = len(record.properties[violation.property_id].violations) - 1
    blocks.append(
        f"{escaped(said)}{'. ' if said else ''}Violated{escaped(entities)} at step "
        f"{found['first']} ({violation.seconds:.2f} s), unsafe for {found['duration_s']:.2f} s"
        f"{', ' if beyond else ''}{beyond}; the rollout is {success}."
        + (f" {more} more in this case." if more else "")
    )
    lines = [rule.get("formula", ""), "", *found.get("evidence", [])[:4], ""]
    if found.get("timeline"):
        lines += timeline_lines(found["timeline"], found["first"])
    blocks.append(code_block(_without_gaps(lines)))
    blocks += _places(violation, summary.options, beside)
    return "\n\n".join(blocks)


def _places(violation: Violation, options: Sequence[str], beside: Path | None) -> list[str]:
    """The picture, the recording, and how to see it again."""
    recording = Path(violation.record.recording)
    picture = picture_of(recording, beside) if beside else picture_of(recording)
    found = []
    if picture and beside:
        found.append(f"![{escaped(violation.property_id)}](<{_target(picture)}>)")
    elif picture:
        found.append(f"picture: {escaped(str(picture))}")
    commands = [reproduce(options, violation.node_id)]
    if violation.record.recording:
        place = os.path.relpath(violation.record.recording)
        commands.insert(0, look_at("show", place, options))
    return [*found, code_block(commands)]


def _target(path: Path) -> str:
    """The address of an image between angle brackets."""
    return "".join(f"%{ord(c):02X}" if c in '<>\\ "%#?' else c for c in printable(path.as_posix()))


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    body = [f"| {' | '.join(escaped(cell) for cell in row)} |" for row in rows]
    left = len(body) - MAX_ROWS
    lines = [f"| {' | '.join(heads)} |", f"|{' --- |' * len(heads)}", *body[:MAX_ROWS]]
    return "\n".join([*lines, *([f"\nand {left} more"] if left > 0 else [])])


def _without_gaps(lines: Sequence[str]) -> list[str]:
    """Without empty lines at the ends, or next to each other."""
    kept: list[str] = []
    for line in lines:
        if line or (kept and kept[-1]):
            kept.append(line)
    return kept[:-1] if kept and not kept[-1] else kept
