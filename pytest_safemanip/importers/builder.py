"""Recordings from a MuJoCo model and states."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip import resources
from pytest_safemanip.errors import ConfigError, TraceError, did_you_mean, printable
from pytest_safemanip.importers.base import DRIFT_LIMIT
from pytest_safemanip.importers.commands import infer_commands, keep_on, motion_of
from pytest_safemanip.importers.resimulation import Resimulation, State
from pytest_safemanip.rollouts.loop import settling
from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.mujoco.describing import describe
from pytest_safemanip.sim.mujoco.layout import Layout
from pytest_safemanip.sim.mujoco.reading import Reader
from pytest_safemanip.spec.objects import load_attributes
from pytest_safemanip.spec.task import OBJECTS_FILE
from pytest_safemanip.spec.tasks import TASK_NAME
from pytest_safemanip.trace.elements import Switch
from pytest_safemanip.trace.episode import POLICY_NAME, Episode
from pytest_safemanip.trace.recording import Recording, check
from pytest_safemanip.trace.steps import Step, Steps

Floats = NDArray[np.float64]

MOST_STATES = 1_000_000
STEPS = (1e-5, 0.05)
"""Shortest and longest physics step, s."""
LONGEST_GAP = 1.0
"""Longest time between two states, s: after that, physics alone does not know what happened."""


@dataclass(frozen=True)
class About:
    """What a recording says of itself.

    Attributes:
        task: its name; verdicts come from the task of this name.
        policy: who acted, as it stands in reports and file names.
        seed: tells the rollouts of one task and policy apart.
        instruction: in words.
        backend: the simulator that the states are of.
        origin: where they come from; what is measured is added to it.
    """

    task: str
    policy: str = "demonstration"
    seed: int = 0
    instruction: str = ""
    backend: str = "mujoco"
    origin: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class States:
    """The states of an episode, and what is known beside them.

    Attributes:
        times: s, increasing (T,). They need not be even: what is recorded is, and physics fills in
            what lies between.
        qpos: MuJoCo's positions (T, nq).
        qvel: MuJoCo's velocities (T, nv).
        actions: the action that was executed from each state on (T, A), in the order of the
            layout's; None if nobody knows.
        success: whether the task's own check held (T,); None if it held at the last state only.
        switches: whether each of the builder's switches was on (T, S); None if it has none.
    """

    times: Floats
    qpos: Floats
    qvel: Floats
    actions: Floats | None = None
    success: NDArray[np.bool_] | None = None
    switches: NDArray[np.bool_] | None = None

    def __len__(self) -> int:
        return len(self.times)

    def at(self, index: int) -> State:
        """One of them."""
        return State(self.qpos[index], self.qvel[index])


@dataclass
class _Drift:
    """How far physics is from the next state, when it has been simulated from the one before.

    Attributes:
        hands: the largest distance of a hand, m.
        every: distances of all objects after all intervals, m.
        worst: the largest of them, whose and when, s.
    """

    hands: float = 0.0
    every: list[float] = field(default_factory=list)
    worst: tuple[float, str, float] = 0.0, "", 0.0

    def note(self, hands: Floats, objects: Floats, names: Sequence[str], time: float) -> None:
        """Take note of distances after an interval."""
        self.hands = max(self.hands, *hands.tolist(), 0.0)
        self.every += objects.tolist()
        found = max(zip(objects.tolist(), names, strict=True), default=(0.0, ""))
        self.worst = max(self.worst, (*found, time))

    def facts(self) -> dict[str, str]:
        """For the recording's header."""
        distance, name, time = self.worst
        return {
            "drift": f"{1000 * distance:.1f} mm" + (f" ({name} at {time:.2f} s)" if name else ""),
            "drift_median": f"{1000 * float(np.median(self.every or [0.0])):.3f} mm",
            "drift_hands": f"{1000 * self.hands:.3f} mm",
        }


