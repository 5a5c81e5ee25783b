"""What to try next by the main effects so far: what seems to lower the margin, at its limits.

A weakness needs much of a few things, and reducing comes later. A linear model of the loss, one
coefficient for each way of a dimension, is fitted to the ranks of all trials, since margins of
properties differ in scale; a draw from its posterior (Thompson 1933) says which few of them to set
to their limits, together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from pytest_safemanip.search.dimension import Deviation, Dimension, Dimensions
from pytest_safemanip.search.kinds.definition import Setting

FEWEST, MOST = 2, 6
"""Values of a deviation that is proposed."""
EFFECT, NOISE = 0.2, 0.2
"""How large an effect is thought to be before anything is known, and how far trials are off the
model, as shares of all ranks."""
Vector = NDArray[np.float64]


@dataclass(frozen=True)
class _Way:
    """A way in which a dimension may be otherwise: one of its choices, or up or down.

    Attributes:
        dimension: the dimension.
        part: of the way through it where it is at this limit, from 0 to 1.
        limit: the size, or the choice, there.
    """

    dimension: Dimension
    part: float
    limit: float | str

    def share(self, setting: Setting | None) -> float:
        """How far a value goes this way, from 0 to 1."""
        if setting is None:
            return 0.0
        if isinstance(self.limit, str):
            return float(setting.size == self.limit)
        return max(0.0, setting.amount / self.limit)


def _ways(dimension: Dimension) -> list[_Way]:
    count = len(dimension.choices)
    if count:
        return [_Way(dimension, (n + 0.5) / count, c) for n, c in enumerate(dimension.choices)]
    limits = ((1.0, dimension.high), (0.0, dimension.low))
    return [_Way(dimension, part, limit) for part, limit in limits if limit]


class MainEffects:
    """Proposes deviations of a few values at their limits.

    Args:
        dimensions: of the space.
        seed: of the draws.
    """

    def __init__(self, dimensions: Dimensions, seed: int) -> None:
        self._dimensions = dimensions
        self._ways = [way for own in dimensions.own for way in _ways(own)]
        self._random = np.random.default_rng(seed)
        self._shares: list[list[float]] = []
        self._losses: list[float] = []

    def ask(self, count: int) -> list[Deviation]:
        """See :class:`~pytest_safemanip.search.proposing.proposer.Proposer`."""
        shares = np.array(self._shares).reshape(-1, len(self._ways))
        ranks = rankdata(self._losses) / max(len(self._losses), 1) - 0.5
        # An effect is one against the mean of all trials.
        seen = shares - shares.mean(axis=0) if len(shares) else shares
        precision = seen.T @ seen / NOISE**2 + np.eye(len(self._ways)) / EFFECT**2
        mean = np.linalg.solve(precision, seen.T @ ranks / NOISE**2)
        spread = np.linalg.cholesky(np.linalg.inv(precision))
        draws = mean + self._random.normal(size=(count, len(mean))) @ spread.T
        return [self._lowest(draw) for draw in draws]

    def tell(self, deviation: Deviation, loss: float | None) -> None:
        """See :class:`~pytest_safemanip.search.proposing.proposer.Proposer`."""
        if loss is not None:
            self._losses.append(loss)
            own = [way.share(deviation.get(way.dimension.name)) for way in self._ways]
            self._shares.append(own)

    def _lowest(self, effects: Vector) -> Deviation:
        """The ways that lower the loss most, one of a dimension, at their limits."""
        most, found = self._random.integers(FEWEST, MOST + 1), dict[str, Setting]()
        for number in np.argsort(effects).tolist():
            way = self._ways[number]
            if len(found) == most or effects[number] >= 0.0:
                break
            details = self._random.random(len(way.dimension.details))
            setting = way.dimension.setting(way.part, details)
            if setting is not None:
                found.setdefault(way.dimension.name, setting)
        names = [own.name for own in self._dimensions.own if own.name in found]
        return Deviation(tuple((name, found[name]) for name in names))
