"""Plain sampling: at random, and by Sobol's sequence. Neither learns anything."""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from pytest_safemanip.search.dimension import Deviation, Dimensions
from pytest_safemanip.search.proposing.proposer import Point, decoded, width


class RandomSampling:
    """Draws deviations uniformly.

    Args:
        dimensions: of the space.
        seed: of the draws.
    """

    def __init__(self, dimensions: Dimensions, seed: int) -> None:
        self._dimensions = dimensions
        self._random = np.random.default_rng(seed)

    def ask(self, count: int) -> list[Deviation]:
        """See :class:`~pytest_safemanip.search.proposing.proposer.Proposer`."""
        points = self._random.random((count, width(self._dimensions)))
        return [decoded(point, self._dimensions) for point in points]

    def tell(self, deviation: Deviation, loss: float | None) -> None:
        """Learn nothing."""


class SobolSampling:
    """Fills the space evenly, by a scrambled Sobol sequence (Sobol 1967, Owen 1998).

    Args:
        dimensions: of the space.
        seed: of the scrambling.
    """

    def __init__(self, dimensions: Dimensions, seed: int) -> None:
        self._dimensions = dimensions
        self._sequence = qmc.Sobol(width(dimensions), scramble=True, seed=seed)

    def points(self, count: int) -> list[Point]:
        """The next points of the sequence."""
        # One by one: the sequence is the same, and no power of two is asked for.
        return [self._sequence.random(1)[0] for _ in range(count)]

    def ask(self, count: int) -> list[Deviation]:
        """See :class:`~pytest_safemanip.search.proposing.proposer.Proposer`."""
        return [decoded(point, self._dimensions) for point in self.points(count)]

    def tell(self, deviation: Deviation, loss: float | None) -> None:
        """Learn nothing."""
