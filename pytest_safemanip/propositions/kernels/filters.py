"""Causal filters over truth values (T, ...); before the first step everything is false."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Bools = NDArray[np.bool_]


def majority(values: Bools, count: int) -> Bools:
    """True where more than half of the last ``count`` values are true.

    A flicker shorter than half the window never creates an edge.
    """
    return np.greater(2 * _trailing_sum(values, count), count)


def held(values: Bools, count: int) -> Bools:
    """True where all of the last ``count`` values are true."""
    return np.equal(_trailing_sum(values, count), count)


def recently(values: Bools, count: int) -> Bools:
    """True where at least one of the last ``count`` values is true."""
    return _trailing_sum(values, count) > 0


def rising(values: Bools) -> Bools:
    """True where a value becomes true; the first step is no edge."""
    return values & ~_shifted(values, fill=True)


def falling(values: Bools) -> Bools:
    """True where a value becomes false; the first step is no edge."""
    return ~values & _shifted(values, fill=False)


def still(places: NDArray[np.float64], count: int, limit: float) -> Bools:
    """True where places (T, ..., 3) moved less than ``limit`` metres over the last ``count`` steps,
    from the first of them to the last; before there are that many, from the very first.
    """
    return np.less(drift(places, count), limit)


def drift(places: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """How far places (T, ..., 3) moved over the last ``count`` steps, as :func:`still` means it, m
    (T, ...).
    """
    before = places[np.maximum(np.arange(len(places)) - (count - 1), 0)]
    return np.asarray(np.linalg.norm(places - before, axis=-1))


def change(values: NDArray[Any], count: int) -> NDArray[np.float64]:
    """How much values (T, ...) changed over the last ``count`` steps; before there are that many,
    since the very first.
    """
    values = np.asarray(values, np.float64)
    return np.subtract(values, values[np.maximum(np.arange(len(values)) - count, 0)])


def spread(values: NDArray[Any], count: int) -> NDArray[np.float64]:
    """The largest less the least of values (T,) within the last ``count`` steps and at the one
    before them.
    """
    values = np.asarray(values, np.float64)
    highest, lowest = values.copy(), values.copy()
    for lag in range(1, min(count, len(values) - 1) + 1):
        np.maximum(highest[lag:], values[:-lag], out=highest[lag:])
        np.minimum(lowest[lag:], values[:-lag], out=lowest[lag:])
    return np.subtract(highest, lowest)


def last_true(values: Bools, count: int) -> NDArray[np.intp]:
    """Index of the newest true value within the last ``count`` steps, -1 without one (T,)."""
    index = np.where(values, np.arange(len(values)), -1)
    newest = np.maximum.accumulate(index) if len(index) else index
    newest[newest < np.arange(len(values)) - (count - 1)] = -1
    return newest.astype(np.intp)


def _trailing_sum(values: Bools, count: int) -> NDArray[np.int64]:
    total = np.cumsum(values, axis=0, dtype=np.int64)
    found = total.copy()
    found[count:] -= total[:-count]
    return found


def _shifted(values: Bools, fill: bool) -> Bools:
    shifted = np.empty_like(values)
    shifted[:1], shifted[1:] = fill, values[:-1]
    return shifted


def slope(values: NDArray[Any], dt: float) -> NDArray[np.float64]:
    """Rates of change of values (T, ...), a step every ``dt`` seconds: the slopes of least-squares
    lines through all of them, 1/s (...); 0 of one value alone.
    """
    values = np.asarray(values, np.float64)
    if len(values) < 2:
        return np.zeros(values.shape[1:])
    away = (np.arange(len(values)) - (len(values) - 1) / 2.0) * dt
    return np.asarray(np.tensordot(away, values, axes=1) / (away @ away))
