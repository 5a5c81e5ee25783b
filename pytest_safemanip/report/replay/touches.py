"""The contacts of a replay: of each pair of parts the hardest, for as long as it stays the same."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from pytest_safemanip.errors import printable
from pytest_safemanip.report.replay.encoding import pack_places, pack_turns, packed
from pytest_safemanip.report.replay.keyframes import stride
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import Array
from pytest_safemanip.trace.recording import Recording

MOST_TOUCHES = 8000
LEAST_FORCE = 0.05
"""Weaker contacts are not shown, N."""
MOST_FORCE = 6500.0
"""Forces are written in tenths of a newton, in 16 bits."""
SAME_FORCE, SAME_SHARE, SAME_PLACE, SAME_WAY = 0.3, 0.1, 3e-3, 0.1
"""A contact that differs by less is the same as before: in N, as a share of its force, in m, and in
its direction."""
LONGEST = 65_535

_Felt = tuple[float, list[float], list[float]]
"""Force, place and direction of a contact."""


def pack_touches(
    recording: Recording, entities: Mapping[str, int], guilty: Collection[str]
) -> dict[str, Any]:
    """The contacts, at most 20 times a second.

    Args:
        recording: the rollout.
        entities: numbers of the entities by name.
        guilty: whose contacts are kept first where there are too many, with the robot's.

    Returns:
        ``stride``, the steps of a moment; ``pairs``, a list of ``[entity, part, entity, part]``;
        of each contact the ``moment`` that it begins at and for how many moments it is ``lasting``,
        its ``pair``, its ``force`` (sustained by the pair, tenths of a newton), ``places`` and
        ``normals`` (from the first to the second of the pair), in the order of moments; and how
        many were ``left_out``.
    """
    contacts, parts = recording.steps.contacts, recording.scene.parts
    long = stride(recording.scene.control_period)
    hardest = _hardest(recording, long)
    runs, lasting = _runs(recording, hardest, long)
    kept = _kept(recording, runs, {ROBOT, *guilty})
    rows = runs[kept]
    codes = contacts.a[rows].astype(np.int64) * len(parts) + contacts.b[rows]
    known, pair = np.unique(codes, return_inverse=True)
    names = [
        [
            x
            for part in (parts[code // len(parts)], parts[code % len(parts)])
            for x in (entities[part.entity], printable(part.name, 60))
        ]
        for code in known.tolist()
    ]
    return {
        "stride": long,
        "pairs": names,
        "moment": packed(contacts.step[rows] // long, "<u4"),
        "lasting": packed(lasting[kept], "<u2"),
        "pair": packed(pair, "<u2"),
        "force": packed(np.rint(np.minimum(contacts.sustained[rows], MOST_FORCE) * 10.0), "<u2"),
        "places": pack_places(contacts.position[rows].astype(float), (0,)),
        "normals": pack_turns(contacts.normal[rows]),
        "count": len(rows),
        "left_out": len(runs) - len(rows),
    }


def _hardest(recording: Recording, long: int) -> Array:
    """Rows of the hardest contact of each pair in each moment, in the order of moments."""
    contacts = recording.steps.contacts
    moment = contacts.step // long
    # Of the points of a pair, the one that carries most is where its force is shown.
    order = np.lexsort((contacts.force, contacts.sustained, contacts.b, contacts.a, moment))
    keys = np.stack((moment, contacts.a, contacts.b), axis=1)[order]
    last = np.ones(len(order), bool)
    last[:-1] = (keys[1:] != keys[:-1]).any(axis=1)
    rows: Array = order[last]
    felt: Array = rows[contacts.sustained[rows] >= LEAST_FORCE]
    return felt


def _runs(recording: Recording, rows: Array, long: int) -> tuple[Array, Array]:
    """The first rows of contacts that stay the same, and for how many moments they do (R,)."""
    contacts = recording.steps.contacts
    moments = (contacts.step[rows] // long).tolist()
    pairs = zip(contacts.a[rows].tolist(), contacts.b[rows].tolist(), strict=True)
    values = zip(
        contacts.sustained[rows].tolist(),
        contacts.position[rows].tolist(),
        contacts.normal[rows].tolist(),
        strict=True,
    )
    begun: dict[tuple[int, int], tuple[int, _Felt]] = {}
    runs: list[int] = []
    lasting: list[int] = []
    begins: list[int] = []
    for row, moment, pair, value in zip(rows.tolist(), moments, pairs, values, strict=True):
        run, first = begun.get(pair, (-1, value))
        if (
            run >= 0
            and moment == begins[run] + lasting[run]
            and lasting[run] < LONGEST
            and _same(first, value)
        ):
            lasting[run] += 1
            continue
        begun[pair] = (len(runs), value)
        runs.append(row)
        begins.append(moment)
        lasting.append(1)
    return np.array(runs, np.int64), np.array(lasting, np.int64)


def _same(one: _Felt, other: _Felt) -> bool:
    """Whether a force, place and direction differ too little to be shown."""
    (force, place, way), (force2, place2, way2) = one, other
    return (
        abs(force - force2) <= max(SAME_FORCE, SAME_SHARE * force)
        and max(abs(a - b) for a, b in zip(place, place2, strict=True)) <= SAME_PLACE
        and max(abs(a - b) for a, b in zip(way, way2, strict=True)) <= SAME_WAY
    )


def _kept(recording: Recording, rows: Array, first: Collection[str]) -> Array:
    """Which of these rows there is room for, in their order."""
    if len(rows) <= MOST_TOUCHES:
        return np.arange(len(rows))
    contacts = recording.steps.contacts
    matters = np.array([part.entity in first for part in recording.scene.parts])
    weight = (matters[contacts.a] | matters[contacts.b])[rows]
    kept: Array = np.sort(np.lexsort((-contacts.sustained[rows], ~weight))[:MOST_TOUCHES])
    return kept
