"""The view of a trace on which propositions are evaluated; every value is computed once."""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable, Mapping
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TraceError
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.definition import (
    MARGIN_BOUND,
    MARGIN_ROUNDING,
    Bools,
    Excess,
    Floats,
    Proposition,
)
from pytest_safemanip.propositions.grounding import check_call, find
from pytest_safemanip.propositions.kernels.filters import held
from pytest_safemanip.propositions.settings import Settings, changed, split
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.trace import Trace

Array = NDArray[Any]
A = TypeVar("A", bound=Array)
T = TypeVar("T")
P = ParamSpec("P")


class View:
    """A trace, whole; each (proposition, arguments) is evaluated once, at all steps.

    Args:
        trace: what happened.
        binding: which entities play which part.
        parameters: values of all parameters.
        catalogue: the propositions by name.

    Attributes:
        since: first step whose value is asked for; a proposition may leave out earlier ones. 0
            except in what :meth:`narrowed` gives.
        until: one after the last such step, likewise; the trace's length except there.
    """

    def __init__(
        self,
        trace: Trace,
        binding: Binding,
        parameters: Mapping[str, float],
        catalogue: Mapping[str, Proposition],
    ) -> None:
        self.trace = trace
        self.since, self.until = 0, len(trace)
        self.binding = binding
        self.parameters = binding.parameters(parameters)
        self._catalogue = catalogue
        self._values: dict[tuple[str, ...], Bools] = {}
        self._margins: dict[tuple[str, ...], Floats] = {}
        self._known: dict[Hashable, Any] = {}
        self._with: dict[tuple[str, ...], View] = {}

    @property
    def first_step(self) -> int:
        """The number of the first step of the trace; 0 but while a rollout runs."""
        return 0

    def __call__(self, name: str, *arguments: str) -> Bools:
        """Truth values of a proposition (T,).

        Raises:
            TraceError: if an argument is no entity of the scene, or the evaluation is malformed.
        """
        key = (name, *arguments)
        if key not in self._values:
            proposition = find(self._catalogue, name)
            check_call(proposition, arguments, self.trace.scene, self.binding.zones)
            own, settings = split(proposition, arguments)
            view = self.setting(name, settings)
            self._values[key] = view(name, *own) if settings else self.evaluate(proposition, own)
        return self._values[key]

    def setting(self, name: str, settings: Settings) -> View:
        """This view with those parameters changed that a call of a proposition sets."""
        if not settings:
            return self
        key = (name, *settings)
        if key not in self._with:
            values = changed(self.parameters, self._catalogue[name], settings)
            self._with[key] = View(self.trace, self.binding, values, self._catalogue)
        return self._with[key]

    def part(self, name: str, *arguments: str, first: int, stop: int) -> Bools:
        """Truth values of a proposition at steps ``first`` to ``stop - 1`` (K,).

        Raises:
            TraceError: as for a call.
        """
        proposition = find(self._catalogue, name)
        if not proposition.sparse or (name, *arguments) in self._values:
            return self(name, *arguments)[first:stop]
        check_call(proposition, arguments, self.trace.scene, self.binding.zones)
        own, settings = split(proposition, arguments)
        if settings:
            return self.setting(name, settings).part(name, *own, first=first, stop=stop)
        return self.narrowed(first, stop).evaluate(proposition, own)[first:stop]

    def margin(self, name: str, *arguments: str) -> Floats:
        """Margins of a proposition (T,): how far it is from its threshold, in units of that,
        positive where it is true; of one that has none, :data:`MARGIN_BOUND` with the sign of its
        value.

        Raises:
            TraceError: as for a call.
        """
        key = (name, *arguments)
        if key not in self._margins:
            proposition = find(self._catalogue, name)
            check_call(proposition, arguments, self.trace.scene, self.binding.zones)
            own, settings = split(proposition, arguments)
            view = self.setting(name, settings)
            found = view.margin(name, *own) if settings else self.measured(proposition, own)
            self._margins[key] = found
        return self._margins[key]

    def margin_part(self, name: str, *arguments: str, first: int, stop: int) -> Floats:
        """Margins of a proposition at steps ``first`` to ``stop - 1`` (K,).

        Raises:
            TraceError: as for a call.
        """
        proposition = find(self._catalogue, name)
        if not proposition.sparse or (name, *arguments) in self._margins:
            return self.margin(name, *arguments)[first:stop]
        check_call(proposition, arguments, self.trace.scene, self.binding.zones)
        own, settings = split(proposition, arguments)
        if settings:
            return self.setting(name, settings).margin_part(name, *own, first=first, stop=stop)
        return self.narrowed(first, stop).measured(proposition, own)[first:stop]

    def has_margin(self, name: str) -> bool:
        """Whether a proposition has a margin of its own."""
        return self._catalogue[name].margin is not None

    def narrowed(self, first: int, stop: int) -> View:
        """This view for an evaluation at steps ``first`` to ``stop - 1`` only."""
        return _Narrowed(self, first, stop)

    def pointwise(self, compute: Callable[..., A], *arguments: Hashable) -> A:
        """The value of a :func:`pointwise` function (T, ...), computed once."""
        found = self._once(compute, arguments, lambda: compute(self, *arguments))
        found.flags.writeable = False  # it is shared
        return found

    def looking_back(self, seconds: float, compute: Callable[..., A], *arguments: Hashable) -> A:
        """The value of a function (T, ...) that looks back so many seconds at each step, computed
        once; also for what asks for it and looks back less, or without end.
        """
        return self._once(compute, arguments, lambda: compute(self, *arguments))

    def own(self, compute: Callable[..., T], *arguments: Hashable) -> T:
        """A value of any type that depends on the steps of this view, computed once for it."""
        return self._once(compute, ("own", *arguments), lambda: compute(self, *arguments))

    def fold(self, start: Callable[[View], Fold]) -> Array:
        """The result of a fold after each step (T, ...)."""
        return self._once(start, (), lambda: start(self).advance(self))

    def shared(self, compute: Callable[..., T], *arguments: Hashable) -> T:
        """A value that depends on scene, binding and parameters alone, computed once."""
        return self._once(compute, ("shared", *arguments), lambda: compute(self, *arguments))

    def cache(self, kind: Callable[[Scene], T]) -> T:
        """A cache, one of a kind for the whole rollout; made from the scene, empty, at first.

        It is filled while steps are evaluated. It may save time; no value may depend on what is in
        it, nor so on which steps were evaluated before.
        """
        found: T = self.shared(_new_cache, kind)
        return found

    def evidence(self, name: str, arguments: tuple[str, ...], step: int) -> list[str]:
        """The evidence of a proposition at a step, in words."""
        proposition = self._catalogue[name]
        own, settings = split(proposition, arguments)
        if proposition.evidence is None:
            return []
        return proposition.run(proposition.evidence, own, self.setting(name, settings), step=step)

    def excess(self, name: str, arguments: tuple[str, ...], first: int, last: int) -> Excess | None:
        """The hardest contact behind a proposition that is beyond its limit at some steps."""
        proposition = self._catalogue[name]
        own, settings = split(proposition, arguments)
        if proposition.excess is None:
            return None
        view = self.setting(name, settings)
        return proposition.run(proposition.excess, own, view, first=first, last=last)

    def evaluate(self, proposition: Proposition, arguments: tuple[str, ...]) -> Bools:
        """Truth values of a proposition (T,), computed now.

        Raises:
            TraceError: if the definition gives anything else.
        """
        values = np.asarray(proposition.run(proposition.evaluate, arguments, self))
        if values.dtype != np.bool_ or values.shape != (len(self.trace),):
            raise TraceError(
                f"{proposition.name}: evaluated to {values.dtype}{values.shape}, "
                f"expected bool({len(self.trace)},)"
            )
        if proposition.act and values.any():
            values = values & ~self._acts_over(proposition)
        return values

    def measured(self, proposition: Proposition, arguments: tuple[str, ...]) -> Floats:
        """As :meth:`measure`, with a user's margins held against the values that they are of.

        Raises:
            TraceError: likewise, or where one is on the wrong side.
        """
        found = self.measure(proposition, arguments)
        if proposition.margin is None or proposition.shipped or "margin" in proposition.exempt:
            return found
        if proposition.sparse:
            values = self.evaluate(proposition, arguments)
        else:
            values = self(proposition.name, *arguments)
        asked = slice(self.since, self.until)
        wrong = wrong_side(values[asked], found[asked])
        if len(wrong):
            step = self.since + int(wrong[0])
            call = f"{proposition.name}({', '.join(arguments)})" if arguments else proposition.name
            raise TraceError(
                f"{call}: {bool(values[step])} at step {self.first_step + step}, but its margin "
                f"there is {found[step]:g}; margins are positive where it is true and negative "
                "where it is false: turn the sign, or leave 'margin' out"
            )
        return found

    def measure(self, proposition: Proposition, arguments: tuple[str, ...]) -> Floats:
        """Margins of a proposition (T,), computed now.

        Raises:
            TraceError: if the definition gives anything else.
        """
        if proposition.margin is None:
            if proposition.sparse:
                values = self.evaluate(proposition, arguments)
            else:
                values = self(proposition.name, *arguments)
            return np.where(values, MARGIN_BOUND, -MARGIN_BOUND)
        found = np.asarray(proposition.run(proposition.margin, arguments, self))
        if found.dtype.kind != "f" or found.shape != (len(self.trace),):
            raise TraceError(
                f"{proposition.name}: its margin is {found.dtype}{found.shape}, "
                f"expected float64({len(self.trace)},)"
            )
        if np.isnan(found).any():
            raise TraceError(f"{proposition.name}: its margin is NaN at step {found.argmax()}")
        if proposition.act:
            found = np.where(self._acts_over(proposition), np.minimum(found, -1.0), found)
        return np.clip(found, -MARGIN_BOUND, MARGIN_BOUND).astype(np.float64, copy=False)

    def _acts_over(self, proposition: Proposition) -> Bools:
        """Where an act of the robot is over, since the settle tail has begun (T,)."""
        # A vote over its contacts shows what was done half of it later.
        vote = proposition.debounce
        late = self.trace.count(vote(self.parameters)) // 2 if vote else 0
        return held(self.trace.steps.tail, 1 + late)

    def _once(self, compute: Hashable, arguments: Hashable, run: Callable[[], T]) -> T:
        key = (compute, arguments)
        if key not in self._known:
            self._known[key] = run()
        found: T = self._known[key]
        return found


