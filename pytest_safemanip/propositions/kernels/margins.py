"""Margins and what filters make of them: the same order statistics that decide the truth values.

Where all of some conditions have to hold the margin is the least of theirs, where one is enough the
greatest, and where a vote decides that of the last vote it takes (space robustness, Fainekos and
Pappas 2009). Before the first step everything is false, by :data:`NONE`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

from pytest_safemanip.propositions.definition import Bools, Floats
from pytest_safemanip.propositions.kernels.filters import drift

NONE = -1.0
"""The margin of a condition that is not met at all: no force, no movement, nothing there."""
LEAST = 1e-6
"""What a limit counts as at least: a box may have no thickness."""


def over(quantity: NDArray[Any], limit: float) -> Floats:
    """Margins of being at a limit or above it (T, ...)."""
    return np.asarray((quantity - limit) / limit, np.float64)


def under(quantity: NDArray[Any], limit: float) -> Floats:
    """Margins of being at a limit or below it (T, ...)."""
    return np.asarray((limit - quantity) / limit, np.float64)


def within(place: Floats, half: ArrayLike) -> Floats:
    """Margins of points (..., 3) being in a box around the origin, of which half the width is the
    limit (...).
    """
    half = np.asarray(half, np.float64)
    result: Floats = ((half - np.abs(place)) / np.maximum(half, LEAST)).min(axis=-1)
    return result


def stillness(places: Floats, count: int, limit: float) -> Floats:
    """Margins of having moved less than ``limit`` metres over the last ``count`` steps (T, ...)."""
    return under(drift(places, count), limit)


def given(condition: Bools, margins: Floats) -> Floats:
    """Margins where a condition without a threshold holds, :data:`NONE` at most elsewhere (T,)."""
    return np.where(condition, margins, np.minimum(margins, NONE))


def voted(margins: Floats, count: int) -> Floats:
    """Margins of being true in the majority of the last ``count`` steps (T, ...)."""
    place = count - (count // 2 + 1)
    return np.asarray(np.partition(_latest(margins, count), place, axis=-1)[..., place])


def lasting(margins: Floats, count: int) -> Floats:
    """Margins of being true in all of the last ``count`` steps (T, ...)."""
    return np.asarray(_latest(margins, count).min(axis=-1))


def lately(margins: Floats, count: int) -> Floats:
    """Margins of being true in one of the last ``count`` steps (T, ...)."""
    return np.asarray(_latest(margins, count).max(axis=-1))


def _latest(margins: Floats, count: int) -> Floats:
    """The last ``count`` margins of each step (T, ..., count)."""
    before = np.full((count - 1, *margins.shape[1:]), NONE)
    return sliding_window_view(np.concatenate((before, margins)), count, axis=0)
