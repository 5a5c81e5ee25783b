"""One dimension of a space, and what a deviation is: a value for some of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from pytest_safemanip.search.kinds.definition import Kind, Named, Setting
from pytest_safemanip.search.situation import Situation
from pytest_safemanip.search.units import rounded


@dataclass(frozen=True)
class Dimension:
    """Something that may be otherwise, and by how much.

    Attributes:
        name: unique in a space.
        kind: what it changes.
        about: what it is about, by key.
        low: least size, at most 0, in the kind's unit.
        high: largest size, at least 0.
        choices: what is chosen from; none if it has sizes.
        price: the size that costs 1; of a choice its price.
        step: size that it is reduced by at least.
        details: limits of its other numbers.
    """

    name: str
    kind: Kind
    about: Mapping[str, str]
    low: float = 0.0
    high: float = 0.0
    choices: tuple[str, ...] = ()
    price: float = 1.0
    step: float = 0.0
    details: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def cost(self, setting: Setting) -> float:
        """The price of a value: of a size in proportion to it."""
        return self.price if isinstance(setting.size, str) else abs(setting.size) / self.price

    def on_grid(self, steps: float) -> float:
        """The size of so many steps, of either sign, within the limits."""
        return rounded(min(max(steps * self.step, self.low), self.high))

    def steps(self, size: float) -> int:
        """How many steps of the grid a size is from 0, rounded up."""
        return math.ceil(abs(size) / self.step - 1e-9)

    def setting(self, size: float, details: Iterable[float]) -> Setting | None:
        """The value at some place between its limits, on its grid; None if that is nothing.

        Args:
            size: from 0 to 1: between the least and the largest size, or which of the choices.
            details: likewise, in their order.
        """
        known = tuple(
            (name, rounded(round(_between(limits, part) / own.step) * own.step))
            for (name, own), limits, part in zip(
                self.kind.details.items(), self.details.values(), details, strict=True
            )
        )
        if self.choices:
            chosen = min(int(size * len(self.choices)), len(self.choices) - 1)
            return Setting(self.choices[chosen], known)
        steps = round(_between((self.low, self.high), size) / self.step)
        return Setting(self.on_grid(steps), known) if steps else None


def _between(limits: tuple[float, float], part: float) -> float:
    return limits[0] + part * (limits[1] - limits[0])


@dataclass(frozen=True)
class Deviation:
    """Values of some dimensions; the others are as they would be.

    Attributes:
        settings: by dimensions' names, in the order of the space.
    """

    settings: tuple[tuple[str, Setting], ...] = ()

    def __iter__(self) -> Iterator[str]:
        return iter(self._by_name)

    def __len__(self) -> int:
        return len(self.settings)

    def __getitem__(self, name: str) -> Setting:
        return self._by_name[name]

    def get(self, name: str) -> Setting | None:
        """The value of a dimension, if it has one."""
        return self._by_name.get(name)

    @cached_property
    def _by_name(self) -> dict[str, Setting]:
        return dict(self.settings)

    def without(self, names: Iterable[str]) -> Deviation:
        """Without the values of some dimensions."""
        left_out = set(names)
        return Deviation(tuple(item for item in self.settings if item[0] not in left_out))

    def only(self, names: Iterable[str]) -> Deviation:
        """With the values of some dimensions alone."""
        kept = set(names)
        return Deviation(tuple(item for item in self.settings if item[0] in kept))

    def replaced(self, name: str, setting: Setting) -> Deviation:
        """With another value of a dimension that it has."""
        return Deviation(
            tuple((own, setting if own == name else old) for own, old in self.settings)
        )


NOTHING = Deviation()
"""The deviation of an episode as it would be."""


@dataclass(frozen=True)
class Dimensions:
    """The dimensions of a space that a task, a backend and a policy have, in their order.

    Attributes:
        own: by name.
    """

    own: tuple[Dimension, ...]

    @cached_property
    def by_name(self) -> dict[str, Dimension]:
        """By name."""
        return {dimension.name: dimension for dimension in self.own}

    def situation(self, deviation: Deviation) -> Situation:
        """What an episode has otherwise with a deviation."""
        situation = Situation()
        for name, setting in deviation.settings:
            dimension = self.by_name[name]
            situation = dimension.kind.apply(situation, dimension.about, setting)
        return situation

    def enlarged(self, deviation: Deviation, factor: float) -> Deviation:
        """A deviation with larger sizes, within the limits; choices stay."""
        return Deviation(
            tuple(
                (name, setting)
                if isinstance(setting.size, str)
                else (name, replace(setting, size=self._enlarged(name, factor * setting.size)))
                for name, setting in deviation.settings
            )
        )

    def _enlarged(self, name: str, size: float) -> float:
        dimension = self.by_name[name]
        return dimension.on_grid(round(size / dimension.step))

    def price(self, deviation: Deviation) -> float:
        """The sum of the prices of its values."""
        return sum(self.by_name[name].cost(own) for name, own in deviation.settings)

    def say(self, deviation: Deviation, named: Named) -> str:
        """What a deviation means, after "when"; empty for none.

        Args:
            deviation: some values.
            named: what people call what plays a role.
        """
        said = [
            self.by_name[name].kind.say(self.by_name[name].about, own, named)
            for name, own in deviation.settings
        ]
        return " and ".join([", ".join(said[:-1]), said[-1]] if len(said) > 1 else said)
