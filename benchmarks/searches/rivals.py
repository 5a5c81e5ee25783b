"""Other maintained optimisers as proposers, for `search.py`; not part of the package.

pip install cmaes nevergrad
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from pytest_safemanip.search.dimension import Deviation, Dimensions
from pytest_safemanip.search.proposing.proposer import MakeProposer, decoded, width

LOST = 1e6


class Evolution:
    """CMA-ES, by cmaes, on the cube."""

    def __init__(self, dimensions: Dimensions, seed: int) -> None:
        import cmaes

        size = width(dimensions)
        self._dimensions = dimensions
        self._waiting: list[tuple[Deviation, Any]] = []
        self._told: list[tuple[Any, float]] = []
        self._optimiser = cmaes.CMA(
            np.full(size, 0.5), 0.3, np.tile((0.0, 1.0), (size, 1)), seed=seed + 1
        )

    def ask(self, count: int) -> list[Deviation]:
        """See `Proposer`."""
        points = [self._optimiser.ask() for _ in range(count)]
        found = [decoded(point, self._dimensions) for point in points]
        self._waiting += zip(found, points, strict=True)
        return found

    def tell(self, deviation: Deviation, loss: float | None) -> None:
        """See `Proposer`; what was proposed elsewhere is of no use to it."""
        own = next((pair for pair in self._waiting if pair[0] == deviation), None)
        if own is None:
            return
        self._waiting.remove(own)
        self._told.append((own[1], LOST if loss is None else loss))
        size = self._optimiser.population_size
        if len(self._told) >= size:
            self._optimiser.tell(self._told[:size])
            self._told = self._told[size:]


class Nevergrad:
    """One of Nevergrad's, on the cube."""

    def __init__(self, dimensions: Dimensions, seed: int, name: str) -> None:
        import nevergrad

        space = nevergrad.p.Array(shape=(width(dimensions),), lower=0.0, upper=1.0)
        space.random_state.seed(seed)
        self._optimiser = nevergrad.optimizers.registry[name](space, budget=200, num_workers=8)
        self._dimensions = dimensions
        self._waiting: list[tuple[Deviation, Any]] = []

    def ask(self, count: int) -> list[Deviation]:
        """See `Proposer`."""
        asked = [self._optimiser.ask() for _ in range(count)]
        found = [decoded(own.value, self._dimensions) for own in asked]
        self._waiting += zip(found, asked, strict=True)
        return found

    def tell(self, deviation: Deviation, loss: float | None) -> None:
        """See `Proposer`."""
        own = next((pair for pair in self._waiting if pair[0] == deviation), None)
        if own is not None:
            self._waiting.remove(own)
            self._optimiser.tell(own[1], LOST if loss is None else loss)


class Targeted:
    """Hypothesis's ``target``: hill climbing on what it generates. It cannot be asked, only run, so
    a search of it is run in a thread that waits for each answer.
    """

    def __init__(self, dimensions: Dimensions, seed: int) -> None:
        import queue
        import threading

        self._dimensions, self._size = dimensions, width(dimensions)
        self._asked: queue.Queue[Deviation | None] = queue.Queue()
        self._answers: queue.Queue[float] = queue.Queue()
        threading.Thread(target=self._run, args=(seed,), daemon=True).start()

    def _run(self, number: int) -> None:
        from hypothesis import HealthCheck, Phase, given, seed, settings, strategies, target

        numbers = strategies.lists(
            strategies.floats(0.0, 1.0), min_size=self._size, max_size=self._size
        )

        @seed(number)
        @settings(
            max_examples=400,
            database=None,
            deadline=None,
            phases=(Phase.generate, Phase.target),
            suppress_health_check=list(HealthCheck),
        )
        @given(numbers)
        def test(point: list[float]) -> None:
            self._asked.put(decoded(np.array(point), self._dimensions))
            loss = self._answers.get()
            if math.isfinite(loss):
                target(-loss)

        test()
        self._asked.put(None)

    def ask(self, count: int) -> list[Deviation]:
        """One at a time, which is kinder to it than a search is; see `Proposer`."""
        found = self._asked.get(timeout=60)
        return [found] if found is not None else []

    def tell(self, deviation: Deviation, loss: float | None) -> None:
        """See `Proposer`."""
        self._answers.put(LOST if loss is None else loss)


def _found() -> dict[str, MakeProposer]:
    rivals: dict[str, MakeProposer] = {}
    if importlib.util.find_spec("cmaes"):
        rivals["CMA-ES (cmaes)"] = Evolution
    if importlib.util.find_spec("nevergrad"):
        for name in ("TwoPointsDE", "NGOpt", "OnePlusOne"):
            rivals[f"{name} (Nevergrad)"] = partial(Nevergrad, name=name)
    if importlib.util.find_spec("hypothesis"):
        rivals["target (Hypothesis)"] = Targeted
    return rivals


RIVALS: Mapping[str, MakeProposer] = _found()