class RecordingBuilder:
    """Makes recordings from states of a MuJoCo model.

    Poses are those of the states. Contacts and forces come from physics: from each state on, the
    time to the next one is simulated again, with the robot led to it.

    Args:
        model: a ``mujoco.MjModel``.
        layout: what is what in it.
        tail: whether the scene is simulated until it rests, after the last state, with the robot
            held. Without it, what physics still owes at the end is unresolved.
        drift_limit: the largest distance, m, that an object may be from its next state.
        switches: of fixtures, that states say on or off.
        categories: of objects, which have a row in an ``objects.yaml`` of yours, beside the shipped
            ones.

    Raises:
        ConfigError: if the layout names what the model does not have, or a category without a row.
    """

    def __init__(
        self,
        model: Any,
        layout: Layout,
        *,
        tail: bool = True,
        drift_limit: float = DRIFT_LIMIT,
        switches: Sequence[Switch] = (),
        categories: Collection[str] = (),
    ) -> None:
        _check_categories(layout, categories)
        self._model, self._layout, self._switches = model, layout, switches
        self._tail, self._limit = tail, drift_limit

    def build(
        self,
        states: States,
        about: About,
        progress: Callable[[int, int], None] = lambda done, total: None,
    ) -> Recording:
        """The recording of an episode.

        Args:
            states: at least two.
            about: what it says of itself.
            progress: called with the states so far and how many there are.

        Raises:
            ConfigError: if the layout names what the model does not have, or the episode is of a
                task or a policy that cannot be called so.
            TraceError: if states do not fit the model, time goes back or stands still for long, or
                physics drifts farther from them than the limit.
        """
        _check_names(about)
        _check(states, self._model, len(self._switches))
        _check_period(self._layout.control_period, self._model.opt.timestep)
        build = _Build(self._model, self._layout, self._switches, states, self._limit)
        return build.recording(about, self._tail, progress)


