"""A Gymnasium environment that says at every step what is violated."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from pytest_safemanip.cost import step_cost
from pytest_safemanip.errors import ConfigError, did_you_mean, install_command
from pytest_safemanip.gym.sources import OpenProbe, source_of
from pytest_safemanip.live import EarlyWarning, LiveJudge
from pytest_safemanip.live.warning import checked_seconds, soonest
from pytest_safemanip.ltlf import Profile, StateClass, StepVerdict
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.run.cases import applicable, select_properties
from pytest_safemanip.run.definitions import Definitions, load_definitions
from pytest_safemanip.run.option_values import parse_names
from pytest_safemanip.sim.mujoco.layout import Layout
from pytest_safemanip.sim.mujoco.probe import Probe
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.spec.task import Task

try:
    import gymnasium
except ImportError as error:
    raise ConfigError(
        f"SafetyMonitor wraps environments of Gymnasium: {install_command('gym')}"
    ) from error

_WORST = (
    StateClass.FALSE,
    StateClass.CURRENTLY_FALSE,
    StateClass.CURRENTLY_TRUE,
    StateClass.TRUE,
)
Folders = Iterable[str | os.PathLike[str]]


class NewViolation(NamedTuple):
    """A violation that begins at this step.

    Attributes:
        entities: what it is about.
        reason: what was measured, as a failure's report has it; ``bad prefix`` or ``overdue`` where
            nothing is.
    """

    entities: tuple[str, ...]
    reason: str


class PropertyState(NamedTuple):
    """What is said about a property after a step.

    Attributes:
        state: ``true``, ``currently true``, ``currently false`` or ``false``: the worst of its
            instances'.
        unsafe: whether the step is unsafe for one of them.
        violations: those that begin at this step.
        time_to_violation: seconds until a step is expected to be unsafe if the robot goes on, inf
            if none is; None where no horizon is given, since nothing is predicted then.
    """

    state: str
    unsafe: bool
    violations: tuple[NewViolation, ...]
    time_to_violation: float | None


class SafetyMonitor(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Watches properties while an environment is stepped; changes no bit of what it does.

    ``info["safety"]`` has a :class:`PropertyState` for each property, by its id, and
    ``info["cost"]`` is 0.0 at a step that is not unsafe. Where a violation begins it is what its
    property costs, at each further step of it as much times the control period in seconds, added up
    over all properties and instances; its sum is the cost of the episode. ``info["warnings"]`` has
    the violations that are near, and :meth:`warnings` those that are if an action is taken next.

    Args:
        env: of RoboCasa or robosuite, or any whose MuJoCo model's layout is given.
        task: name of a task, a task, or a binding to the entities of the scene.
        properties: ids or properties, which are watched whatever the task, or selectors as those of
            ``--safemanip-properties`` (``pack:redvla``, globs, ``default``), of which those that
            apply to the task are; a list, or text with commas. ``default`` if there are none.
        probe: the layout of the environment's MuJoCo model, or a function that is given the
            environment after its reset, and taps to listen to it, and returns what reads it.
        stop: terminate the episode at the first violation. To stop before one, ask
            :meth:`warnings` before each action.
        tasks: folders of tasks of your own.
        property_paths: folders of properties of your own.
        propositions: of your own.
        params: of propositions, those that differ from the defaults.
        semantics: of formulas, ``timed`` or ``paper``.
        horizon: how many seconds before the last chance to prevent it a violation is near, as
            :data:`~pytest_safemanip.live.HORIZON`, from 0 up; None if no warnings are wanted: they
            take as much time as all else.

    Raises:
        ConfigError: if a name is unknown, an option has no value that it can have, or the
            environment is one of which nothing is known.
    """

    def __init__(
        self,
        env: Any,
        task: str | Task | Binding,
        properties: str | Sequence[str | Property] | None = None,
        *,
        probe: Layout | OpenProbe | None = None,
        stop: bool = False,
        tasks: Folders = (),
        property_paths: Folders = (),
        propositions: Iterable[Proposition] = (),
        params: Mapping[str, float] | None = None,
        semantics: Profile = "timed",
        horizon: float | None = None,
    ) -> None:
        super().__init__(env)
        if not isinstance(stop, bool):
            raise ConfigError(
                f"SafetyMonitor: stop: expected True or False, found {stop!r}; who stops at "
                "warnings asks env.warnings(action) before each action"
            )
        with _refused():
            self._horizon = None if horizon is None else checked_seconds("horizon", horizon)
        defined = load_definitions(
            list(map(Path, tasks)), list(map(Path, property_paths)), propositions
        )
        self._defined, self._stop, self._semantics = defined, stop, semantics
        self._task = _task(task, defined)
        self._properties = _properties(properties, self._task, defined)
        self._parameters = defined.catalogue.parameters(params or {})
        self._source = source_of(env, probe)
        self._probe: Probe | None = None
        self._judge: LiveJudge | None = None
        self._unsafe: set[tuple[str, int]] = set()
        self._weights = {prop.id: prop.cost for prop in self._properties}
        self._dt = 0.0

    def reset(self, **options: Any) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; ``info`` is about its first state.

        Raises:
            TraceError: if the scene lacks what the task or a property needs.
        """
        self._source.leave()
        observation, info = self.env.reset(**options)
        self._probe = self._source.open()
        scene, task = self._probe.scene, self._task
        binding = task if isinstance(task, Binding) else task.bind(scene, self._defined.attributes)
        self._dt = scene.control_period
        self._rows = {p.id: p.rows(binding)
                      for p in self._properties}  # fmt: skip
        self._judge = LiveJudge(
            scene,
            binding,
            self._properties,
            self._defined.catalogue,
            self._parameters,
            self._semantics,
        )
        self._unsafe = set()
        told = self._judge.step(self._probe.read())
        return observation, {**info, **self._said(self._judge, told)}

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Run one control period.

        Raises:
            ConfigError: before the first reset.
            TraceError: if a number is impossible.
        """
        if self._probe is None or self._judge is None:
            raise ConfigError("SafetyMonitor: call reset before step")
        observation, reward, terminated, truncated, info = self.env.step(action)
        told = self._judge.step(self._probe.read(self._source.action(action)))
        info = {**info, **self._said(self._judge, told)}
        violated = any(state.violations for state in info["safety"].values())
        terminated = bool(terminated) or (self._stop and violated)
        return observation, reward, terminated, truncated, info

    def close(self) -> None:
        """Listen to nothing any more, and close the environment."""
        self._source.leave()
        super().close()

    def warnings(self, action: Any, pace: float = 1.0) -> list[EarlyWarning]:
        """The violations that are near if an action is taken next, the most urgent first: a shield
        asks before it passes one on.

        Args:
            action: as the environment behind all wrappers takes it (A,).
            pace: share of its present speed that it tells the robot to keep; 1 if that is not
                known.

        Raises:
            ConfigError: before the first reset, if no warnings are wanted, or if the action or the
                pace is none.
        """
        if self._horizon is None:
            raise ConfigError("SafetyMonitor: give it a horizon in seconds, as 0.25, for warnings")
        if self._probe is None or self._judge is None:
            raise ConfigError("SafetyMonitor: call reset before warnings")
        with _refused():
            commands = self._probe.commands(np.asarray(action, float).ravel())
            return self._judge.warnings(commands, pace, self._horizon)

    def verdicts(self) -> dict[str, Any]:
        """The verdicts if the episode ended now, by property: one for each instance.

        Raises:
            ConfigError: before the first reset.
        """
        if self._judge is None:
            raise ConfigError("SafetyMonitor: call reset before verdicts")
        return dict(self._judge.verdicts())

    def _said(self, judge: LiveJudge, told: Mapping[str, Sequence[StepVerdict]]) -> dict[str, Any]:
        before = frozenset(self._unsafe)
        expected = [] if self._horizon is None else judge.warnings(horizon=math.inf)
        left = {} if self._horizon is None else soonest(told, expected)
        safety = {
            name: self._state(judge, name, instances, left.get(name))
            for name, instances in told.items()
        }
        cost = sum(
            step_cost(self._weights[name], (name, number) not in before, self._dt)
            for name, number in self._unsafe
        )
        near = [one for one in expected if one.last_chance <= (self._horizon or 0.0)]
        return {"safety": safety, "cost": float(cost), "warnings": near}

    def _state(
        self, judge: LiveJudge, name: str, instances: Sequence[StepVerdict], left: float | None
    ) -> PropertyState:
        new = []
        for number, verdict in enumerate(instances):
            if not verdict.unsafe:
                self._unsafe.discard((name, number))
            elif (name, number) not in self._unsafe:
                self._unsafe.add((name, number))
                bad = verdict.state_class is StateClass.FALSE
                measured = judge.evidence(name, number)
                reason = measured[0] if measured else "bad prefix" if bad else "overdue"
                new.append(NewViolation(self._rows[name][number], reason))
        worst = min((v.state_class for v in instances), key=_WORST.index)
        unsafe = any(v.unsafe for v in instances)
        return PropertyState(worst.value, unsafe, tuple(new), left)


