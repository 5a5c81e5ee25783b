"""Intervals for shares: of rollouts, or of the time of a rollout."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from statistics import NormalDist

Interval = tuple[float, float]
"""Lower and upper bound, both in [0, 1]."""

MIN_TASKS = 5
"""Tasks with hits (and with misses) that an estimate of the spread needs."""


def wilson(hits: float, total: float, confidence: float = 0.95) -> Interval:
    """Wilson's score interval (Wilson 1927): for these tasks, not for new ones.

    Args:
        hits: number of hits. For a mean of values in [0, 1] their sum: nothing in [0, 1] varies
            more than hits and misses with the same mean; the interval is rather too wide.
        total: number of trials, above 0.
        confidence: two-sided.
    """
    return _score(hits, total, NormalDist().inv_cdf(0.5 + confidence / 2))


def clustered(
    tasks: Sequence[tuple[float, int]], confidence: float = 0.95, grown: float = 1.0
) -> Interval | None:
    """Wilson's interval for new tasks like these: tasks, not rollouts, are what was drawn.

    The variance of the share is that of a ratio between tasks; it gives the number of independent
    rollouts that would say as much, at most the number that was run, and Student's t takes the
    place of the normal quantile (Korn and Graubard 1998; Dean and Pagano 2015). With hits or
    misses in fewer than :data:`MIN_TASKS` tasks, a task says no more than one rollout.

    Args:
        tasks: hits and trials of each.
        confidence: two-sided.
        grown: what it would be with this many times as many tasks.

    Returns:
        The bounds, or None with less than two tasks that have a trial.
    """
    found = [(hits, total) for hits, total in tasks if total]
    count = len(found)
    if count < 2:
        return None
    hits, total = (sum(column) for column in zip(*found, strict=True))
    share = hits / total
    spread = sum((h - share * n) ** 2 for h, n in found) * count / (count - 1) / total**2
    effective = min(share * (1 - share) / spread, total) if spread > 0 else float(total)
    telling = min(sum(h > 0 for h, _ in found), sum(h < n for h, n in found))
    if telling < MIN_TASKS:
        effective = min(effective, count)
        quantile = NormalDist().inv_cdf(0.5 + confidence / 2)
    else:
        from scipy.special import stdtrit  # only where it is needed: importing it takes a while

        quantile = float(stdtrit(count * grown - 1, 0.5 + confidence / 2))
    effective *= grown
    return _score(share * effective, effective, quantile)


def below(total: int, confidence: float = 0.95) -> float:
    """What a rate is below after this many trials without a hit, one-sided (Clopper and Pearson
    1934); about 3 / ``total`` at 95 %, the rule of three.
    """
    return float(1 - (1 - confidence) ** (1 / total))


def anytime(hits: float, total: int, level: float = 0.05) -> Interval:
    """An interval that holds at all times at once: it may be looked at after every trial.

    The values at which the likelihood ratio of a uniform mixture stays below 1 / ``level`` (Robbins
    1970). It holds for hits with one probability; after complete rounds over trials with different
    probabilities it holds for their mean, and for means of values in [0, 1], by the inequality
    between arithmetic and geometric means.

    Args:
        hits: number of hits, or the sum of values in [0, 1].
        total: number of trials; 0 gives [0, 1].
        level: probability that it ever misses, at most.
    """
    if not total:
        return 0.0, 1.0
    share, limit = hits / total, -math.log(level)

    def outside(value: float) -> bool:
        return evidence(hits, total, value) > limit

    low = _edge(outside, 0.0, share) if share > 0 else 0.0
    high = _edge(outside, 1.0, share) if share < 1 else 1.0
    return low, high


def evidence(hits: float, total: float, value: float) -> float:
    """Logarithm of the mixture's likelihood ratio against a share of ``value``."""
    misses = total - hits
    mixture = math.lgamma(hits + 1) + math.lgamma(misses + 1) - math.lgamma(total + 2)
    if (hits and value <= 0) or (misses and value >= 1):
        return math.inf
    likelihood = (hits * math.log(value) if hits else 0.0) + (
        misses * math.log1p(-value) if misses else 0.0
    )
    return mixture - likelihood


def _score(hits: float, total: float, quantile: float) -> Interval:
    share, weight = hits / total, quantile * quantile / total
    centre = (share + weight / 2) / (1 + weight)
    spread = quantile / (1 + weight) * math.sqrt(share * (1 - share) / total + weight / (4 * total))
    # Without a hit the lower bound is 0, with nothing but hits the upper one is 1: no rounding.
    return min(share, max(0.0, centre - spread)), max(share, min(1.0, centre + spread))


def _edge(outside: Callable[[float], bool], far: float, near: float) -> float:
    """The bound between a value outside the interval and one inside, by bisection."""
    if not outside(far):
        return far
    for _ in range(60):
        middle = (far + near) / 2
        far, near = (middle, near) if outside(middle) else (far, middle)
    return far
