"""The text of a test failure: which rule was broken, by what, when, and what proves it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pytest_safemanip import cost
from pytest_safemanip.judge import Finding, Verdict
from pytest_safemanip.report.numbers import one_line
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.trace.recording import Recording

MAX_FINDINGS = 3
"""Violations shown in full, the worst; the others are one line in all."""
MAX_CHARACTERS = 4000
"""Reports are read on screens and cut by CI servers."""


def headline(verdict: Verdict, recording: Recording) -> str:
    """One line for summaries: the property and its worst violation."""
    return f"{verdict.property_id}: {worst_violation(verdict, recording)}"


def unresolved(verdict: Verdict, recording: Recording) -> str:
    """Since when an obligation of whom was pending when the rollout ended."""
    entities, since = verdict.open[0]
    about = f" for {', '.join(entities)}" if entities else ""
    return (
        f"{verdict.property_id}: unresolved{about}: an obligation was pending since step {since}, "
        f"the rollout ended before it was due{truncation(recording)}"
    )


def truncation(recording: Recording) -> str:
    """That a recording lacks its end, in brackets; empty if it does not."""
    return " (truncated: the recording has no settle tail)" if recording.truncated else ""


def worst_violation(verdict: Verdict, recording: Recording) -> str:
    """What was measured at the worst violation, and when; how many more there are."""
    worst = verdict.by_severity[0]
    seconds = worst.first * recording.trace.dt
    whose = f" for {named(worst.entities, recording)}" if worst.entities else ""
    about = f"{worst.reason}{whose}"
    why = worst.evidence[0] if worst.evidence else about
    more = len(verdict.findings) - 1
    also = f" (and {more} more)" if more else ""
    return f"{why}, at step {worst.first} ({seconds:.2f} s){also}"


def counterexample(
    prop: Property,
    verdict: Verdict,
    recording: Recording,
    path: Path,
    watch: str,
    command: str,
    brief: bool = False,
) -> str:
    """The whole text, at most :data:`MAX_CHARACTERS` long.

    Args:
        prop: the violated property.
        verdict: the verdict on it.
        recording: of the rollout.
        path: where the recording is kept.
        watch: the command that shows it.
        command: that runs this case again.
        brief: whether to show the worst violation only, without the steps that prove it.
    """
    episode = recording.episode
    success = "successful at" if recording.success else "no success up to"
    end = recording.acting - 1
    if brief:
        rule = _rule(prop, verdict)[:1]
        lines = [*rule, *_brief(prop, verdict, recording), f"reproduce with  {command}"]
        return "\n".join(lines)
    head = [
        *_rule(prop, verdict),
        "",
        f"rollout  {episode.task}, policy {episode.policy}, seed {episode.seed}: {success} "
        f"step {end} ({end * recording.trace.dt:.2f} s)",
        f"  {episode.instruction!r}",
    ]
    foot = [
        "",
        f"recording       {path}",
        f"watch           {watch}",
        f"reproduce with  {command}",
    ]
    room = MAX_CHARACTERS - len("\n".join([*head, *foot]))
    return "\n".join([*head, *_body(prop, verdict, recording, room), *foot])


def violation_lines(prop: Property, verdict: Verdict, recording: Recording) -> list[str]:
    """The rule and its violations, without what is said about the rollout."""
    return [*_rule(prop, verdict), *_body(prop, verdict, recording, MAX_CHARACTERS)]


def _rule(prop: Property, verdict: Verdict) -> list[str]:
    title, source = one_line(prop.title), one_line(prop.source)
    return [f"{prop.id}: {title} ({source})", f"  {verdict.formula}{_terms(prop)}"]


def _body(prop: Property, verdict: Verdict, recording: Recording, room: int) -> list[str]:
    """As many violations in full as there is room for, at least the worst of them."""
    findings = verdict.by_severity
    lines: list[str] = []
    for index, finding in enumerate(findings):
        block = ["", *_finding(prop, finding, recording), *_proof(finding)]
        fits = len("\n".join([*lines, *block])) < room - 100
        if index and (index >= MAX_FINDINGS or not fits):
            steps = ", ".join(str(f.first) for f in findings[index : index + 8])
            dots = ", ..." if len(findings) > index + 8 else ""
            left = len(findings) - index
            return [*lines, "", f"and {left} more, from step{'s' * (left > 1)} {steps}{dots}"]
        lines += block
    return lines


def _brief(prop: Property, verdict: Verdict, recording: Recording) -> list[str]:
    """The worst violation without its excerpt."""
    lines = _finding(prop, verdict.by_severity[0], recording)
    left = len(verdict.findings) - 1
    return [*lines, f"and {left} more"] if left else lines


def _finding(prop: Property, finding: Finding, recording: Recording) -> list[str]:
    """What was violated, when and how badly, and what was measured."""
    dt = recording.trace.dt
    about = f" for {named(finding.entities, recording)}" if finding.entities else ""
    return [
        f"VIOLATED{about} at step {finding.first} ({finding.first * dt:.2f} s), "
        f"unsafe for {finding.duration_s:.2f} s",
        f"  {finding.severity}",
        *([f"  {cost.in_words(finding.cost, prop.cost)}"] if prop.says_cost else []),
        *(f"  {line}" for line in finding.evidence),
    ]


def _proof(finding: Finding) -> list[str]:
    return [f"  {line}".rstrip() for line in finding.proof.splitlines()]


def named(entities: Sequence[str], recording: Recording) -> str:
    """Entities with what they are: ``obj (onion), cab_2_main_group (cabinet)``."""
    known = recording.scene.entity
    return ", ".join(
        f"{name} ({known[name].category})" if name in known else name for name in entities
    )


def _terms(prop: Property) -> str:
    if prop.deadline_s is None:
        return ""
    return f"   within {prop.deadline_s:g} s, discharged by {prop.discharged_by}"
