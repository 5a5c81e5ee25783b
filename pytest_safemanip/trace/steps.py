"""The moving part of a trace: one :class:`Step` per control period, stacked into :class:`Steps`.

World frame, SI units, quaternions ``wxyz``. Poses are position and quaternion (7,), twists are
linear velocity of the frame's origin and angular velocity, both in the world frame (6,).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.trace.scene import Scene

Floats = NDArray[np.float32]
SUSTAINED = 0.02
"""Seconds over which a force is averaged before it is held against a limit: as a force sensor with
a filter of 50 Hz does. What a solver makes of a blow in a single substep depends on the length of
the substep and on the stiffness of the contact; its impulse does not."""


@dataclass(frozen=True)
class Contacts:
    """Contact points between parts of different entities, one row each, sorted by step.

    A row's ``force`` is what the point carries at the end of the step; ``sustained`` is the largest
    mean, over :data:`SUSTAINED`, of the normal force of its pair of parts: of all spans of that
    length that end within the step. A pair that touched only between two steps has one row with
    ``force`` 0, where it pressed most.

    Attributes:
        step: index of the step (R,).
        a: index of the first part (R,).
        b: index of the second part (R,).
        force: normal force of the point, N (R,).
        sustained: the pair's largest mean normal force, N (R,).
        position: world frame, m (R, 3).
        normal: unit vector from ``a`` to ``b``, world frame (R, 3).
    """

    step: NDArray[np.int32]
    a: NDArray[np.int32]
    b: NDArray[np.int32]
    force: Floats
    sustained: Floats
    position: Floats
    normal: Floats

    def __len__(self) -> int:
        return len(self.step)

    @classmethod
    def empty(cls) -> Contacts:
        """No contact at all."""
        i, f, v = np.zeros(0, np.int32), np.zeros(0, np.float32), np.zeros((0, 3), np.float32)
        return cls(i, i, i, f, f, v, v)

    @classmethod
    def concatenate(cls, per_step: Sequence[Contacts]) -> Contacts:
        """The contacts of consecutive steps, renumbered from 0."""
        columns = {
            field.name: np.concatenate([getattr(c, field.name) for c in per_step])
            for field in dataclasses.fields(cls)
            if field.name != "step"
        }
        lengths = [len(c) for c in per_step]
        return cls(step=np.repeat(np.arange(len(per_step), dtype=np.int32), lengths), **columns)

    def span(self, first: int, stop: int) -> tuple[int, int]:
        """The range of rows of steps ``first`` to ``stop - 1``, as start and stop."""
        # Numbers of another type would have numpy convert all rows.
        begin, end = np.searchsorted(self.step, np.array((first, stop), self.step.dtype)).tolist()
        return begin, end

    def window(self, first: int, stop: int) -> Contacts:
        """The contacts of steps ``first`` to ``stop - 1``, renumbered from 0."""
        lo, hi = self.span(first, stop)
        columns = {f.name: getattr(self, f.name)[lo:hi] for f in dataclasses.fields(self)}
        columns["step"] = columns["step"] - np.int32(first)
        return Contacts(**columns)


@dataclass(frozen=True)
class Step:
    """The state after one control period, and the contacts within it.

    Twists and rates are what the simulator holds for them; where a source has none they are 0. They
    may chatter at rest: the loop and policies read them, propositions take rates from poses.

    Attributes:
        eef_poses: end effector of each gripper (G, 7).
        eef_twists: their twists (G, 6).
        openings: opening of each gripper (0 closed, 1 open) and its rate in 1/s, as the simulator
            has it (G, 2).
        commands: what each gripper was told in this control period: above 0 to close, below 0 to
            open (G,). 0 after reset.
        base_pose: mobile base (7,).
        object_pose: movable objects (N, 7).
        object_twist: their twists (N, 6).
        joint: openness of each joint (0 closed, 1 open) and its rate in 1/s, likewise (J, 2).
        box_pose: interiors, handles, controls and water of fixtures (B, 7).
        switch: 1 where a switch is on, else 0 (S,).
        qpos: raw simulator positions (nq,), for replay and rendering.
        qvel: raw simulator velocities (nv,).
        success: whether the task's own check holds.
        contacts: of this step only.
        camera_pose: cameras (C, 7), none where the scene has none: they look along -z, y is up.
        particles: places of the liquids' particles, likewise (P, 3).
    """

    eef_poses: Floats
    eef_twists: Floats
    openings: Floats
    commands: Floats
    base_pose: Floats
    object_pose: Floats
    object_twist: Floats
    joint: Floats
    box_pose: Floats
    switch: Floats
    qpos: Floats
    qvel: Floats
    success: bool
    contacts: Contacts
    camera_pose: Floats = field(default_factory=lambda: np.zeros((0, 7), np.float32))
    particles: Floats = field(default_factory=lambda: np.zeros((0, 3), np.float32))

    @property
    def eef_pose(self) -> Floats:
        """The end effector of a robot with one gripper (7,); ValueError with another number."""
        return only(self.eef_poses, 0)

    @property
    def eef_twist(self) -> Floats:
        """Its twist (6,); ValueError likewise."""
        return only(self.eef_twists, 0)

    @property
    def gripper(self) -> Floats:
        """Opening of the one gripper, and its rate in 1/s (2,); ValueError likewise."""
        return only(self.openings, 0)


def only(array: Floats, axis: int) -> Floats:
    """The entry of an array for the one gripper.

    Raises:
        ValueError: if the robot has another number of them.
    """
    if array.shape[axis] != 1:
        raise ValueError(f"the robot has {array.shape[axis]} grippers: say which of them is meant")
    return array[(slice(None),) * axis + (0,)]


def _stacked(arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Arrays under one another; of one alone, it is a view."""
    return arrays[0][None] if len(arrays) == 1 else np.stack(arrays)


