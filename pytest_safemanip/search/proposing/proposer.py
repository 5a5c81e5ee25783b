"""Proposers, and deviations as points of a cube, for those that know nothing else."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.search.dimension import Deviation, Dimension, Dimensions
from pytest_safemanip.search.kinds.definition import Setting

Point = NDArray[np.float64]
"""Numbers in [0, 1): for each dimension one that says whether it is otherwise, one that says by
how much, and its details."""


class Proposer(Protocol):
    """Proposes what to try, and learns what came of it.

    What it proposes depends on its seed and on what it is told, in this order, and on nothing else.
    """

    def ask(self, count: int) -> list[Deviation]:
        """The next ones to try, side by side."""

    def tell(self, deviation: Deviation, loss: float | None) -> None:
        """What came of one, whether it was proposed here or elsewhere: its loss, see
        :attr:`~pytest_safemanip.search.trials.Finding.loss`; None where there is no such episode.
        """


MakeProposer = Callable[[Dimensions, int], Proposer]
"""Makes a proposer of some dimensions, with a seed."""


def width(dimensions: Dimensions) -> int:
    """Length of a point."""
    return sum(2 + len(dimension.details) for dimension in dimensions.own)


def decoded(point: Point, dimensions: Dimensions, share: float) -> Deviation:
    """The deviation of a point.

    Args:
        point: see :data:`Point`.
        dimensions: of the space.
        share: of the dimensions that is otherwise in a point drawn uniformly, on average.
    """
    found, place = [], 0
    for dimension in dimensions.own:
        own = point[place : place + 2 + len(dimension.details)]
        place += len(own)
        if own[0] >= share:
            continue
        setting = dimension.setting(own[1], own[2:])
        if setting is not None:
            found.append((dimension.name, setting))
    return Deviation(tuple(found))


def encoded(deviation: Deviation, dimensions: Dimensions, share: float) -> Point:
    """A point of a deviation: the inverse of :func:`decoded`, with the middle for what it does not
    say.
    """
    point: list[float] = []
    for dimension in dimensions.own:
        setting = deviation.get(dimension.name)
        point.append(0.5 * share if setting is not None else 0.5 * (1.0 + share))
        point.append(0.5 if setting is None else _part(dimension, setting))
        known: Mapping[str, float] = dict(setting.details) if setting else {}
        for name, (low, high) in dimension.details.items():
            point.append((known[name] - low) / (high - low) if name in known else 0.5)
    return np.clip(np.array(point), 0.0, np.nextafter(1.0, 0.0))


def _part(dimension: Dimension, setting: Setting) -> float:
    if isinstance(setting.size, str):
        return (dimension.choices.index(setting.size) + 0.5) / len(dimension.choices)
    return (setting.size - dimension.low) / (dimension.high - dimension.low)
