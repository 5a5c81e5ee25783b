"""Numbers as a browser reads them: little-endian arrays in base64, poses in 16 bits a number."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from pytest_safemanip.trace.geometry import Array

Kind = Literal["<u1", "<u2", "<i2", "<u4", "<f4"]
LEVELS = 65535
"""Steps between the least and the largest of a coordinate."""
UNIT = 32767
"""What a quaternion's or a normal's 1 is written as."""


def packed(values: Any, kind: Kind) -> str:
    """An array as base64 of its numbers, the last axis fastest."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


def pack_places(places: Array, axes: tuple[int, ...]) -> dict[str, Any]:
    """Places (..., 3) in 16 bits a coordinate, within their bounds over some axes.

    A place that is read back is off by at most the bounds' extent / 131070, in each coordinate.
    """
    if places.size == 0:
        return {"low": [], "size": [], "data": ""}
    low = places.min(axis=axes)
    size = places.max(axis=axes) - low
    levels = np.rint((places - low) / np.where(size > 0, size, 1.0) * LEVELS)
    return {"low": _plain(low), "size": _plain(size), "data": packed(levels, "<u2")}


def pack_turns(turns: Array) -> str:
    """Unit quaternions or vectors (...) in 16 bits a number."""
    return packed(np.rint(np.clip(turns, -1.0, 1.0) * UNIT), "<i2")


def pack_tracks(tracks: Sequence[Array], frames: Array) -> dict[str, Any]:
    """Tracks (T, 7) at some steps (F,): places and turns, a frame after the other."""
    if not tracks:
        return {"count": 0, "places": pack_places(np.zeros((0, 3)), (0,)), "turns": ""}
    poses = np.stack([track[frames] for track in tracks], axis=1)
    turns = poses[..., 3:] / np.linalg.norm(poses[..., 3:], axis=-1, keepdims=True)
    places = pack_places(poses[..., :3], (0,))
    return {"count": len(tracks), "places": places, "turns": pack_turns(turns)}


def _plain(values: Array) -> list[float]:
    return [round(float(value), 6) for value in values.ravel()]
