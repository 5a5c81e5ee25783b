"""Early warning: violations that are near, before they happen."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from pytest_safemanip.errors import judging
from pytest_safemanip.ltlf.robustness.prediction import Atoms, Prediction
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.propositions.forecasts import Told
from pytest_safemanip.propositions.online import Call, Online
from pytest_safemanip.spec.properties import Property

HORIZON = 0.25
"""Seconds before the last chance at which a violation is near; see docs/warnings.md for others."""


def checked_seconds(name: str, value: object) -> float:
    """A number from 0 up, inf included: where it is NaN or negative nothing would ever be near.

    Raises:
        ValueError: if it is none; names it.
    """
    if isinstance(value, bool) or not isinstance(value, Real) or not float(value) >= 0.0:
        raise ValueError(f"{name}: expected a number from 0 up, found {value!r}")
    return float(value)


@dataclass(frozen=True)
class EarlyWarning:
    """A violation that is near.

    Attributes:
        property_id: what will be violated.
        entities: for which of its instances.
        time_to_violation: seconds until a step is unsafe.
        last_chance: seconds until the robot can no longer prevent it: of what physics has to meet,
            until it is left to physics.
        atoms: what changes until then, the one that decides when last; none where it has happened,
            or only time has to pass.
        margin: of that one, in units of its threshold; None if it has none.
        rate: at which its margin changes, 1/s; None likewise.
    """

    property_id: str
    entities: tuple[str, ...]
    time_to_violation: float
    last_chance: float
    atoms: tuple[str, ...] = ()
    margin: float | None = None
    rate: float | None = None

    def __str__(self) -> str:
        about = f" for {', '.join(self.entities)}" if self.entities else ""
        changes = f": {', '.join(self.atoms)}" if self.atoms else ""
        return (
            f"{self.property_id}{about} in {self.time_to_violation:.2f} s, to be prevented within "
            f"{self.last_chance:.2f} s{changes}"
        )


class Predicts(Protocol):
    """A monitor that says what is expected of its instances."""

    def predict(self, order: Sequence[int], atoms: Sequence[Atoms]) -> list[Prediction]:
        """See :class:`~pytest_safemanip.ltlf.Monitor`."""


class Lookout:
    """Warnings from what monitors and propositions expect.

    Args:
        online: evaluates the propositions.
        properties: the properties.
        rows: entities of the instances of each.
        calls: what the atoms of each instance stand for.
        knows: whether the value of a proposition is known; None if all are. Of what is not known
            no change is expected.
    """

    def __init__(
        self,
        online: Online,
        properties: Iterable[Property],
        rows: Mapping[str, Sequence[tuple[str, ...]]],
        calls: Mapping[str, Sequence[Sequence[Call]]],
        knows: Callable[[Call], bool] | None = None,
    ) -> None:
        self._online, self._rows, self._calls, self._knows = online, rows, calls, knows
        self._atoms = {prop.id: tuple(prop.atoms) for prop in properties}
        self._order = {name: self._cheapest_first(of[0]) for name, of in calls.items()}

    def warnings(
        self, monitors: Mapping[str, Predicts], commands: ArrayLike, pace: float, horizon: float
    ) -> list[EarlyWarning]:
        """What is near, the most urgent first; see :class:`~pytest_safemanip.live.LiveJudge`."""
        horizon = checked_seconds("horizon", horizon)
        told = Told(np.asarray(commands, float), checked_seconds("pace", pace))
        grippers = self._online.scene.grippers
        if told.commands.shape != (len(grippers),):
            raise ValueError(
                f"commands: expected one for each gripper ({len(grippers)},), "
                f"found {told.commands.shape}"
            )
        if not np.isfinite(told.commands).all():
            raise ValueError(f"commands: expected finite numbers, found {told.commands.tolist()}")
        now, found = _Now(self._online, told, self._knows), list[EarlyWarning]()
        for name, monitor in monitors.items():
            atoms = [_Atoms(now, calls) for calls in self._calls[name]]
            with judging(name):
                for row, one in enumerate(monitor.predict(self._order[name], atoms)):
                    if one.last_chance <= horizon and one.last_chance < math.inf:
                        found.append(self._warning(name, row, one))
        return sorted(found, key=lambda one: (one.last_chance, one.time_to_violation))

    def _warning(self, name: str, row: int, one: Prediction) -> EarlyWarning:
        margin = rate = None
        if one.atoms:
            call = self._calls[name][row][one.atoms[-1]]
            if self._proposition(call).margin is not None:
                margin, rate = self._online.rate(call)
        atoms = tuple(self._atoms[name][k] for k in one.atoms)
        entities = self._rows[name][row]
        return EarlyWarning(name, entities, one.violation, one.last_chance, atoms, margin, rate)

    def _cheapest_first(self, calls: Sequence[Call]) -> list[int]:
        return sorted(range(len(calls)), key=lambda k: self._cost(calls[k]))

    def _cost(self, call: Call) -> int:
        """Margins look at more than forecasts do; what has neither is not expected to change."""
        proposition = self._proposition(call)
        return int(proposition.forecast is None and proposition.margin is not None)

    def _proposition(self, call: Call) -> Proposition:
        return self._online.catalogue[call[0]]


class _Now:
    """Values and expected changes of propositions after a step, each looked up once.

    Args:
        online: evaluates them.
        told: what the robot is told for the next step.
        knows: see :class:`Lookout`.
    """

    def __init__(self, online: Online, told: Told, knows: Callable[[Call], bool] | None) -> None:
        self._online, self._told, self._knows = online, told, knows
        self._values: dict[Call, bool] = {}
        self._changes: dict[Call, float] = {}

    def value(self, call: Call) -> bool:
        if call not in self._values:
            proposition = self._online.catalogue[call[0]]
            edge = proposition.act and proposition.margin is None
            self._values[call] = not edge and bool(self._online.values(call, 1)[-1])
        return self._values[call]

    def change(self, call: Call) -> float:
        if call not in self._changes:
            known = self._knows is None or self._knows(call)
            self._changes[call] = self._online.change(call, self._told) if known else math.inf
        return self._changes[call]


class _Atoms:
    """The atoms of an instance.

    Args:
        now: knows the propositions.
        calls: what the atoms stand for.
    """

    def __init__(self, now: _Now, calls: Sequence[Call]) -> None:
        self._now, self._calls = now, calls

    def value(self, atom: int) -> bool:
        return self._now.value(self._calls[atom])

    def change(self, atom: int) -> float:
        return self._now.change(self._calls[atom])


def soonest(names: Iterable[str], warnings: Iterable[EarlyWarning]) -> dict[str, float]:
    """Seconds until each property is expected to be violated; inf where nothing points to it."""
    found = dict.fromkeys(names, math.inf)
    for one in warnings:
        found[one.property_id] = min(found[one.property_id], one.time_to_violation)
    return found
