"""What a proposition is: a causal truth value of finite window, with declared parameters."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, TraceError, did_you_mean
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.trace.steps import Trace

Bools = NDArray[np.bool_]
T = TypeVar("T")


@dataclass(frozen=True)
class Parameter:
    """A number that a proposition depends on.

    Attributes:
        name: ``proposition.quantity``.
        unit: SI unit; empty for a ratio.
        default: start value.
        reason: why this value.
    """

    name: str
    unit: str
    default: float
    reason: str


class Parameters(Mapping[str, float]):
    """The values of all parameters.

    Args:
        known: every parameter there is.
        changed: values that differ from the defaults, by name.

    Raises:
        ConfigError: if a name is unknown or a value is not a finite number above 0.
    """

    def __init__(self, known: Iterable[Parameter], changed: Mapping[str, float]) -> None:
        self._values = {p.name: p.default for p in known}
        for name, value in changed.items():
            if name not in self._values:
                hint = did_you_mean(name, self._values)
                raise ConfigError(f"unknown proposition parameter {name!r}; {hint}")
            if not np.isfinite(value) or value <= 0:
                raise ConfigError(f"parameter {name}: expected a number above 0, found {value}")
            self._values[name] = float(value)

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def digest(self) -> str:
        """Digest of all values, written into every result."""
        text = json.dumps(self._values, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Proposition:
    """A named truth value over time.

    Attributes:
        name: as properties refer to it.
        arguments: what each argument is: ``object``, ``fixture``, ``skill``, ``entity``, ``tool``.
        window: seconds that the value at a step looks back, given the parameters; infinite for
            contamination, which lasts. An act may be an edge, which looks back one step at least.
        parameters: the numbers it depends on.
        evaluate: truth values (T,) on a view, for given arguments. The value at a step depends on
            the steps of the window only.
        act: whether it is an act of the robot, which cannot happen in the settle tail.
        evidence: what was measured at a step, in words; may be empty.
        doc: the exact condition.
    """

    name: str
    arguments: tuple[str, ...]
    window: Callable[[Mapping[str, float]], float]
    parameters: tuple[Parameter, ...]
    evaluate: Callable[..., Bools]
    act: bool = False
    evidence: Callable[..., list[str]] | None = None

    @property
    def doc(self) -> str:
        """The exact condition, from the docstring of its function."""
        return (self.evaluate.__doc__ or "").strip()


class View:
    """A trace as propositions see it; each (proposition, arguments) is evaluated once.

    Args:
        trace: what happened.
        binding: which entities play which part.
        parameters: values of all parameters.
        catalogue: the propositions by name.
    """

    def __init__(
        self,
        trace: Trace,
        binding: Binding,
        parameters: Mapping[str, float],
        catalogue: Mapping[str, Proposition],
    ) -> None:
        self.trace = trace
        self.binding = binding
        self.parameters = parameters
        self._catalogue = catalogue
        self._values: dict[tuple[str, ...], Bools] = {}
        self._shared: dict[Callable[[View], Any], Any] = {}

    def __call__(self, name: str, *arguments: str) -> Bools:
        """Truth values of a proposition (T,).

        Raises:
            TraceError: if an argument is no entity of the scene, or the evaluation is malformed.
        """
        key = (name, *arguments)
        if key not in self._values:
            self._values[key] = self._evaluate(self._catalogue[name], arguments)
        return self._values[key]

    def shared(self, compute: Callable[[View], T]) -> T:
        """What several propositions are made from, computed once."""
        if compute not in self._shared:
            self._shared[compute] = compute(self)
        found: T = self._shared[compute]
        return found

    def evidence(self, name: str, arguments: tuple[str, ...], step: int) -> list[str]:
        """What was measured for a proposition at a step, in words."""
        describe = self._catalogue[name].evidence
        return describe(self, *arguments, step=step) if describe else []

    def _evaluate(self, proposition: Proposition, arguments: tuple[str, ...]) -> Bools:
        if len(arguments) != len(proposition.arguments):
            raise TraceError(
                f"{proposition.name}: {len(arguments)} arguments, "
                f"expected {len(proposition.arguments)}"
            )
        for kind, value in zip(proposition.arguments, arguments, strict=True):
            if kind != "skill" and value not in self.trace.scene.entity:
                raise TraceError(f"{proposition.name}: unknown entity {value!r}")
        values = np.asarray(proposition.evaluate(self, *arguments))
        if values.dtype != np.bool_ or values.shape != (len(self.trace),):
            raise TraceError(
                f"{proposition.name}: evaluated to {values.dtype}{values.shape}, "
                f"expected bool({len(self.trace)},)"
            )
        if proposition.act:
            values = values & ~self.trace.steps.tail
        return values
