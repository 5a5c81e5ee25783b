"""The catalogue of propositions: the shipped ones and a user's own."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Iterator, Mapping

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
from pytest_safemanip.propositions.definition import (
    Parameter,
    Parameters,
    Proposition,
    check_value,
)
from pytest_safemanip.propositions.forecasts import FORECASTS
from pytest_safemanip.propositions.grounding import check_definition
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
        ConfigError: if two have the same name, or a definition is wrong; names it.
    """

    def __init__(self, added: Iterable[Proposition] = ()) -> None:
        own = tuple(added)
        self._items: dict[str, Proposition] = {}
        for proposition in (*SHIPPED, *own):
            if not isinstance(proposition, Proposition):
                raise ConfigError(f"expected a Proposition, found {proposition!r}")
            if proposition.name in self._items:
                raise ConfigError(f"proposition {proposition.name!r} is defined twice")
            self._items[proposition.name] = proposition
        known = {p.name: (p, shipped) for shipped in SHIPPED for p in shipped.parameters}
        for proposition in own:
            check_definition(proposition)
            _check_parameters(proposition, known, {one.name for one in own})

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
        items = self._items.values()
        values = Parameters((p for item in items for p in item.parameters), changed)
        for item in items:
            item.seconds(values)
        return values


def _check_parameters(
    proposition: Proposition,
    known: dict[str, tuple[Parameter, Proposition]],
    own: Collection[str],
) -> None:
    """Refuse parameters of a user's proposition that are not its own, nor shared as they are.

    Args:
        proposition: the user's.
        known: the parameters there are, with who has them; the proposition's are added.
        own: names of the user's propositions.

    Raises:
        ConfigError: naming the parameter, the proposition and its place.
    """
    about = f"{proposition.place}: proposition {proposition.name!r}"
    given: object = proposition.parameters
    if not isinstance(given, tuple) or not all(isinstance(one, Parameter) for one in given):
        raise ConfigError(f"{about}: parameters: expected a tuple of them, found {given!r}")
    names = [parameter.name for parameter in proposition.parameters]
    for parameter in proposition.parameters:
        name = parameter.name
        if names.count(name) > 1:
            raise ConfigError(f"{about}: two parameters {name!r}")
        try:
            check_value(name, parameter.default)
        except (ConfigError, TypeError) as error:
            raise ConfigError(f"{about}: {error}") from None
        other, owner = known.setdefault(name, (parameter, proposition))
        if (other.default, other.unit) != (parameter.default, parameter.unit):
            raise ConfigError(
                f"{about}: parameter {name!r} is {_quantity(parameter)} here and "
                f"{_quantity(other)} in proposition {owner.name!r}; name yours "
                f"'{proposition.name}.{name.partition('.')[2] or name}'"
            )
        if owner is proposition and name.partition(".")[0] not in own:
            raise ConfigError(
                f"{about}: parameter {name!r} belongs to none of your propositions; name it "
                f"'{proposition.name}.{name.rpartition('.')[2]}'"
            )


def _quantity(parameter: Parameter) -> str:
    return f"{parameter.default:g} {parameter.unit}".strip()
