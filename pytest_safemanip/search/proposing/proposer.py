"""Proposers, and deviations as points of a cube, for those that know nothing else."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.search.dimension import Deviation, Dimension, Dimensions
from pytest_safemanip.search.kinds.definition import Setting

Point = NDArray[np.float64]
"""Numbers in [0, 1]: for each dimension one that says whether it is otherwise and by how much, and
its details."""
SHARE = 0.6
"""Of the dimensions that is otherwise in a point drawn uniformly, on average."""


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
    return sum(1 + len(dimension.details) for dimension in dimensions.own)


def parts(dimensions: Dimensions) -> Iterator[tuple[Dimension, slice]]:
    """Where in a point each dimension is: its size first, then its details."""
    place = 0
    for dimension in dimensions.own:
        end = place + 1 + len(dimension.details)
        yield dimension, slice(place, end)
        place = end


def decoded(point: Point, dimensions: Dimensions) -> Deviation:
    """The deviation of a point."""
    found = []
    for dimension, place in parts(dimensions):
        own = point[place]
        setting = _setting(dimension, float(own[0]), own[1:])
        if setting is not None:
            found.append((dimension.name, setting))
    return Deviation(tuple(found))


def _setting(dimension: Dimension, part: float, details: Point) -> Setting | None:
    """The value of a dimension at a part of the way through it; None in the middle, or below."""
    if dimension.choices or dimension.low == 0.0:
        more = (part - (1.0 - SHARE)) / SHARE
        return dimension.setting(min(more, 1.0 - 1e-9), details) if more >= 0.0 else None
    away = 2.0 * part - 1.0
    more = (abs(away) - (1.0 - SHARE)) / SHARE
    if more < 0.0:
        return None
    size = more * (dimension.high if away > 0.0 else dimension.low)
    return dimension.setting((size - dimension.low) / (dimension.high - dimension.low), details)


def encoded(deviation: Deviation, dimensions: Dimensions) -> Point:
    """A point of a deviation: the inverse of :func:`decoded`, with the middle for what it does not
    say.
    """
    point = np.full(width(dimensions), 0.5)
    for dimension, place in parts(dimensions):
        setting = deviation.get(dimension.name)
        known = dict(setting.details) if setting else {}
        point[place.start] = _part(dimension, setting)
        for number, (name, (low, high)) in enumerate(dimension.details.items(), place.start + 1):
            if name in known:
                point[number] = (known[name] - low) / (high - low)
    return np.clip(point, 0.0, 1.0)


def _part(dimension: Dimension, setting: Setting | None) -> float:
    """The inverse of :func:`_setting`."""
    one_sided = bool(dimension.choices) or dimension.low == 0.0
    if setting is None:
        return 0.5 * (1.0 - SHARE) if one_sided else 0.5
    if isinstance(setting.size, str):
        return chosen_part(dimension.choices, setting.size)
    more = abs(setting.size) / (dimension.high if setting.size > 0.0 else -dimension.low)
    if one_sided:
        return 1.0 - SHARE + SHARE * more
    return 0.5 + 0.5 * float(np.sign(setting.size)) * (1.0 - SHARE + SHARE * more)


def chosen_part(choices: tuple[str, ...], chosen: str) -> float:
    """The number of a point that stands for one of some choices."""
    return 1.0 - SHARE + SHARE * (choices.index(chosen) + 0.5) / len(choices)
