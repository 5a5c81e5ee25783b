"""Which steps of a rollout have poses: as few as its motion between them needs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from pytest_safemanip.trace.geometry import Array

FRAMES_PER_SECOND = 20.0
OFF, TURNED = 1e-3, 0.01
"""How far a straight motion between two frames may be from the recorded poses, m and rad."""
MOST_TRACK_BYTES = 300_000
"""Of the poses; beyond it there are fewer frames."""
POSE_BYTES = 14


def stride(period: float) -> int:
    """Steps between two moments of a replay, given the control period in s."""
    return max(1, round(1.0 / (FRAMES_PER_SECOND * period)))


def choose_frames(
    length: int, period: float, marked: Iterable[int], tracks: Sequence[Array]
) -> Array:
    """The steps that have poses (F,), the first and the last among them.

    Args:
        length: number of steps.
        period: control period, s.
        marked: steps that have poses in any case.
        tracks: poses over all steps (T, 7), each.
    """
    most = max(2, MOST_TRACK_BYTES // (POSE_BYTES * max(len(tracks), 1)))
    between = max(stride(period), -(-length // most))
    wanted = np.clip(np.array([0, length - 1, *marked], int), 0, length - 1)
    if not tracks:
        alone: Array = np.unique(wanted)
        return alone
    candidates = np.unique(np.concatenate((np.arange(0, length, between), wanted)))
    places = np.stack([track[candidates, :3] for track in tracks], axis=1)
    turns = _continuous(np.stack([track[candidates, 3:] for track in tracks], axis=1))
    kept = np.isin(candidates, wanted)
    spans = list(pairwise(np.flatnonzero(kept).tolist()))
    while spans:
        first, last = spans.pop()
        part = slice(first, last + 1)
        worst = _worst(candidates[part], places[part], turns[part])
        if worst:
            kept[first + worst] = True
            spans += [(first, first + worst), (first + worst, last)]
    frames: Array = candidates[kept]
    return frames


def _continuous(turns: Array) -> Array:
    """Quaternions (T, N, 4) with the sign of the one before: ``q`` and ``-q`` are one rotation."""
    same = np.einsum("tni,tni->tn", turns[1:], turns[:-1]) >= 0
    signs = np.cumprod(np.where(same, 1.0, -1.0), axis=0)
    result: Array = turns.astype(float)
    result[1:] *= signs[..., None]
    return result


def _worst(steps: Array, places: Array, turns: Array) -> int:
    """Which of poses (K, N, 3), (K, N, 4) at steps (K,) is farthest from a straight motion from the
    first to the last; 0 if none is too far.
    """
    if len(steps) < 3:
        return 0
    share = ((steps - steps[0]) / (steps[-1] - steps[0]))[:, None, None]
    apart = np.linalg.norm(places - (places[0] + share * (places[-1] - places[0])), axis=-1)
    straight = turns[0] + share * (turns[-1] - turns[0])
    straight /= np.maximum(np.linalg.norm(straight, axis=-1, keepdims=True), 1e-9)
    # The angle of a rotation is twice that between quaternions.
    angle = 2.0 * np.linalg.norm(turns - straight, axis=-1)
    wrong = np.maximum(apart / OFF, angle / TURNED).max(axis=1)
    worst = int(np.argmax(wrong))
    return worst if wrong[worst] > 1.0 else 0