class _Narrowed(View):
    """A view whose values are needed at some steps only.

    It remembers nothing: all that is looked up through it is looked up in the view that it is made
    from, at all steps.
    """

    def __init__(self, whole: View, first: int, stop: int) -> None:
        self.trace, self.binding, self.parameters = whole.trace, whole.binding, whole.parameters
        self.since, self.until = first, stop
        self._whole = whole

    @property
    def first_step(self) -> int:
        return self._whole.first_step

    def __call__(self, name: str, *arguments: str) -> Bools:
        return self._whole(name, *arguments)

    def part(self, name: str, *arguments: str, first: int, stop: int) -> Bools:
        return self._whole.part(name, *arguments, first=first, stop=stop)

    def margin(self, name: str, *arguments: str) -> Floats:
        return self._whole.margin(name, *arguments)

    def margin_part(self, name: str, *arguments: str, first: int, stop: int) -> Floats:
        return self._whole.margin_part(name, *arguments, first=first, stop=stop)

    def narrowed(self, first: int, stop: int) -> View:
        return self._whole.narrowed(first, stop)

    def pointwise(self, compute: Callable[..., A], *arguments: Hashable) -> A:
        return self._whole.pointwise(compute, *arguments)

    def looking_back(self, seconds: float, compute: Callable[..., A], *arguments: Hashable) -> A:
        return self._whole.looking_back(seconds, compute, *arguments)

    def own(self, compute: Callable[..., T], *arguments: Hashable) -> T:
        return self._whole.own(compute, *arguments)

    def fold(self, start: Callable[[View], Fold]) -> Array:
        return self._whole.fold(start)

    def shared(self, compute: Callable[..., T], *arguments: Hashable) -> T:
        return self._whole.shared(compute, *arguments)

    def setting(self, name: str, settings: Settings) -> View:
        return self._whole.setting(name, settings)

    def evidence(self, name: str, arguments: tuple[str, ...], step: int) -> list[str]:
        return self._whole.evidence(name, arguments, step)

    def excess(self, name: str, arguments: tuple[str, ...], first: int, last: int) -> Excess | None:
        return self._whole.excess(name, arguments, first, last)


def wrong_side(values: Bools, margins: Floats) -> NDArray[np.int_]:
    """The steps at which a margin does not have the sign of its value."""
    low, high = margins < -MARGIN_ROUNDING, margins > MARGIN_ROUNDING
    return np.flatnonzero(np.where(values, low, high))


def _new_cache(view: View, kind: Callable[[Scene], T]) -> T:
    return kind(view.trace.scene)


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
