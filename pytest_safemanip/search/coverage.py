"""What a search has looked at, and the smallest disturbance that a policy did not survive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.search.dimension import Deviation, Dimension, Dimensions
from pytest_safemanip.search.search import Pursuit
from pytest_safemanip.search.trials import Outcome, Trial
from pytest_safemanip.search.units import quantity

REGIONS = 8
"""Equal parts of a dimension that are counted in."""


@dataclass(frozen=True)
class Looked:
    """How often a dimension was otherwise, and where.

    Attributes:
        dimension: its name.
        unit: of its limits; empty where it has choices.
        regions: of each part from the least size to the largest how many trials were in it, or of
            each choice.
        limits: of the dimension; both 0 where it has choices.
    """

    dimension: str
    unit: str
    regions: Mapping[str, int]
    limits: tuple[float, float]


def looked_at(dimensions: Dimensions, tried: Sequence[tuple[Trial, Outcome]]) -> list[Looked]:
    """The regions that were looked at: trials that could not be begun saw nothing."""
    seen = [trial.deviation for trial, outcome in tried if not outcome.refused]
    return [_looked(dimension, seen) for dimension in dimensions.own]


def _looked(dimension: Dimension, seen: Sequence[Deviation]) -> Looked:
    sizes = [own.size for deviation in seen if (own := deviation.get(dimension.name)) is not None]
    if dimension.choices:
        counts = {choice: sizes.count(choice) for choice in dimension.choices}
        return Looked(dimension.name, "", counts, (0.0, 0.0))
    limits = dimension.low, dimension.high
    numbers = [size for size in sizes if isinstance(size, float)]
    counted, edges = np.histogram(numbers, bins=REGIONS, range=limits)
    regions = {
        f"{low:g} to {high:g}": int(count)
        for low, high, count in zip(edges[:-1], edges[1:], counted, strict=True)
    }
    return Looked(dimension.name, dimension.kind.unit, regions, limits)


@dataclass(frozen=True)
class Tolerance:
    """The smallest size of a dimension that a policy was not seen to survive.

    The size is that of the smallest failure, with all else that it takes; so a policy may survive
    more of it alone. What it is, lies between two sizes, as bisection has tried no others.

    Attributes:
        dimension: its name.
        unit: of the sizes.
        survived: the largest size below ``failed`` that was survived, all else being the same; 0
            if none was. Where nothing fails, the largest size of any trial that triggered the
            property and kept it.
        failed: the size of the failure; None where none has this dimension.
    """

    dimension: str
    unit: str
    survived: float
    failed: float | None

    @property
    def quantity(self) -> str:
        """What it is a size of: ``length``, ``angle``, ``time``, ``impulse``, ``share``."""
        return quantity(self.unit)


def tolerances(
    dimensions: Dimensions, pursuit: Pursuit, tried: Sequence[tuple[Trial, Outcome]]
) -> list[Tolerance]:
    """That of each dimension with a size that was looked at, in the order of the space."""
    found = []
    for dimension in dimensions.own:
        if dimension.choices:
            continue
        own = _tolerance(dimension, pursuit, tried)
        if own is not None:
            found.append(own)
    return found


def _tolerance(
    dimension: Dimension, pursuit: Pursuit, tried: Sequence[tuple[Trial, Outcome]]
) -> Tolerance | None:
    name, unit, failure = dimension.name, dimension.kind.unit, pursuit.failure
    setting = failure.deviation.get(name) if failure is not None else None
    satisfied = [
        trial
        for trial, outcome in tried
        if pursuit.looks_into(trial) and outcome.satisfies(pursuit.property_id)
    ]
    if failure is not None and not failure.deviation and not satisfied:
        return Tolerance(name, unit, 0.0, 0.0)
    if failure is None or setting is None:
        sizes = [abs(own.amount) for trial in satisfied if (own := trial.deviation.get(name))]
        return Tolerance(name, unit, max(sizes), None) if sizes else None
    rest = failure.deviation.without([name])
    below = [
        abs(own.amount)
        for trial in satisfied
        if trial.seed == failure.seed
        and trial.deviation.without([name]) == rest
        and (own := trial.deviation.get(name)) is not None
        and own.amount * setting.amount > 0.0
        and abs(own.amount) < abs(setting.amount)
    ]
    return Tolerance(name, unit, max(below, default=0.0), abs(setting.amount))
