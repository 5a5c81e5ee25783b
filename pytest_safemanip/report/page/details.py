"""The recordings of a run, judged once more for what the page shows over their steps."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from pytest_safemanip.errors import (
    SafemanipError,
    TraceError,
    judging,
    printable,
)
from pytest_safemanip.judge import Judge, Verdict
from pytest_safemanip.ltlf import Profile
from pytest_safemanip.metrics.records import PropertyRecord, RolloutRecord
from pytest_safemanip.metrics.summaries import Summary
from pytest_safemanip.report.page.encoding import told
from pytest_safemanip.report.page.timeline import Judged, timeline
from pytest_safemanip.report.pictures import is_of
from pytest_safemanip.report.replay.packing import pack
from pytest_safemanip.report.severity import Key, severity_line, worst
from pytest_safemanip.run.cases import Case
from pytest_safemanip.run.definitions import Definitions
from pytest_safemanip.run.invocation import relative_path, reproduce
from pytest_safemanip.trace import files

Json = dict[str, Any]
VIDEOS = "videos"
"""The folder, in that of the run, in which videos are."""
MOST_REPLAYS = 200
"""Rollouts with a replay in 3D, the worst: each is some tens of kB."""
MOST = 1e300
"""Sanity bound on a parameter of a run."""
MAX_UNEVENTFUL = 200
"""Rollouts without a violation that have a timeline too, in a run that has no more of them."""


def details(found: Summary, folder: Path, definitions: Definitions) -> Iterator[tuple[int, Json]]:
    """The details of rollouts, by their number in the summary, the worst first.

    Keys of each: those of :func:`~pytest_safemanip.report.page.timeline.timeline`, ``recording``
    and ``commands`` (by property id), ``video``, ``replay`` of the worst rollouts, and ``note``
    where something is not as it should be; instead of a timeline, ``violations`` as the summary
    has them where the recording cannot be judged.

    Args:
        found: the summary.
        folder: of the run.
        definitions: tasks, properties and propositions.
    """
    replayed = 0
    for number in _wanted(found.records):
        record = found.records[number]
        content: Json = {
            "recording": str(_told_place(Path(os.path.normpath(record.recording)), folder)),
            "commands": {id_: _command(found, record, id_) for id_ in record.properties},
            "video": _video(record, folder),
        }
        try:
            judged = _judge(record, found.decisive, definitions)
            content |= timeline(judged)
        except SafemanipError as error:
            content["note"] = told(f"no timeline: {error}")
            content["violations"] = told(_as_told(record, found.rules))
        else:
            content["note"] = told(_differs(record, judged))
            if replayed < MOST_REPLAYS and _is_violated(judged):
                content["replay"] = pack(judged.recording, judged.verdicts)
                replayed += 1
        yield number, content


def worst_of_each(records: Sequence[RolloutRecord], ranked: Mapping[Key, int]) -> Json:
    """The worst violation of each property, by its id: what the summary says, ``rollout`` (its
    number), ``place`` and ``rank``.
    """
    found: Json = {}
    for key, rank in ranked.items():
        number, id_, place = key
        if id_ not in found or rank < found[id_]["rank"]:
            told_of = _told_violation(records[number].properties[id_].violations[place])
            found[id_] = {**told_of, "rollout": number, "place": place, "rank": rank}
    return found


def _as_told(record: RolloutRecord, rules: Mapping[str, Mapping[str, str]]) -> list[Json]:
    """The violations of a rollout with their rules, as the summary has them."""
    return [
        {
            "property": id_,
            **{key: rules.get(id_, {}).get(key, "") for key in ("title", "source", "formula")},
            **_told_violation(violation),
            "timeline": violation.get("timeline"),
        }
        for id_, verdict in record.properties.items()
        for violation in verdict.violations
    ]


def _told_violation(violation: Mapping[str, Any]) -> Json:
    kept = ("first", "last", "duration_s", "entities", "reason")
    about = {name: violation[name] for name in kept}
    evidence = list(violation.get("evidence", ()))
    severity = severity_line(violation)
    return {
        **about,
        "severity": severity,
        "evidence": evidence,
        "excess": violation.get("excess"),
    }


def _told_place(recording: Path, folder: Path) -> Path:
    """The path of a recording in a command: as from here, or as from where the run's folder is."""
    shown = relative_path(recording, Path.cwd())
    if not shown.is_absolute() or not recording.is_relative_to(folder.resolve()):
        return shown
    return folder.resolve().name / recording.relative_to(folder.resolve())


