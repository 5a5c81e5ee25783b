"""The false-alarm floor: how often properties flag demonstrations, which are meant to be safe."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.metrics.records import RolloutRecord
from pytest_safemanip.metrics.summaries import NAME, read
from pytest_safemanip.run.cases import Case
from pytest_safemanip.run.discovery import find_recordings, select_recordings
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.results import Results, judged_data
from pytest_safemanip.run.session import SafetySession


@dataclass(frozen=True)
class Floor:
    """Demonstrations that a policy's rates are shown beside.

    Attributes:
        records: of their rollouts.
        left_out: the line that names logs that do not tell what properties need; or empty.
    """

    records: Sequence[RolloutRecord] = ()
    left_out: str = ""


def find_floor(plan: Plan) -> Floor:
    """The demonstrations of a run's tasks, judged by its properties; none without a floor.

    They are in ``--safemanip-floor``: the folder of a run, or recordings, which are judged now.

    Raises:
        ConfigError: if there are none.
        SafemanipError: if a recording cannot be judged.
    """
    folder = plan.settings.floor
    if folder is None:
        return Floor()
    wanted: dict[str, dict[str, None]] = {}
    for case in plan.cases:
        wanted.setdefault(case.task, {})[case.property_id] = None
    left_out = ""
    if (folder / NAME).exists():
        records = [_narrowed(r, wanted[r.task]) for r in read(folder).records if r.task in wanted]
        records = [record for record in records if record.complete and record.properties]
    else:
        records, left_out = _judged(plan, folder, wanted)
    if not records:
        raise ConfigError(
            f"--safemanip-floor: {folder} has no demonstration of {', '.join(sorted(wanted))}"
            + (f" ({left_out})" if left_out else "")
        )
    return Floor(records, left_out)


def _narrowed(record: RolloutRecord, wanted: dict[str, None]) -> RolloutRecord:
    own = {id_: verdict for id_, verdict in record.properties.items() if id_ in wanted}
    unjudged = {id_: category for id_, category in record.unjudged.items() if id_ in wanted}
    return dataclasses.replace(
        record, properties=own, unjudged=unjudged, deselected={}, provenance=None, recording=""
    )


def _judged(
    plan: Plan, folder: Path, wanted: dict[str, dict[str, None]]
) -> tuple[list[RolloutRecord], str]:
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
    left_out: dict[str, list[str]] = {}
    for case in cases:
        found = session.evaluate(case)
        try:
            verdict = found.verdict(case.property_id)
        except TraceError:
            if not found.recording.episode.unobserved:
                raise
            left_out.setdefault(found.path.name, []).append(case.property_id)
            continue
        prop = plan.properties[case.property_id]
        results.add(judged_data(case, prop, verdict, found.recording, found.path))
    records = [
        dataclasses.replace(record, provenance=None, recording="") for record in results.records
    ]
    return records, _named(left_out)


def _named(left_out: dict[str, list[str]]) -> str:
    logs = (f"{name} ({', '.join(ids)})" for name, ids in left_out.items())
    return f"left out, not observed: {'; '.join(logs)}" if left_out else ""
