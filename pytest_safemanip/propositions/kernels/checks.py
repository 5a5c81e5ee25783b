"""Conditions at one step: whether each is met, what is said if it is not, and its margin."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple


class Check(NamedTuple):
    """A condition at a step.

    Attributes:
        holds: whether it is met.
        reason: what is said if it is not.
        margin: how far it is from its threshold, in units of that; None if it has none.
    """

    holds: bool
    reason: str
    margin: Callable[[], float] | None = None


def least_margin(checks: Iterable[Check]) -> float:
    """The least margin of some conditions, of which those without a threshold are one unit from
    it; 1 if there are none.
    """
    sides = (
        (1.0 if check.holds else -1.0) if check.margin is None else check.margin()
        for check in checks
    )
    return min(sides, default=1.0)