def _wanted(records: Sequence[RolloutRecord]) -> list[int]:
    """Numbers of the rollouts that have details, the worst first."""
    kept = [n for n, record in enumerate(records) if record.recording]
    telling = [n for n in kept if _outcomes(records[n]) & {"VIOLATED", "UNRESOLVED"}]
    others = [n for n in kept if not _outcomes(records[n]) & {"VIOLATED", "UNRESOLVED"}]
    telling.sort(key=lambda n: worst(records[n]), reverse=True)
    return telling + (others if len(others) <= MAX_UNEVENTFUL else [])


def _outcomes(record: RolloutRecord) -> set[str]:
    return {verdict.outcome for verdict in record.properties.values()}


def _video(record: RolloutRecord, folder: Path) -> str:
    """The video of a rollout, from the folder of the run; empty if there is none."""
    place = f"{VIDEOS}/{Path(record.recording).stem}.mp4"
    return quote(place) if is_of(folder / place, Path(record.recording)) else ""


def _command(found: Summary, record: RolloutRecord, id_: str) -> str:
    case = Case(record.task, record.policy, id_, record.seed)
    return reproduce(found.options, case.node_id)


def _judge(record: RolloutRecord, decisive: Mapping[str, Any], definitions: Definitions) -> Judged:
    """Judge a recording as the run did.

    Raises:
        TraceError: if it cannot be read, or what judged it is not known here.
        JudgementError: if a proposition raises anything else.
    """
    path = Path(record.recording)
    if path.suffix != files.SUFFIX:
        raise TraceError(f"{path}: not a recording")
    recording = files.load(path)
    about = recording.episode
    if (about.task, about.policy, about.seed) != (record.task, record.policy, record.seed):
        raise TraceError(f"{path}: a recording of another rollout")
    definitions = definitions.of_recordings([about])
    if record.task not in definitions.tasks:
        raise TraceError(f"unknown task {record.task!r}; name its folder in the ini file")
    profile: Profile = "paper" if decisive.get("semantics") == "paper" else "timed"
    judge = Judge(
        recording,
        definitions.tasks[record.task],
        definitions.attributes,
        definitions.catalogue,
        definitions.catalogue.parameters(_parameters(decisive, definitions)),
        profile,
    )
    known = [id_ for id_ in record.properties if id_ in definitions.properties]
    properties = {id_: definitions.properties[id_] for id_ in known}
    verdicts = {}
    for id_, prop in properties.items():
        with judging(f"{path}: {id_}"):
            verdicts[id_] = judge.judge(prop)
    return Judged(recording, judge, profile, properties, verdicts)


def _is_violated(judged: Judged) -> bool:
    return any(verdict.findings for verdict in judged.verdicts.values())


def _parameters(decisive: Mapping[str, Any], definitions: Definitions) -> dict[str, float]:
    """The run's values of the parameters that exist here."""
    known = definitions.catalogue.parameters({})
    told = {name.removeprefix("parameters."): value for name, value in decisive.items()}
    return {
        name: float(value)
        for name, value in told.items()
        if name in known
        and isinstance(value, int | float)
        and value != known[name]
        and -MOST < value < MOST
    }


def _differs(record: RolloutRecord, judged: Judged) -> str:
    """That something is not as the summary says; empty if all is."""
    lacking = sorted(record.properties.keys() - judged.properties.keys())
    other = [
        id_
        for id_, verdict in judged.verdicts.items()
        if _violations(record.properties[id_]) != _found(verdict)
    ]
    notes = []
    if lacking:
        notes.append(f"no timeline of {', '.join(lacking)}: not defined here")
    if other:
        notes.append(
            f"{', '.join(other)}: this version judges the recording in another way than the run did"
        )
    return "; ".join(notes)


def _violations(verdict: PropertyRecord) -> list[tuple[Any, ...]]:
    return sorted((tuple(v["entities"]), v["first"], v["last"]) for v in verdict.violations)


def _found(verdict: Verdict) -> list[tuple[Any, ...]]:
    """As a summary is read."""
    return sorted((tuple(map(printable, f.entities)), f.first, f.last) for f in verdict.findings)
