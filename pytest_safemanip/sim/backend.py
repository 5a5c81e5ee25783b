"""The interface of simulator backends."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, RolloutError, did_you_mean, raised_as
from pytest_safemanip.sim.staging import Change
from pytest_safemanip.trace.elements import ActionEntry, Gripper, Vector
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step

Action = NDArray[np.float64]
LONGEST_CHUNK = 10_000
"""Actions that a policy asks for at a time."""


@dataclass(frozen=True)
class ActionSpec:
    """The action space of a robot.

    Attributes:
        entries: names and limits of its numbers, in their order.
        hold: given the actions so far, oldest first, the one that keeps the robot still, its
            grippers as they are.
        random: draws an action for a step, by its number; None for any within the limits.
        modes: names of the entries that say what others mean.
    """

    entries: tuple[ActionEntry, ...]
    hold: Callable[[Sequence[Action]], Action]  # each (A,)
    random: Callable[[np.random.Generator, int], Action] | None = None
    modes: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """Number of entries."""
        return len(self.entries)

    @cached_property
    def low(self) -> Action:
        """Least values (A,)."""
        return np.array([entry.low for entry in self.entries])

    @cached_property
    def high(self) -> Action:
        """Largest values (A,)."""
        return np.array([entry.high for entry in self.entries])

    def index(self, name: str) -> int:
        """Place of an entry.

        Raises:
            ValueError: if there is none of this name.
        """
        return [entry.name for entry in self.entries].index(name)

    def sample(self, random: np.random.Generator, step: int) -> Action:
        """A random action for a step."""
        if self.random is not None:
            return self.random(random, step)
        return random.uniform(self.low, self.high)

    def chunk(self, answer: Any, where: str) -> Action:
        """What a policy asks for, as finite actions (H, A).

        Args:
            answer: one action (A,), or H in a row.
            where: begins the message if it is none.

        Raises:
            RolloutError: if it has another shape, or an entry is not a finite number.
        """
        with raised_as(RolloutError, f"{where}: the action is not an array"):
            given = np.asarray(answer)
        masked = isinstance(answer, np.ma.MaskedArray)
        if given.dtype.kind not in "biuf" or masked:
            kind = "masked entries" if masked else f"the type {given.dtype}"
            raise RolloutError(f"{where}: the action is not an array of numbers (it has {kind})")
        rows = np.atleast_2d(given)
        if rows.ndim != 2 or rows.shape[1] != self.size or not 0 < len(rows) <= LONGEST_CHUNK:
            raise RolloutError(
                f"{where}: the action has shape {given.shape}, expected ({self.size},) or "
                f"(H, {self.size}): return all entries from {self.entries[0].name} to "
                f"{self.entries[-1].name}, of one step or of H in a row, at most {LONGEST_CHUNK}"
            )
        actions: Action = rows.astype(np.float64)
        bad = np.argwhere(~np.isfinite(actions))
        if len(bad):
            row, entry = bad[0]
            raise RolloutError(
                f"{where}: action[{row}, {entry}] ({self.entries[entry].name}) is not finite"
            )
        return actions


@dataclass(frozen=True)
class GripperSpec:
    """A gripper as its backend declares it.

    Attributes:
        name: unique among the robot's grippers.
        fingers: names of the robot's parts in each finger group, at least two groups; none of a
            tool that holds nothing.
        palm: names of the other parts of the hand.
        entry: name of the entry of the action that commands it; empty for a tool that holds nothing
            and is not told anything.
        opens: value of that entry that opens it.
        closes: value that closes it.
    """

    name: str
    fingers: tuple[tuple[str, ...], ...]
    palm: tuple[str, ...]
    entry: str
    opens: float = -1.0
    closes: float = 1.0

    def command(self, value: float) -> float:
        """The command that a value of its entry means: 1 closes, -1 opens, 0 is half way."""
        middle, reach = 0.5 * (self.closes + self.opens), 0.5 * (self.closes - self.opens)
        return (value - middle) / reach

    def in_scene(self, half: Vector, centre: Vector) -> Gripper:
        """The gripper of a scene.

        Args:
            half: half extents of the hand's box (3,), m.
            centre: centre of that box in the end effector's frame (3,), m.
        """
        return Gripper(self.name, self.fingers, self.palm, half, centre)


@dataclass(frozen=True)
class RobotSpec:
    """The robot of a backend.

    Attributes:
        name: its model.
        actions: its action.
        grippers: its hands, any number.
    """

    name: str
    actions: ActionSpec
    grippers: tuple[GripperSpec, ...]

    def commands(self, action: Action) -> Action:
        """The commands of an action to the grippers: above 0 closes, below 0 opens (G,)."""
        place = self.actions.index
        return np.array(
            [g.command(float(action[place(g.entry)])) if g.entry else 0.0 for g in self.grippers]
        )

    def pace(self, action: Action, before: Sequence[Action]) -> float:
        """Share of its present speed that an action tells the robot to keep, at most 1: how far it
        is from holding still, grippers aside, over how far the last one was; 1 where it is in
        another mode.

        Args:
            action: the next one (A,).
            before: those so far, oldest first.
        """
        modes = [self.actions.index(name) for name in self.actions.modes]
        if not before or (action[modes] != before[-1][modes]).any():
            return 1.0
        others = {*self.actions.modes, *(gripper.entry for gripper in self.grippers)}
        moves = [k for k, e in enumerate(self.actions.entries) if e.name not in others]
        hold = self.actions.hold
        now, last = (
            float(np.linalg.norm((told - still)[moves]))
            for told, still in ((action, hold(before)), (before[-1], hold(before[:-1])))
        )
        return min(now / last, 1.0) if last > 0.0 else 1.0


@dataclass(frozen=True)
class Camera:
    """An image of an observation.

    Attributes:
        name: its key in the observation.
        width: pixels.
        height: pixels.
    """

    name: str
    width: int
    height: int


USUAL_PERIOD = 0.05
"""Seconds from step to step in RoboCasa, LIBERO and robosuite."""


@dataclass(frozen=True)
class BackendSpec:
    """Declaration of a backend, known before anything is simulated.

    Attributes:
        robot: the robot that it simulates.
        scenes: the families of scenes that it has; the first is that of policies that run here,
            and the one that a task's section ``compact`` is about.
        official: those of them that results are compared in.
        cameras: the images of an observation.
        state: the other arrays of an observation, by name, and their length.
        instruction: key of the instruction in what a policy sees.
        steppings: the ways to step it, see :class:`Request`; the first is the usual one.
        can: what of an episode may be asked otherwise: kinds of changes, see
            :data:`~pytest_safemanip.sim.staging.KINDS`; ``objects``, ``kitchen`` and ``style`` of a
            :class:`Request`; ``forces`` where it :class:`~pytest_safemanip.sim.pushing.Pushes`.
        kitchens: values that ``kitchen`` of a request may have, by family of scenes.
        styles: likewise ``style``.
        hand_position: which part of the state is the hand's position in the base's frame, m; empty
            if none is.
        control_period: seconds from step to step, in which bounds of formulas are counted before
            anything is simulated.
        tasks: the declaration in tasks where the robot or what it sees is another, by their names.
    """

    robot: RobotSpec
    scenes: tuple[str, ...]
    official: tuple[str, ...] = ()
    cameras: tuple[Camera, ...] = ()
    state: Mapping[str, int] = field(default_factory=dict)
    instruction: str = "instruction"
    steppings: tuple[str, ...] = ("exact",)
    can: frozenset[str] = frozenset()
    kitchens: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    styles: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    hand_position: str = ""
    control_period: float = USUAL_PERIOD
    tasks: Mapping[str, BackendSpec] = field(default_factory=dict)

    def in_task(self, task: str) -> BackendSpec:
        """The declaration in a task."""
        return self.tasks.get(task, self)

    def check_scenes(self, name: str, what: str) -> None:
        """Refuse scenes that it does not have.

        Args:
            name: of the scenes.
            what: who asks for them, for the error.

        Raises:
            ConfigError: naming those that there are.
        """
        if name not in self.scenes:
            hint = did_you_mean(name, self.scenes)
            raise ConfigError(f"{what}: unknown scenes {name!r}; {hint}")


@dataclass(frozen=True)
class Request:
    """Which episode a backend is to set up.

    Attributes:
        task: the backend's own name of the task.
        seed: decides everything random in the episode.
        scenes: one of the families that the backend has.
        object_groups: for some of the task's objects, by role, the groups or categories to draw
            them from instead of the task's own.
        kitchen: which of the scenes of the family; empty for any.
        style: how it looks, one of the backend's styles; empty for what the scene and the seed say.
        changes: what stands elsewhere or is open when the episode begins.
        stepping: ``exact`` or ``fast``. ``exact`` is the simulator's own control loop, bit for
            bit; ``fast`` may evaluate it in another way, within a tolerance that the backend
            states. A backend with one way to step ignores it.
    """

    task: str
    seed: int
    scenes: str
    object_groups: Mapping[str, Sequence[str]] = field(default_factory=dict)
    kitchen: str = ""
    changes: tuple[Change, ...] = ()
    stepping: str = "exact"
    style: str = ""


@dataclass(frozen=True)
class Start:
    """An episode that is ready to be stepped.

    Attributes:
        scene: its static part.
        step: the state after reset.
        instruction: for the policy.
        horizon: control steps that the task allows.
        fingerprint: digest of the start state; differs between seeds, equal for equal seeds.
        patches: names of what is changed in other people's code.
    """

    scene: Scene
    step: Step
    instruction: str
    horizon: int
    fingerprint: str
    patches: tuple[str, ...] = ()


@dataclass(frozen=True)
class Provenance:
    """Versions and settings of a backend that decide the content of a recording.

    Attributes:
        backend: its name.
        assets: ``official``, ``primitive`` or ``mixed``.
        versions: of the packages that move the physics.
        hashes: digests of its code and of its assets.
        description: one line for people; decides nothing.
        download: the command that gets the official assets, and how large they are; empty if
            nobody knows.
    """

    backend: str
    assets: str
    versions: Mapping[str, str] = field(default_factory=dict)
    hashes: Mapping[str, str] = field(default_factory=dict)
    description: str = ""
    download: str = ""


@dataclass(frozen=True)
class Options:
    """A user's choices about a backend.

    Attributes:
        assets: ``auto``, ``official`` or ``primitive``.
        logs: folder for what the simulator prints.
        python: interpreter of the simulator's process; empty for this one.
        paths: folders that the backend reads, by its own names for them.
    """

    assets: Literal["auto", "official", "primitive"]
    logs: Path
    python: str = ""
    paths: Mapping[str, Path] = field(default_factory=dict)


class Backend(Protocol):
    """Runs episodes, one after the other.

    The same request gives the same episode, bit for bit, whatever ran before in the process.
    """

    @property
    def spec(self) -> BackendSpec:
        """Its declaration."""

    @property
    def provenance(self) -> Provenance:
        """Versions and settings that decide the content of its recordings."""

    def reset(self, request: Request) -> Start:
        """Set up an episode.

        Raises:
            ConfigError: if no episode can be set up.
            TaskError: if this one cannot begin as its task asks.
            RolloutError: if the simulator fails.
        """

    def step(self, action: NDArray[np.float64]) -> Step:
        """Run one control period.

        Args:
            action: (A,), within the limits of its robot's :class:`ActionSpec`.

        Raises:
            RolloutError: if the simulator fails.
        """

    def observe(self) -> Mapping[str, NDArray[Any]]:
        """The observation of the present step for camera policies, without the instruction.

        Changes nothing in the simulation: with and without it, episodes are equal bit for bit.

        Returns:
            Images (height, width, 3), uint8, RGB, the top row first, and the parts of the state,
            float32, by the names that it declares.

        Raises:
            ConfigError: if nothing can be rendered on this machine.
            RolloutError: if the simulator fails.
        """

    def close(self) -> None:
        """Free what it holds. May be called twice."""


Factory = Callable[[Options], Backend]
"""Makes a backend. Quick: what takes time waits for the first reset.

