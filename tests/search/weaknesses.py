"""Ten policies for the bench that are safe but in a combination of circumstances: then the thing is
let go half out of the cabinet.

The nearer a combination is, the shorter of its place the thing is put, which is safe yet; where all
of it is there, too short. Under plain seeds none of it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pytest_safemanip.search.dimension import Dimensions
from pytest_safemanip.search.trials import Trial
from tests.search.bench import LEVER
from tests.search.trying import Tries, dimensions_of
from tests.search.workers import Habits, Worker

TASK, PROPERTY = "PutAway", "enclosure_release"
SHORT, TOO_SHORT = 0.06, 0.055
"""How much shorter a thing is put while the combination comes nearer, and once it is there, m."""


@dataclass(frozen=True)
class Weakness:
    """What a policy is weak in.

    Attributes:
        name: of it.
        causes: dimensions of the space of the bench, with the size that it takes (cm or degrees),
            or the choice.
    """

    name: str
    causes: dict[str, float | str]

    def near(self, seen):
        """How near each of its causes is, from 0 to 1."""
        return [self._near(name, wanted, seen) for name, wanted in self.causes.items()]

    def _near(self, name, wanted, seen):
        if name == "category":
            return float(seen.category == wanted)
        there = {
            "forward": 100.0 * seen.forward,
            "left": 100.0 * seen.left,
            "turn": np.degrees(seen.turn),
            "posture": np.degrees(seen.hand / LEVER),
        }[name]
        return float(np.clip(there / wanted, 0.0, 1.0))

    @property
    def dimensions(self):
        """The space of the bench without what stands in the way: there every policy is weak."""
        return Dimensions(tuple(d for d in dimensions_of(TASK).own if d.name != "clutter"))

    def tries(self):
        """Runs trials of a policy that has it."""
        return Tries(TASK, self.worker, (PROPERTY,), self.dimensions)

    def worker(self):
        """A policy that has it."""
        weakness = self

        class Weak(Worker):
            def habits(self, seen):
                near = weakness.near(seen)
                short = SHORT * np.mean(near) + TOO_SHORT * (min(near) == 1.0)
                return Habits(put=np.array((0.0, -short, 0.0)))

        return Weak()


WEAK = (
    Weakness("left and turned", {"left": 8.0, "turn": 12.0, "posture": 1.5}),
    Weakness("a candle near and left", {"forward": -8.0, "left": 8.0, "category": "candle"}),
    Weakness("jam far and right", {"category": "jam", "left": -8.0, "forward": 7.0}),
    Weakness("a candle far and turned", {"category": "candle", "turn": -12.0, "forward": 7.0}),
    Weakness("jam turned and left", {"category": "jam", "turn": 12.0, "left": 6.5}),
    Weakness("askew and right", {"posture": 2.8, "left": -8.0, "turn": 8.0}),
    Weakness("far, right and turned", {"forward": 7.0, "left": -7.0, "turn": 8.0}),
    Weakness("jam near and askew", {"category": "jam", "posture": 2.8, "forward": -9.0}),
    Weakness("a candle askew and turned", {"category": "candle", "posture": 3.2, "turn": -12.0}),
    Weakness("far left and turned", {"left": 9.0, "turn": -12.0}),
)


def attempts(weakness, budget, batch):
    """What tries one proposer: the number of rollouts to the first violation, or None."""

    def attempt(make, seed):
        tries = weakness.tries()
        proposer = make(tries.dimensions, seed)
        for done in range(0, budget, batch):
            for number, deviation in enumerate(proposer.ask(batch), start=done + 1):
                outcome = tries(Trial(0, deviation))
                if outcome.violates(PROPERTY):
                    return number
                found = outcome.findings.get(PROPERTY)
                proposer.tell(deviation, found.loss if found else None)
        return None

    return attempt
