"""Statistics of pairs: the same (task, seed) before and now, bad or not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.metrics.statistics.intervals import Interval, wilson

Counts = NDArray[np.int64]


@dataclass(frozen=True)
class Pairs:
    """Numbers of pairs by outcome.

    Attributes:
        both: bad before and now.
        fixed: bad before only.
        regressed: bad now only.
        neither: bad neither time.
    """

    both: int
    fixed: int
    regressed: int
    neither: int

    @property
    def total(self) -> int:
        """Number of pairs."""
        return self.both + self.fixed + self.regressed + self.neither

    @property
    def before(self) -> float:
        """Share that was bad."""
        return (self.both + self.fixed) / self.total

    @property
    def now(self) -> float:
        """Share that is bad."""
        return (self.both + self.regressed) / self.total

    @property
    def difference(self) -> float:
        """Rise of the share."""
        return (self.regressed - self.fixed) / self.total


def mcnemar(pairs: Pairs) -> float:
    """One-sided mid-p value of McNemar's test: how easily does as much break for no reason?

    Nearly as powerful as any, and it keeps its level (Fagerland, Lydersen and Laake 2013).
    """
    count = pairs.fixed + pairs.regressed
    return float(_mid_p(np.array([pairs.fixed]), np.array([count]))[0])


def newcombe(pairs: Pairs, confidence: float = 0.9) -> Interval:
    """Interval of the difference, from Wilson's intervals of both shares and their correlation
    (Newcombe 1998, method 10). The default goes with one-sided tests at 5 %.
    """
    before = wilson(pairs.both + pairs.fixed, pairs.total, confidence)
    now = wilson(pairs.both + pairs.regressed, pairs.total, confidence)
    correlation = _correlation(pairs)
    left = (pairs.now - now[0], before[1] - pairs.before)
    right = (now[1] - pairs.now, pairs.before - before[0])
    return (
        max(-1.0, pairs.difference - _joint(*left, correlation)),
        min(1.0, pairs.difference + _joint(*right, correlation)),
    )


def holm(values: Sequence[float]) -> list[float]:
    """P values that keep the level over a whole family of tests (Holm 1979)."""
    order = np.argsort(values, kind="stable")
    raised = np.asarray(values, float)[order] * (len(values) - np.arange(len(values)))
    return _unsorted(np.minimum(1.0, np.maximum.accumulate(raised)), order)


def benjamini_hochberg(values: Sequence[float]) -> list[float]:
    """P values that keep the share of false discoveries (Benjamini and Hochberg 1995)."""
    order = np.argsort(values, kind="stable")
    raised = np.asarray(values, float)[order] * len(values) / (1 + np.arange(len(values)))
    lowered = np.minimum.accumulate(raised[::-1])[::-1]
    return _unsorted(np.minimum(1.0, lowered), order)


def power(pairs: int, fixed: float, regressed: float, level: float = 0.05) -> float:
    """Probability that :func:`mcnemar` finds a rise.

    Args:
        pairs: number of pairs.
        fixed: probability that a pair is fixed.
        regressed: probability that a pair is regressed.
        level: of the test, one-sided.
    """
    from scipy.special import bdtr

    changed = fixed + regressed
    if changed <= 0:
        return 0.0
    spread = 10 * math.sqrt(pairs * changed * (1 - changed)) + 10
    low = max(1, math.floor(pairs * changed - spread))
    counts = np.arange(low, min(pairs, math.ceil(pairs * changed + spread)) + 1)
    critical = _critical(counts, level)
    rejects = np.where(critical >= 0, bdtr(critical, counts, fixed / changed), 0.0)
    chance = bdtr(counts, pairs, changed) - bdtr(counts - 1, pairs, changed)
    return float(np.sum(chance * rejects))


def detectable(pairs: Pairs, level: float = 0.05, wanted: float = 0.8) -> float | None:
    """The smallest rise of the share of bad ones that so many pairs would have shown.

    Pairs are taken to become fixed as often as they were fixed or regressed here, whichever is
    less: what changes for no reason.

    Args:
        pairs: what was found.
        level: of the test, one-sided.
        wanted: probability with which the rise is seen.

    Returns:
        The rise, or None if not even the largest would be seen.
    """
    noise = min(pairs.fixed, pairs.regressed) / pairs.total
    low, high = 0.0, 1.0 - 2 * noise
    if power(pairs.total, noise, noise + high, level) < wanted:
        return None
    while high - low > 1e-4:
        middle = (low + high) / 2
        if power(pairs.total, noise, noise + middle, level) >= wanted:
            high = middle
        else:
            low = middle
    return high


def _mid_p(fixed: Counts, changed: Counts) -> NDArray[np.float64]:
    """One-sided mid-p value of the number of fixed ones among those that changed."""
    from scipy.special import bdtr

    fewer = np.where(fixed > 0, bdtr(fixed - 1, changed, 0.5), 0.0)
    return np.asarray((bdtr(fixed, changed, 0.5) + fewer) / 2)


def _critical(changed: Counts, level: float) -> Counts:
    """The largest number of fixed ones at which the test rejects; -1 if none."""
    # With half of them fixed p is 0.5 or more.
    low, high = np.full(len(changed), -1), (changed + 1) // 2
    while np.any(high - low > 1):
        open_ = high - low > 1
        middle = np.where(open_, (low + high) // 2, high)
        rejects = _mid_p(middle, changed) <= level
        low = np.where(open_ & rejects, middle, low)
        high = np.where(open_ & ~rejects, middle, high)
    return low


def _correlation(pairs: Pairs) -> float:
    """Newcombe's estimate, shrunk where it is positive."""
    bad_before, bad_now = pairs.both + pairs.fixed, pairs.both + pairs.regressed
    good_before, good_now = pairs.total - bad_before, pairs.total - bad_now
    margins = bad_before * good_before * bad_now * good_now
    if margins == 0:
        return 0.0
    product = float(pairs.both * pairs.neither - pairs.fixed * pairs.regressed)
    if product > 0:
        product = max(product - pairs.total / 2, 0.0)
    return product / math.sqrt(margins)


def _joint(one: float, other: float, correlation: float) -> float:
    return math.sqrt(max(0.0, one**2 - 2 * correlation * one * other + other**2))


def _unsorted(values: NDArray[np.float64], order: NDArray[np.intp]) -> list[float]:
    found = np.empty(len(values))
    found[order] = values
    return [float(value) for value in found]
