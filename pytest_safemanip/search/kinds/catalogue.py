"""All kinds of dimensions: the shipped ones and the user's."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.search.kinds import actions, beginnings, senses
from pytest_safemanip.search.kinds.definition import Kind
from pytest_safemanip.search.units import UNITS

SHIPPED = (*beginnings.KINDS, *senses.KINDS, *actions.KINDS)


def _check_sizes(kind: Kind) -> None:
    """See whether a kind has a unit that is known, and sizes that can be tried.

    Raises:
        ConfigError: if it does not.
    """
    if not kind.unit:
        return
    if kind.unit not in UNITS:
        units = ", ".join(UNITS)
        raise ConfigError(f"kind {kind.name!r}: unknown unit {kind.unit!r}; known: {units}")
    for name in ("price", "step"):
        if not 0.0 < getattr(kind, name) < math.inf:
            raise ConfigError(f"kind {kind.name!r}: expected a {name} of more than 0")
    if not -math.inf < kind.low <= 0.0 <= kind.high < math.inf or kind.low == kind.high:
        raise ConfigError(f"kind {kind.name!r}: expected low <= 0 <= high, and not both 0")


class Kinds(Mapping[str, Kind]):
    """Kinds by name.

    Args:
        added: the user's.

    Raises:
        ConfigError: if one is none, has sizes that cannot be tried, or a name that is taken.
    """

    def __init__(self, added: Iterable[Kind] = ()) -> None:
        self._kinds = {kind.name: kind for kind in SHIPPED}
        for kind in added:
            if not isinstance(kind, Kind):
                raise ConfigError(
                    f"pytest_safemanip_dimensions gives a {type(kind).__name__}, expected "
                    "pytest_safemanip.search.kinds.definition.Kind"
                )
            if kind.name in self._kinds:
                raise ConfigError(f"dimensions of kind {kind.name!r} exist already; rename it")
            _check_sizes(kind)
            self._kinds[kind.name] = kind

    def __getitem__(self, name: str) -> Kind:
        return self._kinds[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._kinds)

    def __len__(self) -> int:
        return len(self._kinds)
