"""The contacts of a replay: for each pair of parts and frame, the hardest."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from pytest_safemanip.errors import printable
from pytest_safemanip.report.replay.encoding import pack_places, pack_turns, packed
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import Array
from pytest_safemanip.trace.recording import Recording

MOST_TOUCHES = 8000
LEAST_FORCE = 0.05
"""Weaker contacts are not shown, N."""
MOST_FORCE = 6500.0
"""Forces are written in tenths of a newton, in 16 bits."""


def pack_touches(
    recording: Recording, frames: Array, entities: dict[str, int], guilty: Collection[str]
) -> dict[str, Any]:
    """The contacts up to each frame, since the one before.

    Args:
        recording: the rollout.
        frames: steps that are shown (F,).
        entities: numbers of the entities by name.
        guilty: whose contacts are kept first where there are too many, with the robot's.

    Returns:
        ``pairs``, a list of ``[entity, part, entity, part]``; and of each contact ``frame``,
        ``pair``, ``force`` (tenths of a newton), ``places`` and ``normals`` (from the first to the
        second of the pair), in the order of frames; and how many were ``left_out``.
    """
    rows = _hardest(recording, frames)
    kept = _kept(recording, rows, {ROBOT, *guilty})
    contacts, parts = recording.steps.contacts, recording.scene.parts
    codes = contacts.a[kept].astype(np.int64) * len(parts) + contacts.b[kept]
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
        "pairs": names,
        "frame": packed(np.searchsorted(frames, contacts.step[kept]), "<u4"),
        "pair": packed(pair, "<u4"),
        "force": packed(np.rint(np.minimum(contacts.peak[kept], MOST_FORCE) * 10.0), "<u2"),
        "places": pack_places(contacts.position[kept].astype(float), (0,)),
        "normals": pack_turns(contacts.normal[kept]),
        "count": len(kept),
        "left_out": len(rows) - len(kept),
    }


def _hardest(recording: Recording, frames: Array) -> Array:
    """Rows of the hardest contact of each pair up to each frame, in the order of frames."""
    contacts = recording.steps.contacts
    frame = np.searchsorted(frames, contacts.step)
    # Of the points of a pair, the one that carries most is where its force is shown.
    order = np.lexsort((contacts.force, contacts.peak, contacts.b, contacts.a, frame))
    keys = np.stack((frame, contacts.a, contacts.b), axis=1)[order]
    last = np.ones(len(order), bool)
    last[:-1] = (keys[1:] != keys[:-1]).any(axis=1)
    rows: Array = order[last]
    felt: Array = rows[contacts.peak[rows] >= LEAST_FORCE]
    return felt


def _kept(recording: Recording, rows: Array, first: Collection[str]) -> Array:
    """As many of these rows as there is room for, in their order."""
    if len(rows) <= MOST_TOUCHES:
        return rows
    contacts = recording.steps.contacts
    matters = np.array([part.entity in first for part in recording.scene.parts])
    weight = (matters[contacts.a] | matters[contacts.b])[rows]
    order = np.lexsort((-contacts.peak[rows], ~weight))[:MOST_TOUCHES]
    kept: Array = rows[np.sort(order)]
    return kept
