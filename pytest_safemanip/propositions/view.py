"""A trace as propositions see it: every value computed once, whole or step by step."""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable, Mapping
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TraceError
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.definition import Bools, Proposition
from pytest_safemanip.trace.trace import Trace

Array = NDArray[Any]
A = TypeVar("A", bound=Array)
T = TypeVar("T")
P = ParamSpec("P")


class View:
    """A trace, whole; each (proposition, arguments) is evaluated once.

    Args:
        trace: what happened.
        binding: which entities play which part.
        parameters: values of all parameters.
        catalogue: the propositions by name.

    Attributes:
        since: first step whose value is asked for; a proposition may leave out earlier ones.
        until: one after the last such step, likewise.
    """

    since = 0
    until: int

    def __init__(
        self,
        trace: Trace,
        binding: Binding,
        parameters: Mapping[str, float],
        catalogue: Mapping[str, Proposition],
    ) -> None:
        self.trace, self.until = trace, len(trace)
        self.binding = binding
        self.parameters = parameters
        self._catalogue = catalogue
        self._values: dict[tuple[str, ...], Bools] = {}
        self._known: dict[Hashable, Any] = {}

    def __call__(self, name: str, *arguments: str) -> Bools:
        """Truth values of a proposition (T,).

        Raises:
            TraceError: if an argument is no entity of the scene, or the evaluation is malformed.
        """
        key = (name, *arguments)
        if key not in self._values:
            proposition = self._catalogue[name]
            check_call(proposition, arguments, self.trace.scene.entity)
            self._values[key] = self.evaluate(proposition, arguments)
        return self._values[key]

    def part(self, name: str, *arguments: str, first: int, stop: int) -> Bools:
        """Truth values of a proposition at steps ``first`` to ``stop - 1`` (K,).

        Raises:
            TraceError: as for a call.
        """
        proposition = self._catalogue[name]
        if not proposition.sparse or (name, *arguments) in self._values:
            return self(name, *arguments)[first:stop]
        check_call(proposition, arguments, self.trace.scene.entity)
        before, self.since, self.until = (self.since, self.until), first, stop
        found = self.evaluate(proposition, arguments)[first:stop]
        self.since, self.until = before
        return found

    def pointwise(self, compute: Callable[..., A], *arguments: Hashable) -> A:
        """What :func:`pointwise` decorates, computed once (T, ...)."""
        found = self._once(compute, arguments, lambda: compute(self, *arguments))
        found.flags.writeable = False  # it is shared
        return found

    def own(self, compute: Callable[..., T], *arguments: Hashable) -> T:
        """What depends on the steps of this view, of any type, computed once for it."""
        return self._once(compute, ("own", *arguments), lambda: compute(self, *arguments))

    def fold(self, start: Callable[[View], Fold]) -> Array:
        """What a fold gives after each step (T, ...)."""
        return self._once(start, (), lambda: start(self).advance(self))

    def shared(self, compute: Callable[..., T], *arguments: Hashable) -> T:
        """What depends on scene, binding and parameters alone, computed once."""
        return self._once(compute, ("shared", *arguments), lambda: compute(self, *arguments))

    def evidence(self, name: str, arguments: tuple[str, ...], step: int) -> list[str]:
        """What was measured for a proposition at a step, in words."""
        describe = self._catalogue[name].evidence
        return describe(self, *arguments, step=step) if describe else []

    def evaluate(self, proposition: Proposition, arguments: tuple[str, ...]) -> Bools:
        """Truth values of a proposition (T,), computed now.

        Raises:
            TraceError: if the definition gives anything else.
        """
        values = np.asarray(proposition.evaluate(self, *arguments))
        if values.dtype != np.bool_ or values.shape != (len(self.trace),):
            raise TraceError(
                f"{proposition.name}: evaluated to {values.dtype}{values.shape}, "
                f"expected bool({len(self.trace)},)"
            )
        if proposition.act:
            values = values & ~self.trace.steps.tail
        return values

    def _once(self, compute: Hashable, arguments: Hashable, run: Callable[[], T]) -> T:
        key = (compute, arguments)
        if key not in self._known:
            self._known[key] = run()
        found: T = self._known[key]
        return found


class Fold(Protocol):
    """A memory without a window: what it knows after a step follows from what it knew before."""

    def advance(self, view: View) -> Array:
        """Take in the steps of a view, which follow those taken in before; what is known after
        each of them (T, ...).
        """


def pointwise(
    compute: Callable[Concatenate[View, P], A],
) -> Callable[Concatenate[View, P], A]:
    """A function of a view whose value (T, ...) at a step depends on that step alone.

    Step by step it is computed for the newest step only. Its arguments are hashable.
    """

    def looked_up(view: View, /, *arguments: P.args, **named: P.kwargs) -> A:
        return view.pointwise(compute, *arguments, *named.values())

    functools.update_wrapper(looked_up, compute)
    return looked_up


def check_call(
    proposition: Proposition, arguments: tuple[str, ...], entities: Mapping[str, object]
) -> None:
    """Refuse arguments that a proposition cannot have.

    Raises:
        TraceError: if their number is wrong, or one is no entity of the scene.
    """
    if len(arguments) != len(proposition.arguments):
        raise TraceError(
            f"{proposition.name}: {len(arguments)} arguments, expected {len(proposition.arguments)}"
        )
    for kind, value in zip(proposition.arguments, arguments, strict=True):
        if kind != "skill" and value not in entities:
            raise TraceError(f"{proposition.name}: unknown entity {value!r}")
