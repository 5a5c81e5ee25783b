"""Whether a proposition's value is known where not all of its inputs were observed."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.definition import Bools, Proposition
from pytest_safemanip.propositions.observed.inputs import Input, Inputs, Kind
from pytest_safemanip.propositions.settings import changed, split
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.scene import Scene

Call = tuple[str, ...]
_Pair = tuple[int, int]
_Name = tuple[Kind, str]


@dataclass(frozen=True)
class Unobserved:
    """What was not observed at a step.

    Attributes:
        names: kinds of inputs with the entity whose they are; with an empty name for the robot's.
        unfelt: parts whose contacts with one another may be missing.
    """

    names: frozenset[_Name] = frozenset()
    unfelt: frozenset[int] = frozenset()

    def __bool__(self) -> bool:
        return bool(self.names or self.unfelt)


class Observations:
    """What of the steps so far was observed, and which values are known for it.

    Args:
        scene: the static part of the trace.
        binding: which entities play which part.
        parameters: values of all parameters.
        catalogue: the propositions by name.
        value: of a proposition at the present step, from what fills the gaps.
        holds: likewise of a function of a view that depends on each step alone.
    """

    def __init__(
        self,
        scene: Scene,
        binding: Binding,
        parameters: Mapping[str, float],
        catalogue: Mapping[str, Proposition],
        value: Callable[[Call], bool],
        holds: Callable[[Callable[[View], Bools]], bool],
    ) -> None:
        self._parameters, self._catalogue, self._value = parameters, catalogue, value
        self._inputs = Inputs(scene, binding, catalogue, parameters, self.value, holds)
        self._dt = scene.control_period
        owners = {name: n for n, name in enumerate(scene.entity)}
        self._owner = [owners[part.entity] for part in scene.parts]
        self._last: dict[Unobserved, int] = {}  # the last step at which just this was missing
        self._now = -1
        self._since_start: set[_Pair] = set()
        self._lost: set[_Pair] = set()  # nobody knows whether these have touched since the start
        self._unfelt_at_start = frozenset[int]()
        self._known: dict[Call, bool] = {}

    def add(self, missing: Unobserved, touching: Collection[_Pair]) -> None:
        """Take in a step.

        Args:
            missing: what was not observed.
            touching: pairs of parts that touch, the lower index first, as far as is known.
        """
        self._now += 1
        self._known.clear()
        if missing:
            self._last[missing] = self._now
        if self._now == 0:
            self._since_start, self._unfelt_at_start = set(touching), missing.unfelt
            return
        touch, unfelt = set(touching), missing.unfelt
        if not unfelt:  # of what was not felt at the start, the rest has broken
            at_start = self._unfelt_at_start
            self._lost |= {pair for pair in touch if at_start.issuperset(pair)}
            self._unfelt_at_start = unfelt
        gone = {pair for pair in self._since_start if unfelt.issuperset(pair)}
        self._lost = {p for p in self._lost | gone if p in touch or unfelt.issuperset(p)}
        self._since_start &= touch - gone

    def value(self, *call: str) -> bool | None:
        """The value of a proposition at the present step; None if it is not known."""
        return self._value(call) if self.knows(call) else None

    def knows(self, call: Call) -> bool:
        """Whether the value of a proposition at the present step is known."""
        if not self._last:
            return True
        if call not in self._known:
            proposition = self._catalogue[call[0]]
            own, settings = split(proposition, call[1:])
            reads = self._inputs.of(call[0], *own)
            parameters = changed(self._parameters, proposition, settings)
            back = proposition.seconds(parameters) + self._dt * proposition.act
            self._known[call] = not any(self._gap(one, back) for one in reads)
        return self._known[call]

    def _gap(self, wanted: Input, back: float) -> bool:
        """Whether an input was not observed within the time that is looked back."""
        if wanted.kind == "start":
            at_start = self._meet(wanted, self._unfelt_at_start)
            return at_start or any(_crosses(wanted, pair) for pair in self._lost)
        seconds = back if wanted.seconds is None else wanted.seconds
        count = math.inf if math.isinf(seconds) else round(seconds / self._dt)
        return any(
            self._now - last <= count and self._lacks(missing, wanted)
            for missing, last in self._last.items()
        )

    def _lacks(self, missing: Unobserved, wanted: Input) -> bool:
        if wanted.kind == "touch":
            return self._meet(wanted, missing.unfelt)
        return (wanted.kind, wanted.entity) in missing.names

    def _meet(self, wanted: Input, unfelt: frozenset[int]) -> bool:
        """Whether contacts may be missing between parts of different entities."""
        sides = (wanted.one & unfelt, wanted.other & unfelt)
        one, other = ({self._owner[part] for part in side} for side in sides)
        return bool(one and other) and len(one | other) > 1


def _crosses(wanted: Input, pair: _Pair) -> bool:
    a, b = pair
    one, other = wanted.one, wanted.other
    return (a in one and b in other) or (b in one and a in other)
