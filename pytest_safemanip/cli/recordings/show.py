"""``safemanip show``."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pytest_safemanip.cli.evaluation import Evaluation, add_judging, evaluate
from pytest_safemanip.cli.tables import print_json, print_table, print_wrapped
from pytest_safemanip.judge import Finding, Verdict
from pytest_safemanip.report.counterexample import named, violation_lines, worst_violation
from pytest_safemanip.trace.recording import Recording

EXAMPLE = (
    "safemanip show .safemanip/recordings/OpenDrawer-scripted-seed0.rollout "
    "--params settled.speed=0.05"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_judging(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(options: argparse.Namespace) -> int:
    """Print what happened, the verdicts, and what proves each violation.

    Returns:
        1 if a property is violated or cannot be judged, as in pytest.
    """
    found = evaluate(options)
    if options.json:
        print_json(_plain(found, options.recording))
    else:
        for line in _episode(found.recording):
            print_wrapped(line, "    ")
        print()
        print_table(("property", "verdict", "triggered", "what"), list(_rows(found)))
        for text in _proofs(found):
            print(f"\n{text}")
        if _violated(found):
            print(f"\nwatch  safemanip replay {shlex.quote(str(options.recording))}")
    return 1 if _violated(found) or found.errors else 0


def _violated(found: Evaluation) -> list[str]:
    return [id_ for id_, verdict in found.verdicts.items() if verdict.findings]


def _episode(recording: Recording) -> Iterator[str]:
    """What was run and how it ended."""
    episode, dt = recording.episode, recording.scene.control_period
    end = recording.acting - 1
    success = "successful at" if recording.success else "no success up to"
    settling = f"{len(recording.steps) - recording.acting} steps of settling"
    yield (
        f"{episode.task}, policy {episode.policy}, seed {episode.seed}: {success} step {end} "
        f"({end * dt:.2f} s) of {episode.horizon}, "
        + ("truncated (no settle tail)" if recording.truncated else settling)
    )
    yield f"  {episode.instruction!r}"
    yield (
        f"  {episode.backend}, {episode.scenes} scenes, {episode.stepping} stepping, "
        f"{episode.assets} assets"
    )
    for how, entries in (
        ("changed", episode.request.get("changes", ())),
        ("disturbed", episode.disturbances),
    ):
        if isinstance(entries, list | tuple):
            yield from (f"  {how}: {_told(entry)}" for entry in entries)
    if episode.failure:
        yield f"  the policy gave up: {episode.failure}"
    if episode.ended == "warning":
        near = f": {episode.warned}" if episode.warned else ""
        yield f"  stopped before step {end + 1}, since a violation was near{near}"
    for hazard in episode.hazards:
        about = f" for {named(hazard.entities, recording)}" if hazard.entities else ""
        begin = f"step {hazard.first} ({hazard.first * dt:.2f} s)"
        until = f" to {hazard.last} ({hazard.last * dt:.2f} s)" * (hazard.last > hazard.first)
        yield f"  hazard: {hazard.property_id}{about}, begun on purpose at {begin}{until}"


def _told(entry: object) -> str:
    """A change or a disturbance, as the recording has it, without what says nothing: anybody may
    have written it.
    """
    if not isinstance(entry, Mapping):
        return ascii(entry)
    rest = (f"{key} {value}" for key, value in entry.items() if key != "kind" and not _empty(value))
    text = f"{entry.get('kind', 'unknown')}: {', '.join(rest)}"
    return text if text.isprintable() else ascii(text)


def _empty(value: object) -> bool:
    return value is False or value == "" or (isinstance(value, list | tuple) and not any(value))


def _rows(found: Evaluation) -> Iterator[tuple[str, str, str, str]]:
    for id_ in found.properties:
        if id_ in found.errors:
            yield id_, "ERROR", "", found.errors[id_]
            continue
        verdict = found.verdicts[id_]
        triggered = f"{verdict.triggered} of {verdict.instances}"
        yield id_, verdict.outcome.label, triggered, _what(verdict, found.recording)
    for id_, reason in found.task.not_grounded.items():
        yield id_, "not judged", "", reason


def _what(verdict: Verdict, recording: Recording) -> str:
    if verdict.findings:
        return worst_violation(verdict, recording)
    pending = [
        f"pending since step {since} ({since * recording.trace.dt:.2f} s)"
        f"{f' for {named(entities, recording)}' if entities else ''}"
        for entities, since in verdict.open
    ]
    return "\n".join(pending)


def _proofs(found: Evaluation) -> list[str]:
    """The excerpt of each violated property, as in a test failure."""
    return [
        "\n".join(violation_lines(found.properties[id_], found.verdicts[id_], found.recording))
        for id_ in _violated(found)
    ]


def _plain_finding(finding: Finding) -> dict[str, Any]:
    told = {name: value for name, value in vars(finding).items() if name != "values"}
    severity = {"severity": finding.severity.value, "measured": finding.severity.measured}
    excess = asdict(finding.excess) if finding.excess else None
    return {**told, **severity, "excess": excess}


def _plain(found: Evaluation, path: Path) -> dict[str, Any]:
    recording, episode = found.recording, found.recording.episode
    return {
        "recording": str(path),
        "episode": {key: value for key, value in asdict(episode).items() if key != "request"},
        "success": recording.success,
        "steps": len(recording.steps),
        "acting_steps": recording.acting,
        "truncated": recording.truncated,
        "control_period_s": recording.scene.control_period,
        "verdicts": {
            id_: {
                **asdict(verdict),
                "outcome": verdict.outcome.label,
                "findings": [_plain_finding(finding) for finding in verdict.findings],
            }
            for id_, verdict in found.verdicts.items()
        },
        "errors": dict(found.errors),
        "not_judged": dict(found.task.not_grounded),
    }