Raises ConfigError if something that it needs is missing. One that :class:`DescribesTasks` too has
its tasks checked before anything is simulated.
"""


@dataclass(frozen=True)
class FixtureRole:
    """A role that a fixture plays in a task.

    Attributes:
        kinds: what the fixture can be, in the simulator's words; empty if only an episode tells.
        parts: the parts that it can have.
    """

    kinds: tuple[str, ...]
    parts: frozenset[str]


@dataclass(frozen=True)
class TaskDescription:
    """Description of a task, known before it is simulated.

    Attributes:
        fixtures: the fixtures that the task names, by role; an episode may have more.
        object_parts: the parts of an object.
        any_part: the parts that anything in the simulator can have.
        objects: the roles of its objects, for ``fnmatch``; None if only an episode tells.
        other_fixtures: what else may be a fixture's role in an episode, if ``objects`` are known.
        stages: whether its scene can be staged otherwise, or objects drawn from elsewhere.
    """

    fixtures: Mapping[str, FixtureRole]
    object_parts: frozenset[str]
    any_part: frozenset[str]
    objects: tuple[str, ...] | None = None
    other_fixtures: frozenset[str] = frozenset()
    stages: bool = True


@runtime_checkable
class DescribesTasks(Protocol):
    """A backend's factory that knows the simulator's tasks without starting it."""

    def task_names(self) -> frozenset[str]:
        """The names of all its tasks; empty if they cannot be had on this machine."""

    def describe_task(self, task: str) -> TaskDescription:
        """The description of one of :meth:`task_names`."""


@runtime_checkable
class DrawsObjects(Protocol):
    """A backend's factory that knows what objects can be drawn from."""

    def object_kinds(self) -> frozenset[str]:
        """Names of categories and groups; empty if they cannot be had on this machine."""


@dataclass(frozen=True)
class DerivedTask:
    """A task whose binding a backend derives from a file of its simulator's.

    Attributes:
        source: that file.
        binding: the content of a file in ``tasks/``.
    """

    source: Path
    binding: str


@runtime_checkable
class DerivesTasks(Protocol):
    """A backend's factory that derives bindings: its tasks are those, and no others."""

    def derived_tasks(self, options: Options) -> Mapping[str, DerivedTask]:
        """Its tasks, by name; nothing is simulated.

        Raises:
            ConfigError: if what they are read from is missing or wrong.
        """


@dataclass(frozen=True)
class Simulator:
    """A backend that can be chosen by name.

    Attributes:
        spec: what it declares.
        create: makes it.
    """

    spec: BackendSpec
    create: Factory