class _Build:
    """One recording being built."""

    def __init__(
        self,
        model: Any,
        layout: Layout,
        switches: Sequence[Switch],
        states: States,
        limit: float,
    ) -> None:
        self._model, self._layout, self._states, self._limit = model, layout, states, limit
        start = mujoco.MjData(model)
        start.qpos[:] = states.qpos[0]
        mujoco.mj_fwdPosition(model, start)
        self._at = 0
        read = [(switch, partial(self._is_on, place)) for place, switch in enumerate(switches)]
        description = describe(model, start, layout, read)
        self._physics = Resimulation(model, layout, description)
        self._reader = Reader(model, self._physics.data, lambda _: description)
        self._sampler = ContactSampler(model, description.table)
        self._info = description
        since = states.times - states.times[0]
        self._ticks = np.round(since / model.opt.timestep).astype(int)
        self._commands = self._told()
        self._drift = _Drift()

    def recording(
        self, about: About, tail: bool, progress: Callable[[int, int], None]
    ) -> Recording:
        states, layout = self._states, self._layout
        steps, actions = [self._first()], [np.zeros(len(layout.actions))]
        for step, index in self._acting(progress):
            steps.append(step)
            actions.append(self._action(index))
        if states.success is None:
            steps[-1] = dataclasses.replace(steps[-1], success=True)
        acting = len(steps)
        if tail:
            for step in self._settle(steps):
                steps.append(step)
                actions.append(actions[-1])
        stacked = Steps.stack(steps, [a.astype(np.float32) for a in actions], acting)
        success = bool(stacked.success[acting - 1])
        digest = hashlib.sha256(states.qpos.tobytes() + states.qvel.tobytes()).hexdigest()[:16]
        episode = Episode(
            task=about.task,
            seed=about.seed,
            policy=about.policy,
            instruction=about.instruction,
            horizon=acting,
            ended="success" if success else "policy",
            backend=about.backend,
            scenes="imported",
            stepping="exact",
            assets="official",
            versions={"mujoco": mujoco.__version__},
            hashes={"start": self._reader.fingerprint(), "states": digest},
            served={},
            origin={**about.origin, **self._drift.facts()},
        )
        return check(Recording(episode, self._info.scene, stacked))

    def _told(self) -> Floats:
        """Commands to the grippers from each state on (T, G)."""
        states, hands = self._states, self._layout.robot.hands
        names = [entry.name for entry in self._layout.actions]
        columns = []
        for place, hand in zip(self._info.hands, hands, strict=True):
            if not hand.joints:  # a tool
                columns.append(np.zeros(len(states)))
                continue
            way = place.opened - place.closed
            opening = ((states.qpos[:, place.qpos] - place.closed) / way).mean(axis=1)
            if states.actions is None or hand.spec.entry not in names:
                columns.append(infer_commands(states.times, opening))
                continue
            values = states.actions[:, names.index(hand.spec.entry)]
            told = keep_on(np.array([hand.spec.command(value) for value in values]))
            motion = motion_of(states.times, opening)
            if motion.any() and (told == -motion)[motion != 0].mean() > 0.5:
                raise TraceError(
                    f"gripper {hand.spec.name!r} opens when {hand.spec.entry} tells it to close: "
                    "name the entry and its values in --bindings"
                )
            columns.append(told)
        return np.array(columns).reshape(len(hands), len(states)).T

    def _action(self, index: int) -> Floats:
        if self._states.actions is not None:
            row: Floats = self._states.actions[index]
            return row
        told = {
            hand.spec.entry: command
            for hand, command in zip(self._layout.robot.hands, self._commands[index], strict=True)
        }
        return np.array([told.get(entry.name, 0.0) for entry in self._layout.actions])

    def _first(self) -> Step:
        """The first state, with what touches in it."""
        now, then = self._states.at(0), self._states.at(1)
        next(self._physics.run(now, then, int(self._ticks[1]), self._commands[0]))
        self._sampler.sample(self._physics.data)
        self._physics.put(now)
        still = np.zeros(len(self._info.hands))
        return self._reader.read(self._succeeded(0), self._sampler.take(), still)

    def _acting(self, progress: Callable[[int, int], None]) -> Iterator[tuple[Step, int]]:
        """The steps after the first, each with the index of the state whose action led to it."""
        states, data, ticks = self._states, self._physics.data, self._ticks
        period = max(1, round(self._layout.control_period / self._model.opt.timestep))
        for index in range(len(states) - 1):
            progress(index + 1, len(states))
            now, then = states.at(index), states.at(index + 1)
            first, last = int(ticks[index]), int(ticks[index + 1])
            commands = self._commands[index]
            run = self._physics.run(now, then, last - first, commands)
            for tick, _ in enumerate(run, first + 1):
                self._sampler.sample(data)
                if tick == last:
                    self._measure(index + 1)
                if tick % period == 0:
                    self._at = index + 1 if tick == last else index
                    success = self._succeeded(self._at)
                    yield self._reader.read(success, self._sampler.take(), commands), index

    def _is_on(self, switch: int) -> tuple[bool]:
        rows = self._states.switches
        return (rows is not None and bool(rows[self._at, switch]),)

    def _succeeded(self, index: int) -> bool:
        success = self._states.success
        return success is not None and bool(success[index])

    def _measure(self, index: int) -> None:
        """Compare where things are with where they were recorded to be, and put them there."""
        model, data, info = self._model, self._physics.data, self._info
        places = []
        for _ in range(2):
            mujoco.mj_kinematics(model, data)
            hands = np.array([hand.pose(data)[:3] for hand in info.hands]).reshape(-1, 3)
            places.append((hands, data.xpos[info.object_body].copy()))
            self._physics.put(self._states.at(index))
        hands, objects = (
            np.linalg.norm(simulated - recorded, axis=1)
            for simulated, recorded in zip(*places, strict=True)
        )
        time = float(self._states.times[index] - self._states.times[0])
        self._drift.note(hands, objects, [body.entity for body in info.scene.bodies], time)
        distance, name, when = self._drift.worst
        if distance > self._limit:
            raise TraceError(
                f"after {when:.2f} s, physics has taken {name} {1000 * distance:.0f} mm from where "
                f"it is recorded, more than the limit of {1000 * self._limit:.0f} mm: is this the "
                "model of these states?"
            )

    def _settle(self, steps: list[Step]) -> Iterator[Step]:
        """Steps with the robot held, until the scene rests."""
        last, data = self._states.at(len(self._states) - 1), self._physics.data
        robot = State(last.qpos.copy(), np.zeros_like(last.qvel))
        count = max(1, round(self._layout.control_period / self._model.opt.timestep))
        success, commands = steps[-1].success, self._commands[-1]
        self._physics.put(last)
        fingers = self._physics.fingers
        for _ in settling(steps, self._layout.control_period):
            now = State(data.qpos.copy(), data.qvel.copy())
            robot.qpos[fingers] = now.qpos[fingers]
            for _ in self._physics.run(now, robot, count, commands):
                self._sampler.sample(data)
            yield self._reader.read(success, self._sampler.take(), commands)