ARRAYS = tuple(f.name for f in dataclasses.fields(Step) if f.name not in ("success", "contacts"))
"""Names of the float arrays of a step."""


def array_shapes(scene: Scene) -> dict[str, tuple[int, ...]]:
    """Shape of each array of a step in a scene; ``qpos`` and ``qvel`` are free (-1)."""
    n, j, b, g = (len(of) for of in (scene.bodies, scene.joints, scene.boxes, scene.grippers))
    return {
        "eef_poses": (g, 7),
        "eef_twists": (g, 6),
        "openings": (g, 2),
        "commands": (g,),
        "base_pose": (7,),
        "object_pose": (n, 7),
        "object_twist": (n, 6),
        "joint": (j, 2),
        "box_pose": (b, 7),
        "switch": (len(scene.switches),),
        "camera_pose": (len(scene.cameras), 7),
        "particles": (sum(liquid.count for liquid in scene.liquids), 3),
        "qpos": (-1,),
        "qvel": (-1,),
    }


class Deferred:
    """An array of :class:`Steps` that may be given as a function: called once, when it is read."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __set__(self, steps: Steps, value: Floats | Callable[[], Floats]) -> None:
        vars(steps)[self._name] = value

    def __get__(self, steps: Steps | None, owner: type) -> Floats:
        if steps is None:
            raise AttributeError(self._name)  # the field has no default
        if self.waits(steps):
            vars(steps)[self._name] = vars(steps)[self._name]()
        array: Floats = vars(steps)[self._name]
        return array

    def waits(self, steps: Steps) -> bool:
        """Whether the array was given as a function that has not been called yet."""
        return callable(vars(steps)[self._name])


@dataclass(frozen=True, kw_only=True)
class Steps:
    """All steps of a rollout: the arrays of :class:`Step` with time in front.

    Step 0 is the state after reset, before any action; ``action[t]`` led to step ``t``
    (``action[0]`` is zero).

    Attributes:
        eef_twists: like ``object_twist``, ``base_pose``, ``qpos`` and ``qvel`` it is read by no
            proposition and no metric, but by policies, replay and rendering: it may be
            :class:`Deferred`.
        action: the backend's own action vector (T, A).
        success: the task's own check (T,).
        tail: steps of the settle tail, in which the robot holds still (T,).
        contacts: of all steps.
    """

    eef_poses: Floats
    eef_twists: Deferred = Deferred()
    openings: Floats
    commands: Floats
    base_pose: Deferred = Deferred()
    object_pose: Floats
    object_twist: Deferred = Deferred()
    joint: Floats
    box_pose: Floats
    switch: Floats
    camera_pose: Floats
    particles: Floats
    qpos: Deferred = Deferred()
    qvel: Deferred = Deferred()
    action: Floats
    success: NDArray[np.bool_]
    tail: NDArray[np.bool_]
    contacts: Contacts

    def __len__(self) -> int:
        return len(self.success)

    @property
    def eef_pose(self) -> Floats:
        """The end effector of a robot with one gripper (T, 7); ValueError with another number."""
        return only(self.eef_poses, 1)

    @property
    def eef_twist(self) -> Floats:
        """Its twist (T, 6); ValueError likewise."""
        return only(self.eef_twists, 1)

    @property
    def gripper(self) -> Floats:
        """Opening of the one gripper, and its rate in 1/s (T, 2); ValueError likewise."""
        return only(self.openings, 1)

    def deferred(self, name: str) -> bool:
        """Whether a field is an array that nobody has read yet."""
        field = vars(Steps).get(name)
        return isinstance(field, Deferred) and field.waits(self)

    def __iter__(self) -> Iterator[tuple[Step, Floats, bool]]:
        """The steps one by one, as they were recorded: state, action that led to it, acting."""
        for t in range(len(self)):
            arrays = {name: getattr(self, name)[t] for name in ARRAYS}
            contacts = self.contacts.window(t, t + 1)
            step = Step(**arrays, success=bool(self.success[t]), contacts=contacts)
            yield step, self.action[t], not self.tail[t]

    @classmethod
    def stack(cls, steps: Sequence[Step], actions: Sequence[Floats], acting: int) -> Steps:
        """Stack recorded steps.

        Args:
            steps: at least one.
            actions: the action that led to each step, zeros for the first.
            acting: number of steps before the settle tail.
        """
        arrays = {name: _stacked([getattr(s, name) for s in steps]) for name in ARRAYS}
        return cls(
            **arrays,
            action=_stacked(actions).astype(np.float32),
            success=np.array([s.success for s in steps], bool),
            tail=np.arange(len(steps)) >= acting,
            contacts=Contacts.concatenate([s.contacts for s in steps]),
        )

    def window(self, first: int, stop: int) -> Steps:
        """Steps ``first`` to ``stop - 1`` as views."""
        arrays = {
            f.name: getattr(self, f.name)[first:stop]
            for f in dataclasses.fields(self)
            if f.name != "contacts"
        }
        return Steps(**arrays, contacts=self.contacts.window(first, stop))
