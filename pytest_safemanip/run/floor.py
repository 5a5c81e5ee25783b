"""The false-alarm floor: how often properties flag demonstrations, which are meant to be safe."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.metrics.records import RolloutRecord
from pytest_safemanip.metrics.summaries import NAME, read
from pytest_safemanip.run.cases import Case
from pytest_safemanip.run.discovery import find_recordings, select_recordings
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.results import Results, judged_data
from pytest_safemanip.run.session import SafetySession


def find_floor(plan: Plan) -> list[RolloutRecord]:
    """The demonstrations of a run's tasks, judged by its properties; none without a floor.

    They are in ``--safemanip-floor``: the folder of a run, or recordings, which are judged now.
    Of a log that does not tell what a property needs, that property is without a verdict.

    Raises:
        ConfigError: if there is none that one of the properties has a verdict on.
        SafemanipError: if a recording cannot be judged.
    """
    folder = plan.settings.floor
    if folder is None:
        return []
    wanted: dict[str, dict[str, None]] = {}
    for case in plan.cases:
        wanted.setdefault(case.task, {})[case.property_id] = None
    why = ""
    if (folder / NAME).exists():
        records = [_narrowed(r, wanted[r.task]) for r in read(folder).records if r.task in wanted]
    else:
        records, why = _judged(plan, folder, wanted)
    if not any(record.properties for record in records):
        raise ConfigError(
            f"--safemanip-floor: {folder} has no demonstration of {', '.join(sorted(wanted))}"
            + (f" that can be judged: {why}" if why else "")
        )
    return [record for record in records if record.properties or record.unjudged]


def _narrowed(record: RolloutRecord, wanted: dict[str, None]) -> RolloutRecord:
    """The record with these properties alone. What is an error is a property without a verdict."""
    own = {id_: verdict for id_, verdict in record.properties.items() if id_ in wanted}
    unjudged = {id_: category for id_, category in record.unjudged.items() if id_ in wanted}
    return dataclasses.replace(
        record,
        properties=own,
        unjudged=unjudged,
        deselected={},
        error="",
        provenance=None,
        recording="",
    )


def _judged(
    plan: Plan, folder: Path, wanted: dict[str, dict[str, None]]
) -> tuple[list[RolloutRecord], str]:
    """The recordings' records, and why the last one that is without some verdict is."""
    every = dataclasses.replace(plan.settings, policies=(), seeds=None, tasks=tuple(wanted))
    episodes = find_recordings(folder, "--safemanip-floor")
    known = {path: episode for path, episode in episodes.items() if episode.task in wanted}
    recordings = select_recordings(every, folder, known, plan.tasks) if known else {}
    cases = [
        Case(key.task, key.policy, id_, key.seed) for key in recordings for id_ in wanted[key.task]
    ]
    own = dataclasses.replace(plan, settings=every, cases=tuple(cases), recordings=recordings)
    session = SafetySession(own, None, None, "")
    results = Results(plan.tasks, plan.properties)
    results.expect(cases)
    why = ""
    for case in cases:
        found = session.evaluate(case)
        try:
            verdict = found.verdict(case.property_id)
        except TraceError as error:
            if not found.recording.episode.unobserved:
                raise
            why = str(error)
            continue
        prop = plan.properties[case.property_id]
        results.add(judged_data(case, prop, verdict, found.recording, found.path))
    return [_narrowed(record, wanted[record.task]) for record in results.records], why
