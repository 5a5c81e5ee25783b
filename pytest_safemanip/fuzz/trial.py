"""One proposition on a generated recording: its values, and the error of a broken law."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, TypeVar

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from pytest_safemanip.errors import SafemanipError
from pytest_safemanip.fuzz.scenes import bind
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.definition import Bools, Parameters, Proposition
from pytest_safemanip.propositions.grounding import alternatives
from pytest_safemanip.propositions.kernels.heat import HOT_SOURCE
from pytest_safemanip.propositions.online import Online
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.trace.scene import Scene

T = TypeVar("T")
Arguments = tuple[str, ...]
MOST_CALLS = 12
"""Arguments, at most, that a proposition is tried with in a scene."""
SHORT = 0.2
"""Windows up to this many seconds are kept; longer ones are shortened, so that generated
recordings are longer than they."""


class LawBroken(SafemanipError):
    """A proposition does not obey a law.

    Attributes:
        arguments: what the proposition was asked about.
        step: where it shows, or None.
        values: its values on the recording (T,), or None.
        recording: on which it shows; None for the one that was generated.
    """

    def __init__(
        self,
        why: str,
        arguments: Arguments,
        step: int | None = None,
        values: Bools | None = None,
        recording: Recording | None = None,
    ) -> None:
        super().__init__(why)
        self.arguments, self.step = arguments, step
        self.values, self.recording = values, recording


class Draw(Protocol):
    """Hypothesis's ``data.draw``."""

    def __call__(self, strategy: st.SearchStrategy[T]) -> T:
        """A value of the strategy."""


class Trial:
    """A proposition and a recording that it is tried on.

    Args:
        proposition: what is tried.
        recording: what happens.
        catalogue: all propositions.
        parameters: values of all parameters; see :func:`shortened`.
    """

    def __init__(
        self,
        proposition: Proposition,
        recording: Recording,
        catalogue: Catalogue,
        parameters: Mapping[str, float],
    ) -> None:
        self.proposition, self.recording = proposition, recording
        self.catalogue, self.parameters = catalogue, parameters
        self.binding = bind(recording.scene)
        self.calls = calls(proposition, self.binding, recording.scene)
        self.values = self.on(recording)
        """The proposition's values on the recording; see :meth:`on`."""

    def instead(self, recording: Recording) -> Trial:
        """The same proposition on another recording."""
        return type(self)(self.proposition, recording, self.catalogue, self.parameters)

    def on(
        self, recording: Recording, parameters: Mapping[str, float] | None = None
    ) -> Callable[[Arguments], NDArray[Any]]:
        """The proposition's values (T,) by arguments, on any recording and with any parameters."""
        view = self.view(recording, parameters)
        return lambda arguments: self.look(view, arguments)

    def look(self, view: View, arguments: Arguments) -> NDArray[Any]:
        """The proposition's values on a view (T,)."""
        return view(self.proposition.name, *arguments)

    def view(
        self, recording: Recording | None = None, parameters: Mapping[str, float] | None = None
    ) -> View:
        """A recording as propositions see it, nothing evaluated; this one if none is given."""
        seen = self.recording if recording is None else recording
        chosen = self.parameters if parameters is None else parameters
        return View(seen.trace, bind(seen.scene), chosen, self.catalogue)

    def online(self, every: int) -> NDArray[Any]:
        """The proposition's values for all calls (T, calls), computed online."""
        online = self.watched(every)
        rows = [online.push(*step) for step in self.recording.steps]
        return np.concatenate([*rows, online.flush()])

    def watched(self, every: int) -> Online:
        """What evaluates all calls online, before the first step."""
        names = [(self.proposition.name, *arguments) for arguments in self.calls]
        scene = self.recording.scene
        return Online(scene, self.binding, self.parameters, self.catalogue, names, every)

    def count(self, seconds: float) -> int:
        """A duration in control periods."""
        return self.recording.trace.count(seconds)

    def expect(
        self, arguments: Arguments, found: NDArray[Any], wanted: NDArray[Any], where: str
    ) -> None:
        """Require values to be equal.

        Raises:
            LawBroken: naming the first step at which they are not.
        """
        differ = np.flatnonzero(found != wanted)
        if len(differ):
            step = int(differ[0])
            why = f"{bool(wanted[step])} on the recording, {bool(found[step])} {where}"
            raise LawBroken(why, arguments, step, self.values(arguments), self.recording)


def calls(proposition: Proposition, binding: Binding, scene: Scene) -> list[Arguments]:
    """Arguments that a proposition can have in a scene: all, or at most :data:`MOST_CALLS`.

    Args:
        proposition: what is called.
        binding: which entities play which part.
        scene: the static part of the trace.
    """
    objects = tuple(binding.objects)
    together: dict[tuple[str, ...], Sequence[Arguments]] = {
        ("skill", "entity"): binding.skills,
        ("object", "entity"): binding.transfers,
        ("object or liquid", "entity"): (
            *binding.transfers,
            *((liquid, r) for liquid in scene.particles for _, r in binding.transfers[:2]),
        ),
        ("object", "fixture"): binding.placements,
    }
    if proposition.arguments in together:
        return list(together[proposition.arguments])
    switched = dict.fromkeys(switch.entity for switch in scene.switches)
    kinds: dict[str, Sequence[str]] = {
        "robot": (ROBOT,),
        "object": objects,
        "appliance": [f for f in switched if HOT_SOURCE in binding.attributes_of(f)],
        "zone": tuple(binding.zones),
        "liquid": tuple(scene.particles),
        "fixture": binding.enclosures,
        "tool": binding.tools,
        "entity": (*objects, *binding.enclosures),
        "skill": tuple(dict.fromkeys(skill for skill, _ in binding.skills)),
    }
    # What may be of several kinds fills space: of the appliances, the stove does.
    solid = {**kinds, "fixture": tuple(dict.fromkeys((*binding.enclosures, *kinds["appliance"])))}
    members = [
        kinds[argument]
        if argument in kinds
        else [n for k in alternatives(argument) for n in solid[k]]
        for argument in proposition.arguments
    ]
    rows = [row for row in itertools.product(*members) if len(set(row)) == len(row)]
    return rows[:: 1 + len(rows) // MOST_CALLS]


def shortened(catalogue: Catalogue, changed: Mapping[str, float]) -> Parameters:
    """Parameters whose windows fit into generated recordings: 1 s becomes 0.4 s, 12 s 1 s."""
    values = catalogue.parameters(changed)
    seconds = {
        parameter.name
        for proposition in catalogue.values()
        for parameter in proposition.parameters
        if parameter.unit == "s"
    }
    short = {
        name: SHORT * (value / SHORT) ** 0.4 if name in seconds and value > SHORT else value
        for name, value in values.items()
    }
    return catalogue.parameters(short)