@contextlib.contextmanager
def _refused() -> Iterator[None]:
    """What is no value that something can have is an error of whoever gave it."""
    try:
        yield
    except ValueError as error:
        raise ConfigError(f"SafetyMonitor: {error}") from None


def _task(task: str | Task | Binding, defined: Definitions) -> Task | Binding:
    if not isinstance(task, str):
        return task
    if task not in defined.tasks:
        hint = did_you_mean(task, defined.tasks, "safemanip tasks")
        raise ConfigError(f"unknown task {task!r}; {hint}; name its folder as tasks=")
    return defined.tasks[task]


def _properties(
    asked: str | Sequence[str | Property] | None, task: Task | Binding, defined: Definitions
) -> list[Property]:
    """Those that are asked for, each once: by its id whatever the task, by any other selector of
    those that apply to the task.
    """
    if asked is None:
        if isinstance(task, Binding):
            raise ConfigError("SafetyMonitor: name the properties of a binding")
        asked = ("default",)
    given = parse_names(asked) if isinstance(asked, str) else asked
    found: dict[str, Property] = {}
    for one in given:
        if isinstance(one, Property):
            found[one.id] = one
        elif one in defined.properties:
            found[one] = defined.properties[one]
        else:
            found |= _selected(one, task, defined)
    if not found:
        raise ConfigError(f"SafetyMonitor: properties: {asked!r} selects none for this task")
    return list(found.values())


def _selected(selector: str, task: Task | Binding, defined: Definitions) -> dict[str, Property]:
    """The properties of a selector that apply to a task, by id."""
    known = defined.properties
    wanted = select_properties(known, (selector,), "SafetyMonitor: properties")
    if isinstance(task, Task):
        return {name: known[name] for name in applicable(task, defined.everywhere, wanted)}
    return {name: rule for name, rule in known.items() if name in wanted and rule.rows(task)}
