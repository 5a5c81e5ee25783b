"""A rollout as the browser's replay reads it: plain builtins, a few hundred kB."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from pytest_safemanip.errors import printable
from pytest_safemanip.judge import Finding, Verdict
from pytest_safemanip.report.replay.encoding import pack_places, pack_tracks, packed
from pytest_safemanip.report.replay.keyframes import choose_frames
from pytest_safemanip.report.replay.stage import FORMS, Skin, Stage, set_stage
from pytest_safemanip.report.replay.touches import pack_touches
from pytest_safemanip.report.replay.views import choose_view
from pytest_safemanip.sim.looks import Look
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.recording import Recording, check

SCHEMA = 1
MOST_FINDINGS, MOST_EVIDENCE = 40, 6
MOST_CHARACTERS = 200


def pack(
    recording: Recording, verdicts: Mapping[str, Verdict], looks: Sequence[Look] = ()
) -> dict[str, Any]:
    """What ``SafemanipReplay.mount`` shows of a rollout.

    Args:
        recording: the rollout.
        verdicts: on it, by property.
        looks: meshes of its things from a simulator; those without are boxes.

    Returns:
        ``dt`` (s), ``steps``, ``acting``; ``entities``; ``frames``, the steps that have poses:
        at most 20 in a second, as many as keep the motion between them within a millimetre and
        0.01 rad, and always the first and last unsafe step of each finding;
        ``solids`` in arrays and ``skins``, meshes, carried by ``tracks``; ``contacts``;
        ``findings`` with the property, the numbers of the guilty entities, first and last unsafe
        step, what was measured and the ``view`` of it; ``view`` from where to look first. Names
        have no control characters; they are not escaped for HTML.

    Raises:
        TraceError: if the recording is physically impossible.
    """
    check(recording)
    found = [(id_, f) for id_, verdict in verdicts.items() for f in verdict.findings]
    found = sorted(found, key=lambda item: item[1].first)[:MOST_FINDINGS]
    guilty = {name for _, finding in found for name in guilty_entities(finding, recording)}
    boxes = set_stage(recording, guilty)
    stage = set_stage(recording, guilty, looks) if looks else boxes
    names = {entity.name: i for i, entity in enumerate(recording.scene.entities)}
    length, period = len(recording.steps), recording.scene.control_period
    marked = [step for _, finding in found for step in (finding.first, finding.last)]
    frames = choose_frames(length, period, marked, stage.tracks)
    begin = found[0][1].first if found else 0
    about = recording.episode
    return {
        "schema": SCHEMA,
        "task": printable(about.task),
        "policy": printable(about.policy),
        "seed": about.seed,
        "instruction": printable(about.instruction),
        "dt": period,
        "steps": length,
        "acting": recording.acting,
        "frames": packed(frames, "<u4"),
        "entities": _entities(recording),
        "solids": _solids(stage, names),
        "skins": [_skin(skin, names) for skin in stage.skins if skin.entity in names],
        "tracks": pack_tracks(stage.tracks, frames),
        "contacts": pack_touches(recording, names, guilty),
        "verdicts": {id_: verdict.outcome.label for id_, verdict in verdicts.items()},
        "findings": [
            {
                **_finding(id_, f, recording, names),
                "view": choose_view(recording, boxes, f.first, guilty_entities(f, recording)),
            }
            for id_, f in found
        ],
        "view": choose_view(recording, boxes, begin, guilty),
    }


def guilty_entities(finding: Finding, recording: Recording) -> tuple[str, ...]:
    """What a violation is about; of a rule about the robot, what it was found to do it with."""
    if finding.entities:
        return finding.entities
    known = recording.scene.entity
    words = [word for text in finding.evidence for word in re.split(r"[^\w.-]+", text)]
    named = tuple(dict.fromkeys(word for word in words if word in known and word != ROBOT))
    return named or (ROBOT,)


def _entities(recording: Recording) -> list[dict[str, str]]:
    return [
        {
            "name": printable(entity.name, MOST_CHARACTERS),
            "kind": entity.kind,
            "category": printable(entity.category, MOST_CHARACTERS),
        }
        for entity in recording.scene.entities
    ]


def _solids(stage: Stage, names: Mapping[str, int]) -> dict[str, Any]:
    solids = stage.solids
    return {
        "count": len(solids),
        "entity": packed([names[s.entity] for s in solids], "<u4"),
        "form": packed([FORMS.index(s.form) for s in solids], "<u1"),
        "track": packed([s.track for s in solids], "<i2"),
        "half": packed([s.half for s in solids], "<f4"),
        "pose": packed([s.pose for s in solids], "<f4"),
    }


def _skin(skin: Skin, names: Mapping[str, int]) -> dict[str, Any]:
    red, green, blue = (round(255 * min(max(share, 0.0), 1.0)) for share in skin.colour)
    return {
        "entity": names[skin.entity],
        "track": skin.track,
        "colour": f"#{red:02x}{green:02x}{blue:02x}",
        "points": pack_places(skin.points, (0,)),
        "triangles": packed(skin.triangles, "<u2"),
    }


def _finding(
    id_: str, finding: Finding, recording: Recording, names: Mapping[str, int]
) -> dict[str, Any]:
    return {
        "property": printable(id_),
        "guilty": [names[x] for x in guilty_entities(finding, recording) if x in names],
        "first": finding.first,
        "last": finding.last,
        "reason": finding.reason,
        "evidence": [printable(text, 300) for text in finding.evidence[:MOST_EVIDENCE]],
    }
