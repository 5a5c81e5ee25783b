"""Properties watched while a rollout runs, step by step: on a robot, say, or to stop early."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pytest_safemanip.errors import TraceError, judging
from pytest_safemanip.live.warning import HORIZON, EarlyWarning, Lookout, soonest
from pytest_safemanip.ltlf import (
    InstanceVerdict,
    Monitor,
    OnlineRobustness,
    Profile,
    StepVerdict,
)
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.definition import MARGIN_BOUND, Bools, Proposition
from pytest_safemanip.propositions.grounding import check_call
from pytest_safemanip.propositions.online import Call, Online
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step


class LiveJudge:
    """Monitors properties step by step; at the end its verdicts are those on the recording.

    Args:
        scene: the static part of the trace.
        binding: which entities play which part.
        properties: what is watched; those that range over what is in a scene, and find nothing
            there, are left out.
        catalogue: the propositions by name.
        parameters: values of all their parameters.
        profile: the semantics.
        every: how many steps are evaluated together: the same verdicts, later and cheaper.
        robust: whether :meth:`robustness` is wanted, for which margins are computed at every step.

    Raises:
        TraceError: if a property has no instance, or a proposition does not fit the scene.
    """

    def __init__(
        self,
        scene: Scene,
        binding: Binding,
        properties: Sequence[Property],
        catalogue: Mapping[str, Proposition],
        parameters: Mapping[str, float],
        profile: Profile = "timed",
        every: int = 1,
        robust: bool = False,
    ) -> None:
        self._monitors: dict[str, Monitor] = {}
        self._robust: dict[str, tuple[Property, list[OnlineRobustness]]] = {}
        self._profile, self._robustness = profile, dict[str, list[float]]()
        self._calls: dict[str, list[list[Call]]] = {}
        self._rows: dict[str, tuple[tuple[str, ...], ...]] = {}
        for prop in properties:
            rows = prop.rows(binding)
            if not rows and prop.may_lack_instances(binding):
                continue  # nothing of the kind is in this scene
            if not rows:
                raise TraceError(f"{prop.id}: the binding has no instance of it")
            self._rows[prop.id] = rows
            self._monitors[prop.id] = prop.monitor(rows, dt=scene.control_period, profile=profile)
            self._calls[prop.id] = [prop.calls(row) for row in rows]
            if robust:
                formula = prop.formula_of(profile)
                each = [OnlineRobustness(formula, scene.control_period) for _ in rows]
                self._robust[prop.id] = prop, each
        for call in self.calls:
            check_call(catalogue[call[0]], call[1:], scene, binding.zones)
        self._online = Online(scene, binding, parameters, catalogue, (), every)
        self._lookout = Lookout(self._online, properties, self._rows, self._calls)
        self._commands: NDArray[Any] = np.zeros(len(scene.grippers))
        self._over = False
        self._acting: list[bool] = []  # of the steps that wait
        self._started = False

    @property
    def calls(self) -> frozenset[Call]:
        """All propositions that a verdict may depend on; those that cannot matter at a step are
        not evaluated there.
        """
        return frozenset(c for rows in self._calls.values() for row in rows for c in row)

    def step(
        self, step: Step, action: NDArray[Any] | None = None, acting: bool = True
    ) -> dict[str, list[StepVerdict]]:
        """Take in a control step.

        Args:
            step: the state after the control period, and its contacts.
            action: what led to it (12,); None for the state after reset.
            acting: False in the settle tail.

        Returns:
            What is known about each property's instances after it, by property; empty while steps
            wait to be evaluated together.

        Raises:
            TraceError: if a number is impossible; the steps that waited are then not taken in.
        """
        self._acting.append(acting)
        self._commands, self._over = step.commands, not acting
        try:
            ready = len(self._online.push(step, action, acting))
        except TraceError:
            self._acting.clear()
            raise
        return self._read(ready)

    def verdicts(self) -> dict[str, list[InstanceVerdict]]:
        """The verdicts if the rollout ended with the last step.

        Raises:
            TraceError: if there was no step, or a number of those that wait is impossible.
        """
        self._read(len(self._online.flush()))
        return {name: monitor.verdicts() for name, monitor in self._monitors.items()}

    def evidence(self, name: str, instance: int) -> list[str]:
        """What was measured, in words, of what makes the last step unsafe.

        Args:
            name: of a property.
            instance: the number of one of its instances, for which the step is unsafe.
        """
        calls = self._calls[name][instance]
        letter = sum(bool(self._online.values(c, 1)[-1]) << k for k, c in enumerate(calls))
        atoms = self._monitors[name].at_fault(instance, letter)
        return [text for k in atoms for text in self._online.evidence(calls[k])]

    def margins(self, calls: Collection[Call] | None = None) -> dict[Call, float]:
        """How far propositions are from their thresholds after the newest step that was evaluated,
        in units of these: positive where they are true, 1 at twice the limit. Nothing before one
        was.

        They are computed when this is called; it may be called as seldom as one likes.

        Args:
            calls: of :attr:`calls`, those that are wanted; None for all.
        """
        if not self._started:
            return {}
        return {call: self._online.margin(call) for call in calls or self.calls}

    def robustness(self) -> dict[str, list[float]]:
        """By how much the steps that were evaluated satisfy the formula of each property, for each
        of its instances, as if they were the whole rollout; negative where they violate it. Nothing
        before one was, or if it is not wanted.
        """
        return dict(self._robustness)

    def warnings(
        self, commands: ArrayLike | None = None, pace: float = 1.0, horizon: float = HORIZON
    ) -> list[EarlyWarning]:
        """The violations that are near after the newest step that was evaluated, the most urgent
        first; none in the settle tail.

        They are computed when this is called, best after every step.

        Args:
            commands: what the grippers are told at the next step (G,), above 0 to close and below 0
                to open; None if they are told what they were told last.
            pace: share of its present speed that the robot is told to keep at the next step; 1 if
                that is not known.
            horizon: how many seconds before the last chance to prevent one it is near.

        Raises:
            ValueError: if there is not a finite command for each gripper, or pace or horizon is no
                number from 0 up.
        """
        if not self._started or self._over:
            return []
        told = self._commands if commands is None else commands
        return self._lookout.warnings(self._monitors, told, pace, horizon)

    def time_to_violation(
        self, commands: ArrayLike | None = None, pace: float = 1.0
    ) -> dict[str, float]:
        """Seconds until each property is expected to be violated, by its id: 0 while it is, inf if
        nothing points to it.

        Args:
            commands: as for :meth:`warnings`.
            pace: likewise.

        Raises:
            ValueError: likewise.
        """
        return soonest(self._monitors, self.warnings(commands, pace, math.inf))

    def _read(self, count: int) -> dict[str, list[StepVerdict]]:
        """Feed the newest complete steps to the monitors."""
        if not count:
            return {}
        acting = self._acting[:count]
        del self._acting[:count]
        if not self._started:
            # What remembers has to see every step from the first.
            for name, rows in self._calls.items():
                with judging(name):
                    for call in {call for row in rows for call in row}:
                        self._online.values(call, count)
        self._started = True
        found = {}
        for name, monitor in self._monitors.items():
            look_up = partial(self._value, self._calls[name], count)
            with judging(name):
                found[name] = monitor.steps(monitor.gather(count, look_up), acting)
        for name, (prop, each) in self._robust.items():
            runs = [acts or not prop.clocks_stand(self._profile) for acts in acting]
            with judging(name):
                self._robustness[name] = [
                    self._measured(prop, calls, one, runs)
                    for calls, one in zip(self._calls[name], each, strict=True)
                ]
        return found

    def _measured(
        self, prop: Property, calls: Sequence[Call], one: OnlineRobustness, runs: Sequence[bool]
    ) -> float:
        """The robustness of an instance after some more steps, of which it is said whether clocks
        run.
        """
        columns = [self._online.margins(call, len(runs))[-len(runs) :].tolist() for call in calls]
        value = 0.0
        for run, *margins in zip(runs, *columns, strict=True):
            value = one.step(dict(zip(prop.atoms, margins, strict=True)), run)
        return min(max(value, -MARGIN_BOUND), MARGIN_BOUND)

    def _value(
        self, calls: Sequence[Sequence[Call]], count: int, row: int, atom: int, a: int, b: int
    ) -> Bools:
        """Values of an atom of a property for one of its instances, at some of the newest steps."""
        return self._online.values(calls[row][atom], count)[a:b]
