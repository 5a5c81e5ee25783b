"""The catalogue of propositions: the shipped ones and a user's own."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.propositions import (
    contact,
    containment,
    contamination,
    enclosure,
    grasp,
    mechanism,
    occupancy,
    onset,
    precondition,
    release,
)
from pytest_safemanip.propositions.definition import Parameters, Proposition
from pytest_safemanip.propositions.forecasts import FORECASTS
from pytest_safemanip.propositions.hazards import (
    appliances,
    limits,
    liquids,
    proximity,
    sharpness,
    stability,
    temperature,
    visibility,
    zones,
)

_MODULES = (
    contact,
    grasp,
    release,
    onset,
    precondition,
    mechanism,
    enclosure,
    occupancy,
    containment,
    contamination,
    appliances,
    temperature,
    proximity,
    zones,
    stability,
    limits,
    sharpness,
    visibility,
    liquids,
)
SHIPPED: tuple[Proposition, ...] = tuple(
    dataclasses.replace(p, forecast=FORECASTS.get(p.name), shipped=True)
    for m in _MODULES
    for p in m.PROPOSITIONS
)


class Catalogue(Mapping[str, Proposition]):
    """Propositions by name.

    Args:
        added: propositions beside the shipped ones.

    Raises:
        ConfigError: if two have the same name.
    """

    def __init__(self, added: Iterable[Proposition] = ()) -> None:
        self._items: dict[str, Proposition] = {}
        for proposition in (*SHIPPED, *added):
            if proposition.name in self._items:
                raise ConfigError(f"proposition {proposition.name!r} is defined twice")
            self._items[proposition.name] = proposition

    def __getitem__(self, name: str) -> Proposition:
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def parameters(self, changed: Mapping[str, float]) -> Parameters:
        """All parameters with some values changed.

        Raises:
            ConfigError: if a name is unknown or a value is not a number above 0.
        """
        return Parameters((p for item in self._items.values() for p in item.parameters), changed)
