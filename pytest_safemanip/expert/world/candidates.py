"""Candidates for a motion, the likeliest first, and the ones among them whose way is free."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.expert.robot.arm import Arm, NoWay, SkillFailed
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.ways import Leg, Permits, foresee

LOOKS, ENOUGH = 50, 20
"""Ways that the simulator is asked about for one choice at most, and where there is one to a
candidate from which it is not free to the end."""
DOUBTS = 6
"""Candidates from which it is not free to the end, after so many of which no other is looked for.
"""
OPTIONS = 12
"""Of a choice between free ways."""
AT_ONCE = 150
"""Candidates that are looked at more closely at a time."""
ALIKE, THERE = 1.5, 0.4
"""What is like a candidate that was looked at is less likely to bring anything, by this cost; where
the hand did not get on from where the base took it, the way there makes so much less of a
difference."""


class Candidates:
    """What may be tried, in an order that each look changes.

    Args:
        cost: of each candidate: 1 is a good reason against it (N,).
        features: what they differ in, in units of what makes a difference (N, K).
        own: how many of the features, the first ones, are not those of the way there.
        drives: which drives a way begins with, by number: what cannot be driven is not tried again
            (N,).
        refine: what some candidates, by number (M,), cost more than that (M,).
    """

    def __init__(
        self,
        cost: Array,
        features: Array,
        own: int,
        drives: Array,
        refine: Callable[[NDArray[np.intp]], Array],
    ) -> None:
        self._cost, self._features, self._own = cost.copy(), features, own
        self._drives, self._refine = drives, refine
        self._known: set[int] = set()
        self._free: list[int] = []
        self._looks, self._far, self._reason = 0, -1, "there is none"
        self.ends: dict[int, int] = {}
        """How far on it is free from candidates from which it is not free to the end."""

    def free(
        self,
        number: int,
        arm: Arm,
        way: Callable[[int], tuple[Sequence[Leg], float]],
        permits: Permits,
        goal: str,
        then: Callable[[int], int | None] | None = None,
    ) -> int:
        """The candidate to which the number-th free way leads.

        Args:
            number: from 0.
            arm: the arm, in the same state each time.
            way: to a candidate, and the opening of the fingers on it.
            permits: touches that do not count.
            goal: where it leads, for the error.
            then: how far on it is free from a candidate where it is not free to the end: those from
                which it is come first, then those from which it is farthest.

        Raises:
            SkillFailed: if there are no so many.
            NoWay: if there is none; says what is in the way that comes farthest.
        """
        while len(self._free) <= number:
            doubtful = [one for one in self.ends if one not in self._free]
            looks = ENOUGH if doubtful else LOOKS
            goes_on = self._looks < looks and len(doubtful) < DOUBTS
            best = self._best() if goes_on else None
            if best is None and doubtful:
                self._free.append(max(doubtful, key=self.ends.__getitem__))
                continue
            if best is None:
                if self._free:
                    raise SkillFailed(f"the ways to {goal} are all in vain")
                raise NoWay(f"no way to {goal}: {self._reason}")
            self._looks += 1
            legs, opening = way(best)
            answer = foresee(arm, legs, permits, opening)
            last = max((n for n, leg in enumerate(legs) if len(leg.point) == 2), default=-1)
            ends = then(best) if then and answer.free else None
            if answer.free and ends is None:
                self._free.append(best)
            elif ends is not None:
                self.ends[best] = ends
            apart = self._features - self._features[best]
            if ends is not None or (not answer.free and answer.waypoint > last):
                apart[:, self._own :] *= THERE
            apart = np.linalg.norm(apart, axis=1)
            self._cost += ALIKE * np.exp(-(apart**2))
            self._cost[best] = np.inf
            if all(len(leg.point) == 2 for leg in legs[: answer.waypoint + 1]):
                self._cost[self._drives == self._drives[best]] = np.inf
            if not answer.free and answer.waypoint > self._far:
                self._far, self._reason = answer.waypoint, answer.reason
        return self._free[number]

    def _best(self) -> int | None:
        """The likeliest one; None if nothing is left."""
        while np.isfinite(self._cost.min(initial=np.inf)):
            best = int(np.argmin(self._cost))
            if best in self._known:
                return best
            order = np.argsort(self._cost)[: 3 * AT_ONCE].tolist()
            new = [n for n in order if n not in self._known][:AT_ONCE]
            self._known.update(new)
            self._cost[new] += self._refine(np.array(new))
        return None
