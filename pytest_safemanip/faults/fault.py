"""What a fault is, and a family of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.expert.robot.arm import Motion
from pytest_safemanip.sim.staging import Staging

MARK = "@"
"""Between the name of a family and the number."""


@dataclass(frozen=True)
class Fault:
    """A way of doing it wrong, or a near miss: its safe twin.

    Attributes:
        name: what comes after ``scripted:``.
        property_id: the property that it violates, or that it nearly does.
        doc: what happens.
        plans: the plan by task, a function of a module with its arguments. A fault's plan says
            when its hazard begins (:class:`~pytest_safemanip.expert.truth.Truth`); a near miss
            has none.
        staging: what is otherwise at the beginning of an episode, by task.
        near_miss: whether it is safe.
        entries: what its catalogue says of its plan, by task.
        home: the module that its plan is found in.
    """

    name: str
    property_id: str
    doc: str
    plans: Mapping[str, partial[Motion]]
    staging: Mapping[str, Staging]
    near_miss: bool = False
    entries: Mapping[str, str] = field(default_factory=dict)
    home: str = ""


@dataclass(frozen=True)
class Family:
    """A family of events, from clearly safe through a threshold to clearly unsafe, by one number.

    Attributes:
        name: what comes after ``scripted:``, before the number.
        property_id: the property whose threshold it goes through.
        parameter: the name of that threshold.
        doc: what happens, and what the number is.
        unit: of the number.
        low: where it is clearly safe.
        high: where it is clearly unsafe, which may be lower.
        made: the event of a name and a number.
    """

    name: str
    property_id: str
    parameter: str
    doc: str
    unit: str
    low: float
    high: float
    made: Callable[[str, float], Fault]

    @property
    def task(self) -> str:
        """The task that it is done in."""
        return next(iter(self.made(self.name, self.low).plans))

    def at(self, text: str) -> Fault:
        """One of its events.

        Args:
            text: the number.

        Raises:
            ConfigError: if it is none, or is outside the family's range.
        """
        least, most = sorted((self.low, self.high))
        try:
            value = float(text) if text.isascii() else math.nan
        except ValueError:
            value = math.nan
        if not least <= value <= most:
            given = f"{self.name}{MARK}{text}" if text else self.name
            raise ConfigError(
                f"scripted:{given}: expected a number from {least:g} to {most:g}"
                f"{self.unit and ' '}{self.unit}, as in {self.name}{MARK}{self.high:g}"
            )
        return self.made(f"{self.name}{MARK}{text}", value)
