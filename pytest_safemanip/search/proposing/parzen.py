"""What to try next by tree-structured Parzen estimators (Bergstra et al. 2011), as Optuna has them.

The first trials fill the space evenly. Those that come after are drawn where the better trials so
far are dense and the others are not, all dimensions together; but for six of each round. Four begin
from what came nearest to a violation: two carry it further, with larger sizes, two draw one of its
values anew, for where the better trials are alike nothing else leads away from them. Two set what
seems to lower the margin to its limits.
`benchmarks/searches/search.py` holds this against what else there is.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import numpy as np
import optuna
from optuna.distributions import BaseDistribution, CategoricalDistribution, FloatDistribution
from optuna.trial import FrozenTrial, TrialState, create_trial

from pytest_safemanip.search.dimension import Deviation, Dimensions
from pytest_safemanip.search.proposing.effects import MainEffects
from pytest_safemanip.search.proposing.proposer import (
    Point,
    chosen_part,
    decoded,
    encoded,
    parts,
)
from pytest_safemanip.search.proposing.sampling import SobolSampling

FURTHER = (1.3, 2.0)
"""How much larger the sizes of the best trial so far are tried."""
BEST = 8
"""Trials that are carried further, the best first."""
ALTERED, OF = 2, 3
"""How many of each round have one value drawn anew, and of how many of the best, in turns."""
AT_LIMITS = 2
"""How many of each round have what lowers the margin at its limits."""
FIRST = 32
"""Trials that fill the space evenly."""
WORST = 1e6
"""The loss of what cannot be begun: as bad as can be."""
NONE = "-"
"""The choice to leave something as it is."""


class ParzenEstimators:
    """Proposes by Optuna's TPE sampler.

    Args:
        dimensions: of the space.
        seed: of the draws.
    """

    def __init__(self, dimensions: Dimensions, seed: int) -> None:
        self._dimensions = dimensions
        self._even, self._left = SobolSampling(dimensions, seed), FIRST
        self._effects = MainEffects(dimensions, seed)
        self._nearest: list[tuple[float, int, Deviation]] = []
        self._carried: set[Deviation] = set()
        self._random, self._turn = np.random.default_rng(seed), 0
        self._told = 0
        self._known: Mapping[str, BaseDistribution] = dict(_distributions(dimensions))
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        with _experimental():
            sampler = optuna.samplers.TPESampler(
                seed=seed, multivariate=True, constant_liar=True, n_startup_trials=0
            )
            self._study = optuna.create_study(sampler=sampler)

    def ask(self, count: int) -> list[Deviation]:
        """See :class:`~pytest_safemanip.search.proposing.proposer.Proposer`."""
        even = min(count, self._left)
        self._left -= even
        found = self._even.ask(even)
        if even < count:
            guided = [*self._further(), *self._altered(), *self._effects.ask(AT_LIMITS)]
            found += guided[: count - even]
        with _experimental():
            asked = [self._study.ask(dict(self._known)) for _ in range(count - len(found))]
        for trial in asked:  # what comes of them is told with all else
            self._study.tell(trial, state=TrialState.FAIL)
        return found + [decoded(self._point(trial.params), self._dimensions) for trial in asked]

    def tell(self, deviation: Deviation, loss: float | None) -> None:
        """See :class:`~pytest_safemanip.search.proposing.proposer.Proposer`."""
        self._study.add_trial(self._trial(deviation, WORST if loss is None else loss))
        self._effects.tell(deviation, loss)
        self._told += 1
        if loss is not None and deviation:
            self._nearest = sorted([*self._nearest, (loss, self._told, deviation)])[:BEST]

    def _further(self) -> list[Deviation]:
        """The trials that came nearest to a violation, with larger sizes; each is tried once."""
        found: list[Deviation] = []
        for _, _, deviation in self._nearest:
            for factor in FURTHER:
                own = self._dimensions.enlarged(deviation, factor)
                if own not in self._carried and len(found) < len(FURTHER):
                    self._carried.add(own)
                    found.append(own)
        return found

    def _altered(self) -> list[Deviation]:
        """Those that came nearest to a violation, with one value drawn anew, or without it."""
        found: list[Deviation] = []
        places = [place for _, place in parts(self._dimensions)]
        for _ in range(ALTERED if self._nearest else 0):
            _, _, deviation = self._nearest[self._turn % min(OF, len(self._nearest))]
            self._turn += 1
            point = encoded(deviation, self._dimensions)
            place = places[self._random.integers(len(places))]
            point[place] = self._random.random(place.stop - place.start)
            found.append(decoded(point, self._dimensions))
        return found

    def _point(self, values: Mapping[str, float | str]) -> Point:
        point: list[float] = []
        for dimension, _ in parts(self._dimensions):
            size = values[dimension.name]
            point.append(_place(dimension.choices, size) if isinstance(size, str) else size)
            point += [float(values[f"{dimension.name}.{name}"]) for name in dimension.details]
        return np.array(point)

    def _trial(self, deviation: Deviation, loss: float) -> FrozenTrial:
        point, values = encoded(deviation, self._dimensions), {}
        for dimension, place in parts(self._dimensions):
            setting = deviation.get(dimension.name)
            chosen = setting.size if setting is not None else NONE
            own = point[place].tolist()
            values[dimension.name] = chosen if dimension.choices else own[0]
            for name, part in zip(dimension.details, own[1:], strict=True):
                values[f"{dimension.name}.{name}"] = part
        return create_trial(params=values, distributions=dict(self._known), value=loss)


def _distributions(dimensions: Dimensions) -> Iterator[tuple[str, BaseDistribution]]:
    for dimension in dimensions.own:
        choices = (NONE, *dimension.choices)
        yield (
            dimension.name,
            CategoricalDistribution(choices) if dimension.choices else FloatDistribution(0.0, 1.0),
        )
        for name in dimension.details:
            yield f"{dimension.name}.{name}", FloatDistribution(0.0, 1.0)


def _place(choices: tuple[str, ...], chosen: str) -> float:
    """The part of a point that stands for a choice."""
    return 0.0 if chosen == NONE else chosen_part(choices, chosen)


@contextmanager
def _experimental() -> Iterator[None]:
    """Sampling all dimensions together, and side by side, are marked so since 2020."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        yield
