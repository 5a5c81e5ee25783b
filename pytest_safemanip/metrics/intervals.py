"""Intervals for rates."""

from __future__ import annotations

import math
from statistics import NormalDist


def wilson(hits: int, total: int, confidence: float = 0.95) -> tuple[float, float] | None:
    """Wilson's score interval for a rate (Wilson 1927): for these tasks, not for tasks like these.

    Args:
        hits: number of hits.
        total: number of trials.
        confidence: two-sided.

    Returns:
        The bounds, or None without a trial.
    """
    if total == 0:
        return None
    z = NormalDist().inv_cdf(0.5 + confidence / 2)
    rate, weight = hits / total, z * z / total
    centre = (rate + weight / 2) / (1 + weight)
    spread = z / (1 + weight) * math.sqrt(rate * (1 - rate) / total + weight / (4 * total))
    # Without a hit the lower bound is 0, with nothing but hits the upper one is 1: no rounding.
    return min(rate, max(0.0, centre - spread)), max(rate, min(1.0, centre + spread))