def _check_names(about: About) -> None:
    for what, pattern in (("task", TASK_NAME), ("policy", POLICY_NAME)):
        name = getattr(about, what)
        if not pattern.fullmatch(name):
            raise ConfigError(f"{printable(repr(name))} is no name of a {what}")


def _check_period(period: float, step: float) -> None:
    """Refuse a control period that is no whole number of physics steps: time would go wrong."""
    steps = round(period / step)
    if not steps or abs(steps * step - period) > 1e-6 * period:
        raise ConfigError(
            f"control_period: {period:g} s is no multiple of the model's physics step, {step:g} s"
        )


def _check_categories(layout: Layout, own: Collection[str]) -> None:
    if all(thing.category in own for thing in layout.objects.values()):
        return
    known = {*load_attributes(resources.folder("tasks") / OBJECTS_FILE), *own}
    for name, thing in layout.objects.items():
        if thing.category not in known:
            raise ConfigError(
                f"object {name!r}: category {thing.category!r} has no row in {OBJECTS_FILE}; "
                f"{did_you_mean(thing.category, known)} (your own: give it a row in an "
                f"{OBJECTS_FILE} beside your tasks, and name it here as categories=)"
            )


def _check(states: States, model: Any, switches: int) -> None:
    shapes = {
        "qpos": (states.qpos, model.nq),
        "qvel": (states.qvel, model.nv),
        **({} if states.actions is None else {"actions": (states.actions, None)}),
        **({"switches": (states.switches, switches)} if states.switches is not None else {}),
    }
    step = model.opt.timestep
    if not STEPS[0] <= step <= STEPS[1]:
        raise TraceError(
            f"the model's physics step is {step:g} s, expected {STEPS[0]} to {STEPS[1]}"
        )
    if switches and states.switches is None:
        raise TraceError("switches: the states do not say which are on")
    count = len(states)
    if not 2 <= count <= MOST_STATES:
        raise TraceError(f"{count} states: there must be 2 to {MOST_STATES}")
    for name, (array, width) in shapes.items():
        if array.ndim != 2 or len(array) != count or width not in (None, array.shape[1]):
            raise TraceError(
                f"{name}: shape {array.shape}, expected ({count}, {width or 'any'}): are these "
                "states of this model?"
            )
    for name, array in (("times", states.times), *((n, a) for n, (a, _) in shapes.items())):
        finite = np.isfinite(array).reshape(count, -1).all(axis=1)
        if not finite.all():
            raise TraceError(f"{name}: not finite at state {int(np.argmin(finite))}")
    gaps = np.diff(states.times)
    if (gaps <= 0).any():
        raise TraceError(f"times: not increasing at state {int(np.argmax(gaps <= 0)) + 1}")
    if (gaps > LONGEST_GAP).any():
        index = int(np.argmax(gaps > LONGEST_GAP))
        raise TraceError(f"times: {gaps[index]:.1f} s without a state after state {index}")
