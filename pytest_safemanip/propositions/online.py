"""Online evaluation of propositions, over a ring buffer as long as their windows.

The definitions are those of :class:`View`. What depends on one step alone is computed for the
newest step; what looks back sees as many steps as its window has.
"""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TraceError
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.definition import Bools, Floats, Proposition
from pytest_safemanip.propositions.forecasts.motion import Told
from pytest_safemanip.propositions.grounding import check_call, find
from pytest_safemanip.propositions.kernels.filters import slope
from pytest_safemanip.propositions.memory import Ring, StepMemory
from pytest_safemanip.propositions.settings import Settings, changed, split
from pytest_safemanip.propositions.view import Array, Fold, View
from pytest_safemanip.trace.recording import check_steps
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step, Steps
from pytest_safemanip.trace.trace import Trace

A = TypeVar("A", bound=Array)
T = TypeVar("T")
Call = tuple[str, ...]
"""A proposition's name and its arguments."""
RATE_SECONDS = 0.25
"""What the rate of a margin is measured over: a single step of a contact's force is noise."""


class Online:
    """Evaluates propositions while a rollout runs.

    Args:
        scene: the static part of the trace.
        binding: which entities play which part.
        parameters: values of all parameters.
        catalogue: the propositions by name.
        calls: what is evaluated at every step.
        every: how many steps are evaluated together. The values are the same; they come later, and
            each step costs less: mostly one pays for a call, not for its arithmetic.

    Raises:
        TraceError: if a call does not fit its proposition or the scene.
    """

    def __init__(
        self,
        scene: Scene,
        binding: Binding,
        parameters: Mapping[str, float],
        catalogue: Mapping[str, Proposition],
        calls: Sequence[Call],
        every: int = 1,
    ) -> None:
        self.scene, self.binding = scene.checked(), binding
        self.parameters = binding.parameters(parameters)
        self.catalogue = catalogue
        self.calls, self._every = tuple(calls), every
        self._waiting: list[tuple[Step, NDArray[Any], bool]] = []
        for name, *arguments in calls:
            check_call(catalogue[name], tuple(arguments), scene, binding.zones)
        self._none = np.zeros((0, len(self.calls)), bool)
        self._lengths = {name: self._length(p) for name, p in catalogue.items()}
        self._dt = scene.control_period
        self._kept = max(self._lengths.values()) + every
        self._steps = StepMemory(scene, self._kept)
        self._traces: dict[int, Trace] = {}  # of the newest steps, by length
        self._forget()

    def _forget(self) -> None:
        """Nothing is computed yet."""
        self._slices: dict[int, _Slice] = {}
        self._series: dict[Hashable, _Series] = {}
        self._folds: dict[Callable[[View], Fold], tuple[Fold, _Series]] = {}
        self._shared: dict[Hashable, Any] = {}
        self._with: dict[tuple[str, ...], Online] = {}
        self._resolved: dict[Call, tuple[Online, Call]] = {}

    def setting(self, name: str, settings: Settings) -> Online:
        """What evaluates the same steps, with those parameters changed that a call sets."""
        if not settings:
            return self
        key = (name, *settings)
        if key not in self._with:
            twin = copy.copy(self)
            twin.parameters = changed(self.parameters, self.catalogue[name], settings)
            twin._lengths = {n: twin._length(p) for n, p in self.catalogue.items()}
            twin._kept = max(twin._lengths.values()) + self._every
            twin._forget()
            self._steps.keep(twin._kept)
            self._with[key] = twin
        return self._with[key]

    def push(self, step: Step, action: NDArray[Any] | None = None, acting: bool = True) -> Bools:
        """Take in a step.

        Args:
            step: the state after a control period, and its contacts.
            action: what led to it (A,); None for the state after reset.
            acting: False in the settle tail.

        Returns:
            The values of the calls at the steps that are evaluated now, oldest first (K, calls):
            none while steps wait for one another.

        Raises:
            TraceError: as :meth:`flush`.
        """
        if action is None:
            action = np.zeros(len(self.scene.actions))
        self._waiting.append((step, action, acting))
        return self.flush() if len(self._waiting) == self._every else self._none

    def flush(self) -> Bools:
        """The values of the calls at the steps that wait (K, calls).

        Raises:
            TraceError: if a number is impossible; names it. The steps are then not taken in.
        """
        if not self._waiting:
            return self._none
        steps, actions, acting = zip(*self._waiting, strict=True)
        self._waiting, count = [], len(steps)
        new = Steps.stack(steps, [np.asarray(a, np.float32) for a in actions], count)
        new = dataclasses.replace(new, tail=~np.array(acting, bool))
        check_steps(self.scene, new, self._steps.count)
        self._steps.extend(new)
        self._traces.clear()
        for online in (self, *self._with.values()):
            online._slices.clear()
            for start in tuple(online._folds):
                online.folded(start, count)
        columns = [self.values(call, count) for call in self.calls]
        return np.stack(columns, axis=1) if columns else np.zeros((count, 0), bool)

    def evidence(self, call: Call) -> list[str]:
        """The evidence of a call at the newest step, in words."""
        name, *arguments = call
        own, settings = split(self.catalogue[name], tuple(arguments))
        online = self.setting(name, settings)
        view = online.slice(online._lengths[name])
        return view.evidence(name, own, len(view.trace) - 1)

    def values(self, call: Call, length: int) -> Bools:
        """Values of a proposition at the newest steps (at most ``length``,)."""
        return self._of_proposition("value", call, View.evaluate, length)

    def margins(self, call: Call, length: int) -> Floats:
        """Margins of a proposition at the newest steps (at most ``length``,), as
        :meth:`View.margin` has them; computed for steps that were not asked for before.
        """
        return self._of_proposition("margin", call, View.measured, length)

    def margin(self, call: Call) -> float:
        """The margin of a proposition at the newest step alone, for which less is computed.

        Raises:
            TraceError: as for a call of a view, or there was no step.
        """
        if not self._steps.count:
            raise TraceError(f"{call[0]}: no step was taken in, and it has no margin")
        proposition = self.catalogue[call[0]]
        check_call(proposition, call[1:], self.scene, self.binding.zones)
        own, settings = split(proposition, call[1:])
        online = self.setting(call[0], settings)
        view = online.slice(online._lengths[call[0]])
        stop = len(view.trace)
        return float(view.narrowed(stop - 1, stop).measured(proposition, own)[-1])

    def change(self, call: Call, told: Told) -> float:
        """Seconds from the newest step until the value of a proposition is expected to change, by
        its forecast, or by its margin and the rate of that; inf if it is not.

        Args:
            call: the proposition.
            told: what the robot is told for the next step.
        """
        proposition = self.catalogue[call[0]]
        if proposition.forecast is not None:
            own, settings = split(proposition, call[1:])
            online = self.setting(call[0], settings)
            view = online.slice(max(online._lengths[call[0]], 1 + round(RATE_SECONDS / self._dt)))
            when = proposition.run(proposition.forecast, own, view, told)
            if when is not None:
                return float(when)
        if proposition.margin is None:
            return math.inf
        margin, rate = self.rate(call)
        return -margin / rate if margin * rate < 0.0 else math.inf

    def rate(self, call: Call) -> tuple[float, float]:
        """The margin of a proposition at the newest step, and its rate, 1/s: the slope of a
        least-squares line through those of the last :data:`RATE_SECONDS`.
        """
        margins = self.margins(call, 1 + round(RATE_SECONDS / self._dt))
        return float(margins[-1]), float(slope(margins, self._dt))

    def _of_proposition(
        self, kind: str, call: Call, look: Callable[..., Array], length: int
    ) -> Array:
        """A series of values or margins of a proposition at the newest steps."""
        online, call = self._resolved.get(call) or self._resolve(call)
        if online is not self:
            return online._of_proposition(kind, call, look, length)
        key = (kind, call)
        if key not in self._series:
            check_call(self.catalogue[call[0]], call[1:], self.scene, self.binding.zones)

        def compute(missing: int) -> Array:
            view = self.slice(missing + self._lengths[call[0]] - 1)
            stop = len(view.trace)
            asked = view.narrowed(stop - missing, stop)
            return look(asked, self.catalogue[call[0]], call[1:])

        return self._caught_up(key, compute).last(length)

    def _resolve(self, call: Call) -> tuple[Online, Call]:
        """Who evaluates a call, and what is left of it without the parameters that it sets."""
        own, settings = split(find(self.catalogue, call[0]), call[1:])
        found = self.setting(call[0], settings), (call[0], *own)
        self._resolved[call] = found
        return found

    def points(
        self, compute: Callable[..., A], arguments: Hashable, length: int, seconds: float = 0.0
    ) -> A:
        """Values of a function that looks back so many seconds at the newest steps (at most
        ``length``, ...).
        """
        back = round(seconds / self.scene.control_period)

        def run(missing: int) -> Array:
            return compute(self.slice(missing + back), *arguments)  # type: ignore[misc]

        found: A = self._caught_up((compute, arguments), run).last(length)  # type: ignore[assignment]
        return found

    def folded(self, start: Callable[[View], Fold], length: int) -> Array:
        """Results of a fold after the newest steps (at most ``length``, ...)."""
        now = self._steps.count
        if start not in self._folds:
            if now > self._every:
                raise TraceError(f"{start.__name__}: a fold has to be asked for from step 0 on")
            self._folds[start] = start(self.slice(1)), _Series(Ring(self._kept))
        fold, series = self._folds[start]
        missing, series.upto = now - series.upto, now
        if missing:
            series.ring.extend(fold.advance(self.slice(missing)))
        return series.ring.last(length)

    @property
    def count(self) -> int:
        """How many steps were taken in."""
        return self._steps.count

    def once(self, compute: Callable[..., T], arguments: tuple[Hashable, ...]) -> T:
        """A value that depends on scene, binding and parameters alone, computed once."""
        key = (compute, arguments)
        if key not in self._shared:
            self._shared[key] = compute(self.slice(1), *arguments)
        found: T = self._shared[key]
        return found

    def slice(self, length: int) -> _Slice:
        """The newest steps as a view, as many as there are and are kept."""
        length = min(length, self._steps.held)
        if length not in self._slices:
            if length not in self._traces:
                self._traces[length] = Trace(self.scene, self._steps.last(length))
            self._slices[length] = _Slice(self, self._traces[length])
        return self._slices[length]

    def _caught_up(self, key: Hashable, compute: Callable[[int], Array]) -> Ring:
        """A series up to the newest step."""
        series = self._series.get(key)
        if series is None:
            series = self._series[key] = _Series(Ring(self._kept))
        missing = min(self._steps.count - series.upto, self._steps.held)
        if missing:
            series.ring.extend(compute(missing)[-missing:])
            series.upto = self._steps.count
        return series.ring

    def _length(self, proposition: Proposition) -> int:
        """Number of steps that a value depends on; 1 for a fold."""
        window = proposition.seconds(self.parameters)
        count = round(window / self.scene.control_period) if np.isfinite(window) else 0
        return 1 + max(count, int(proposition.act))


class _Series:
    """The newest values of something, and up to which step they go."""

    def __init__(self, ring: Ring) -> None:
        self.ring, self.upto = ring, 0


class _Slice(View):
    """The newest steps; what was computed at earlier steps is remembered, not computed again."""

    def __init__(self, online: Online, trace: Trace) -> None:
        super().__init__(trace, online.binding, online.parameters, online.catalogue)
        self._online, self._length = online, len(trace)

    @property
    def first_step(self) -> int:
        return self._online.count - self._length

    def __call__(self, name: str, *arguments: str) -> Bools:
        return self._online.values((name, *arguments), self._length)

    def margin(self, name: str, *arguments: str) -> Floats:
        return self._online.margins((name, *arguments), self._length)

    def pointwise(self, compute: Callable[..., A], *arguments: Hashable) -> A:
        return self._online.points(compute, arguments, self._length)

    def looking_back(self, seconds: float, compute: Callable[..., A], *arguments: Hashable) -> A:
        return self._online.points(compute, arguments, self._length, seconds)

    def fold(self, start: Callable[[View], Fold]) -> Array:
        return self._online.folded(start, self._length)

    def shared(self, compute: Callable[..., T], *arguments: Hashable) -> T:
        return self._online.once(compute, arguments)
