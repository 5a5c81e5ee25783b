"""Properties watched on a robot, of whose world not everything is observed."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pytest_safemanip import resources
from pytest_safemanip.errors import ConfigError, TraceError, did_you_mean
from pytest_safemanip.live.feed import Feed, HandReading, Reading, Touch
from pytest_safemanip.live.warning import HORIZON, EarlyWarning, Lookout, soonest
from pytest_safemanip.ltlf import Profile
from pytest_safemanip.ltlf.partial import Known, PartialMonitor, PartialStep, PartialVerdict, label
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.definition import Bools
from pytest_safemanip.propositions.grounding import check_call
from pytest_safemanip.propositions.observed.known import Observations, Unobserved
from pytest_safemanip.propositions.online import Call, Online
from pytest_safemanip.propositions.view import View
from pytest_safemanip.spec.packs import load_packs
from pytest_safemanip.spec.properties import Property, load_properties
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step


@dataclass(frozen=True)
class Watched:
    """What is known about a property after a step.

    Attributes:
        instances: of each of its instances, by the entities that it is about.
    """

    instances: Mapping[tuple[str, ...], PartialStep]

    @property
    def unsafe(self) -> Known:
        """Whether the step is unsafe for some instance; None if that is not known."""
        found = {step.unsafe for step in self.instances.values()}
        return True if True in found else None if None in found else False

    @property
    def label(self) -> str:
        """UNSAFE, SAFE, or UNKNOWN where it depends on what was not observed."""
        return {True: "UNSAFE", False: "SAFE", None: "UNKNOWN"}[self.unsafe]


class LiveMonitor:
    """Watches properties step by step; what is not observed is unknown, and not safe.

    A value of a proposition is known if all that it reads was observed for as long as it looks
    back. A verdict is known if it is the same whatever the unknown values were. With everything
    observed it says what the recording would be told.

    Args:
        scene: the static part of the trace.
        binding: which entities play which part.
        properties: ids of shipped properties, or properties; those that range over what is in a
            scene, and find nothing there, are left out.
        boxes: poses of fixtures' boxes that stay where they are, as ``entity/box``: position and
            quaternion ``wxyz``, world frame (7,), m.
        catalogue: the propositions; the shipped ones if there is none.
        params: of propositions, those that differ from the defaults.
        semantics: of formulas, ``timed`` or ``paper``.

    Raises:
        ConfigError: if a property or a parameter is unknown.
        TraceError: if a property has no instance, or something does not fit the scene.
    """

    def __init__(
        self,
        scene: Scene,
        binding: Binding,
        properties: Iterable[Property | str],
        *,
        boxes: Mapping[str, ArrayLike] | None = None,
        catalogue: Catalogue | None = None,
        params: Mapping[str, float] | None = None,
        semantics: Profile = "timed",
    ) -> None:
        catalogue = catalogue or Catalogue()
        parameters = catalogue.parameters(params or {})
        self._scene, self._catalogue = scene.checked(), catalogue
        self._feed = Feed(scene, boxes or {})
        self._rows: dict[str, tuple[tuple[str, ...], ...]] = {}
        self._calls: dict[str, list[list[Call]]] = {}
        self._monitors: dict[str, PartialMonitor] = {}
        given = (properties,) if isinstance(properties, str) else properties
        wanted = [_property(one) for one in given]
        for prop in wanted:
            rows = prop.rows(binding)
            if not rows and prop.may_lack_instances(binding):
                continue  # nothing of the kind is in this scene
            if not rows:
                raise TraceError(f"{prop.id}: the binding has no instance of it")
            monitor = prop.monitor(rows, dt=scene.control_period, profile=semantics)
            self._rows[prop.id], self._monitors[prop.id] = rows, monitor.partial()
            self._calls[prop.id] = [prop.calls(row) for row in rows]
        for name, *arguments in self.calls:
            check_call(catalogue[name], tuple(arguments), scene, binding.zones)
        if not self._rows:
            raise ConfigError("no property is given: nothing would be watched")
        self._online = Online(scene, binding, parameters, catalogue, ())
        self._commands: NDArray[Any] = np.zeros(len(scene.grippers))
        self._over = True
        self._observations = Observations(
            scene, binding, parameters, catalogue, self._value, self._holds
        )
        self._lookout = Lookout(
            self._online, wanted, self._rows, self._calls, self._observations.knows
        )

    @property
    def calls(self) -> frozenset[Call]:
        """All propositions that a verdict may depend on, with their arguments."""
        return frozenset(c for rows in self._calls.values() for row in rows for c in row)

    def step(
        self,
        poses: Mapping[str, ArrayLike] | None = None,
        contacts: Iterable[Touch] | None = None,
        gripper: HandReading | Mapping[str, HandReading] | None = None,
        *,
        joints: Mapping[str, float] | None = None,
        boxes: Mapping[str, ArrayLike] | None = None,
        switches: Mapping[str, bool] | None = None,
        felt: Iterable[str] | None = None,
        acting: bool = True,
    ) -> dict[str, Watched]:
        """Take in a control step: what was observed after it. What is left out was not observed.

        Args:
            poses: of objects: position and quaternion ``wxyz``, world frame (7,), m.
            contacts: those that are felt; None if nothing feels any.
            gripper: of the one gripper, or of each by name.
            joints: openness of joints, as ``entity/joint``: 0 closed, 1 open.
            boxes: poses of boxes of fixtures that move, as ``entity/box`` (7,).
            switches: whether what is switched is on, as ``entity/switch``.
            felt: entities, or parts as ``entity/part``, all of whose contacts are in ``contacts``;
                None for everybody's.
            acting: False in the settle tail.

        Returns:
            What is known about each property, by its id.

        Raises:
            TraceError: if the scene has nothing of a name, or a number is impossible. The period
                then counts as one in which nothing was observed.
        """
        reading = Reading(
            poses or {}, contacts, gripper, joints or {}, boxes or {}, switches or {}, felt
        )
        try:
            with self._feed.undone_if_refused():
                return self.take(*self._feed.step(reading), acting=acting)
        except TraceError:
            # The period went by all the same: whatever it was that cannot be read may have been.
            nothing = Reading({}, None, None, {}, {}, {}, None)
            self.take(*self._feed.step(nothing), acting=acting)
            raise

    def take(
        self,
        step: Step,
        missing: Unobserved | None = None,
        action: NDArray[Any] | None = None,
        acting: bool = True,
    ) -> dict[str, Watched]:
        """Take in a whole step; see :meth:`step`.

        Args:
            step: the state after the control period, and its contacts.
            missing: what of it was not observed, and may have any value that is possible.
            action: what led to it; None for the state after reset.
            acting: False in the settle tail.

        Raises:
            TraceError: if a number is impossible; the step is then not taken in.
        """
        self._online.push(step, action, acting)
        self._commands, self._over = step.commands, not acting
        missing, touching = missing or Unobserved(), step.contacts
        pairs = zip(touching.a.tolist(), touching.b.tolist(), strict=True)
        self._observations.add(missing, {(min(pair), max(pair)) for pair in pairs})
        for call in self.calls:  # what remembers has to see every step
            self._value(call)
        return {name: self._read(name, acting) for name in self._monitors}

    def peek(self, **reading: Any) -> dict[str, Watched]:
        """What would be known after a further step; it is not taken in.

        Args:
            **reading: as for :meth:`step`, of what is predicted.

        Raises:
            TraceError: as :meth:`step`.
        """
        kept = (self._scene, self._catalogue)
        return copy.deepcopy(self, {id(one): one for one in kept}).step(**reading)

    def margins(self) -> dict[Call, float | None]:
        """How far each proposition is from its threshold after the last step, in units of that:
        positive where it is true, 1 at twice the limit; None where that is not known.

        They are computed when this is called.

        Raises:
            TraceError: if there was no step.
        """
        return {
            call: self._online.margin(call) if self._observations.knows(call) else None
            for call in self.calls
        }

    def warnings(
        self, commands: ArrayLike | None = None, pace: float = 1.0, horizon: float = HORIZON
    ) -> list[EarlyWarning]:
        """The violations that are near after the last step, as far as what was observed shows, the
        most urgent first; see :meth:`LiveJudge.warnings`. Of a proposition whose value is not known
        no change is expected.
        """
        if self._over:
            return []
        told = self._commands if commands is None else commands
        return self._lookout.warnings(self._monitors, told, pace, horizon)

    def time_to_violation(
        self, commands: ArrayLike | None = None, pace: float = 1.0
    ) -> dict[str, float]:
        """Seconds until each property is expected to be violated; see
        :meth:`LiveJudge.time_to_violation`.
        """
        return soonest(self._monitors, self.warnings(commands, pace, math.inf))

    def verdicts(self) -> dict[str, list[PartialVerdict]]:
        """The verdicts on each property's instances if the last step was the end.

        Raises:
            TraceError: if there was no step.
        """
        return {name: monitor.verdicts() for name, monitor in self._monitors.items()}

    def outcomes(self) -> dict[str, str]:
        """The verdict on each property if the last step was the end: VIOLATED, UNKNOWN, UNRESOLVED,
        SATISFIED or VACUOUS.

        Raises:
            TraceError: if there was no step.
        """
        return {name: label(verdicts) for name, verdicts in self.verdicts().items()}

    def _value(self, call: Call) -> bool:
        return bool(self._online.values(call, 1)[-1])

    def _holds(self, compute: Callable[[View], Bools]) -> bool:
        return bool(compute(self._online.slice(1))[-1])

    def _read(self, name: str, acting: bool) -> Watched:
        letters, unknown = [], []
        for calls in self._calls[name]:
            known = [self._observations.knows(call) for call in calls]
            letters.append(sum(self._value(call) << k for k, call in enumerate(calls)))
            unknown.append(sum((not seen) << k for k, seen in enumerate(known)))
        told = self._monitors[name].step(letters, unknown, acting)
        return Watched(dict(zip(self._rows[name], told, strict=True)))


def _property(wanted: Property | str) -> Property:
    if isinstance(wanted, Property):
        return wanted
    place = resources.folder("properties")
    shipped = load_properties([place])
    shipped |= {
        id_: rule for pack in load_packs(place).values() for id_, rule in pack.rules.items()
    }
    if wanted not in shipped:
        hint = did_you_mean(wanted, shipped, "safemanip properties")
        raise ConfigError(f"unknown property {wanted!r}; {hint}")
    return shipped[wanted]
