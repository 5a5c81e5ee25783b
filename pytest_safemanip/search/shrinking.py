"""Reducing a deviation that fails to as few and as small changes as still fail.

Values are left out one by one, the dearest first, and in halves where there are many (delta
debugging, Zeller and Hildebrandt 2002); those that are left are brought nearer to nothing by
bisection on the grid of their dimension, as if whatever fails with less failed with more. Last,
each is left out while the others are somewhat larger: few changes are easier to understand than
small ones.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

from pytest_safemanip.search.dimension import Deviation, Dimensions

MANY = 4
"""Values from which on halves are tried first."""

LARGER = 1.3
"""How much larger others may be where one value is left out."""

Test = Generator[Deviation, bool, bool]
Answers = Generator[Deviation, bool, Deviation]
"""Asks whether a deviation fails, is sent the answer, and returns the smallest that does."""


class Spent(Exception):
    """There are no rollouts left."""


@dataclass
class Shrinker:
    """Reduces one deviation.

    Args:
        dimensions: of the space.
        budget: questions that it may ask.

    Attributes:
        kept: deviations that fail, each of fewer or smaller values than the one before.
    """

    dimensions: Dimensions
    budget: int

    def __post_init__(self) -> None:
        self.kept: list[Deviation] = []
        self._known: dict[Deviation, bool] = {}

    def reduce(self, deviation: Deviation) -> Answers:
        """Reduce a deviation that is known to fail."""
        self.kept = [deviation]
        self._known = {deviation: True}
        try:
            before = None
            while before != self.kept[-1]:
                before = self.kept[-1]
                yield from self._halve()
                yield from self._drop()
                yield from self._lessen()
                yield from self._exchange()
        except Spent:
            pass
        return self.kept[-1]

    def _fails(self, deviation: Deviation) -> Test:
        if deviation not in self._known:
            if self.budget <= 0:
                raise Spent
            self.budget -= 1
            self._known[deviation] = yield deviation
        if self._known[deviation]:
            self.kept.append(deviation)
        return self._known[deviation]

    def _by_price(self) -> list[str]:
        """The names of the values that are left, the dearest first."""
        by_name, now = self.dimensions.by_name, self.kept[-1]
        return sorted(now, key=lambda name: -by_name[name].cost(now[name]))

    def _halve(self) -> Generator[Deviation, bool, None]:
        """Keep one half of many values."""
        while len(self.kept[-1]) >= MANY:
            names = self._by_price()
            halves = names[::2], names[1::2]
            for half in halves:
                if (yield from self._fails(self.kept[-1].only(half))):
                    break
            else:
                return

    def _drop(self) -> Generator[Deviation, bool, None]:
        """Leave out what is not needed."""
        for name in self._by_price():
            if len(self.kept[-1]) > 1:
                yield from self._fails(self.kept[-1].without([name]))

    def _lessen(self) -> Generator[Deviation, bool, None]:
        """Bring each value as near to nothing as it may be, on its grid."""
        for name in self._by_price():
            now, dimension = self.kept[-1], self.dimensions.by_name[name]
            size = now[name].size
            if isinstance(size, str):
                continue
            sign, low, high = (1 if size > 0 else -1), 0, dimension.steps(size)
            while high - low > 1:
                middle = (low + high) // 2
                less = self._sized(now, name, dimension.on_grid(sign * middle))
                if (yield from self._fails(less)):
                    high = middle
                else:
                    low = middle

    def _exchange(self) -> Generator[Deviation, bool, None]:
        """Leave one value out, the cheapest first, for larger sizes of the others."""
        for name in reversed(self._by_price()):
            others = self.kept[-1].without([name])
            if others and (yield from self._fails(self.dimensions.enlarged(others, LARGER))):
                return

    def _sized(self, deviation: Deviation, name: str, size: float) -> Deviation:
        return deviation.replaced(name, replace(deviation[name], size=size))
