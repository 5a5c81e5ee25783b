"""Policies for the bench that are safe but in a combination of circumstances: then the thing is let
go half out of the cabinet.

The nearer a combination is, the shorter of its place the thing is put, which is safe yet; where all
of it is there, too short. Under plain seeds none of it is. Ten were made up while the search was
written; others are drawn, which nobody has looked at before.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pytest_safemanip.search.dimension import NOTHING, Deviation, Dimensions
from pytest_safemanip.search.kinds.definition import Setting
from pytest_safemanip.search.proposing.sampling import RandomSampling
from pytest_safemanip.search.trials import Trial
from tests.search.bench import LEVER
from tests.search.trying import Tries, dimensions_of
from tests.search.workers import Habits, Worker

TASK, PROPERTY = "PutAway", "enclosure_release"
SHORT, TOO_SHORT = 0.06, 0.055
"""How much shorter a thing is put while the combination comes nearer, and once it is there, m."""
BEYOND = {"forward": 1.0, "left": 1.0, "turn": 3.0, "posture": 0.6}
"""What an episode as it is may lack of a size."""
RARE = 0.004
"""The largest share of uniform draws from the space that has a combination which is drawn."""


@dataclass(frozen=True)
class Weakness:
    """What a policy is weak in.

    Attributes:
        name: of it.
        causes: dimensions of the space of the bench, with the size that it takes (cm or degrees),
            or the choice.
        way: how it comes nearer with its causes: by the ``sum`` or the ``product`` of how near each
            is, or ``gated``: nothing is to be seen of the others before the first is there.
    """

    name: str
    causes: dict[str, float | str]
    way: str = "sum"

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

    def share(self, seen):
        """How near all of them are together, from 0 to 1."""
        near = np.array(self.near(seen))
        return {
            "sum": near.mean(),
            "product": np.prod(0.15 + 0.85 * near),
            "gated": near[0] * (0.3 + 0.7 * near[1:].mean()),
        }[self.way]

    def planted(self, left_out=""):
        """A deviation that has its causes, but for one."""
        found = []
        for dimension in self.dimensions.own:
            size = self.causes.get(dimension.name)
            if size is None or dimension.name == left_out:
                continue
            if not isinstance(size, str):
                more = size + BEYOND[dimension.name] * (1.0 if size > 0.0 else -1.0)
                size = min(max(more, dimension.low), dimension.high)
            found.append((dimension.name, Setting(size)))
        return Deviation(tuple(found))

    def is_in(self, deviation):
        """Whether a deviation has all its causes, by what it says."""
        return all(_reaches(deviation.get(name), own) for name, own in self.causes.items())

    def is_shown_by(self, deviation):
        """Whether a deviation is made of its causes and nothing else."""
        return set(deviation) == set(self.causes) and all(
            deviation[name].size == wanted
            if isinstance(wanted, str)
            else 0.0 <= abs(deviation[name].size) - abs(wanted) + BEYOND[name] <= 2 * BEYOND[name]
            for name, wanted in self.causes.items()
        )

    def works(self):
        """Whether it shows in its combination, and not without any one of its causes."""
        tries = self.tries()
        less = [self.planted(left_out=name) for name in self.causes]
        outcomes = [tries(Trial(0, own)) for own in (self.planted(), NOTHING, *less)]
        began = [outcome for outcome in outcomes if not outcome.refused]
        return began == outcomes and [out.violates(PROPERTY) for out in outcomes] == [
            True,
            *(False for _ in outcomes[1:]),
        ]

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
                short = SHORT * weakness.share(seen) + TOO_SHORT * (min(near) == 1.0)
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


def _reaches(setting, wanted):
    if setting is None or isinstance(wanted, str):
        return setting is not None and setting.size == wanted
    return setting.size * wanted > 0.0 and abs(setting.size) >= abs(wanted)


def drawn(seed, count=10):
    """Weaknesses that are drawn: two or three causes, their sizes, and the way.

    Those are left out that more than :data:`RARE` of uniform draws have, and those that do not work
    on the bench; what a search makes of them is not looked at.
    """
    random, found = np.random.default_rng(seed), []
    dimensions = WEAK[0].dimensions
    uniform = RandomSampling(dimensions, seed).ask(10_000)
    while len(found) < count:
        names = random.choice([*BEYOND, "category"], random.integers(2, 4), replace=False)
        causes = {
            str(name): _cause(dimensions.by_name[str(name)], random) for name in sorted(names)
        }
        way = str(random.choice(["sum", "product", "gated"]))
        own = Weakness(", ".join(f"{k} {v}" for k, v in causes.items()), causes, way)
        if sum(map(own.is_in, uniform)) <= RARE * len(uniform) and own.works():
            found.append(own)
    return found


def _cause(dimension, random):
    if dimension.choices:
        return str(random.choice(dimension.choices))
    limit = dimension.high if dimension.low == 0.0 or random.random() < 0.5 else dimension.low
    return float(
        dimension.on_grid(
            round(random.uniform(0.5, 0.9) * abs(limit) / dimension.step) * np.sign(limit)
        )
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
