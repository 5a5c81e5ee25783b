"""Applies a staging to a RoboCasa environment, and lets objects come to rest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import CannotStage, TaskError, did_you_mean
from pytest_safemanip.sim.mujoco.description import Description
from pytest_safemanip.sim.robocasa.liquids import fill
from pytest_safemanip.sim.robocasa.patches.environments import quick_settling
from pytest_safemanip.sim.robocasa.stepping.exact import Controls
from pytest_safemanip.sim.staging import (
    SHOULDER,
    Add,
    Change,
    Fill,
    Move,
    Posture,
    Push,
    Put,
    SetOpen,
    Store,
)
from pytest_safemanip.trace.geometry import about, corners, matrix, multiply, rotate, to_world
from pytest_safemanip.trace.steps import Step

CLEARANCE = 0.002
"""Above what an object is put onto, m: it falls the rest."""
STAYS_WITHIN = 0.3
"""Of where it was put, m: what comes to rest farther away had no room, or fell off."""
SETTLE_STEPS = 20
"""Control periods of rest afterwards, twice what RoboCasa itself gives a scene at its reset."""
DRIFT, DROP = 0.02, 0.03
"""What is moved or added has to come to rest so near to where it was wanted, level and in height,
and so has everything else to where it stood, m."""

Floats = NDArray[np.float64]


def stage(
    env: Any, description: Description, step: Step, changes: Sequence[Change]
) -> Callable[[Step], None]:
    """Change a scene that was just reset.

    Args:
        env: a RoboCasa environment.
        description: of its scene.
        step: its state.
        changes: in their order; one may build on those before it.

    Returns:
        What is to be called with the state afterwards: raises CannotStage if something that was
        moved or added does not stand where it should, or has pushed away something else.

    Raises:
        TaskError: if the scene has no such role, joint or interior, or what was put somewhere does
            not stay there.
    """
    staged = _Stage(env, description, step)
    # Liquids come last: into where what holds them stands in the end.
    for change in sorted(changes, key=lambda change: isinstance(change, Fill)):
        staged.make(change)
    env.sim.forward()
    _settle(env)
    staged.check_stayed()
    for change in changes:  # what moves does so once all others are at rest
        if isinstance(change, Push):
            staged.push(change)
    env.sim.forward()
    return staged.check


def _settle(env: Any) -> None:
    """Let the scene come to rest while the robot stands, as RoboCasa does at a reset."""
    action = np.zeros(env.action_spec[0].shape)
    with quick_settling(env, Controls):
        for substep in range(SETTLE_STEPS * int(env.control_timestep / env.model_timestep)):
            env.sim.step1()
            env._pre_action(action, substep == 0)
            env.sim.step2()


def turned_across(heading: Floats, half: Floats, axes: Floats) -> Floats:
    """Turn a box about the vertical until its longer level side lies across.

    Args:
        heading: its orientation (4,).
        half: its half extents (3,), m.
        axes: columns are the directions forward, left and up (3, 3).

    Returns:
        Its orientation, that side to the left or the right (4,).
    """
    sides = matrix(heading).T
    level = np.flatnonzero(np.abs(sides @ axes[:, 2]) < np.sqrt(0.5))
    longer = sides[level[np.argmax(half[level])]]
    turn = np.arctan2(longer @ axes[:, 0], longer @ axes[:, 1])
    turned: Floats = multiply(about(axes[:, 2], turn), heading)
    return turned


class _Stage:
    def __init__(self, env: Any, description: Description, step: Step) -> None:
        self._env, self._about, self._step = env, description, step
        self._scene = description.scene
        self._poses = {
            body.entity: np.asarray(pose, np.float64)
            for body, pose in zip(self._scene.bodies, step.object_pose, strict=True)
        }
        frame = matrix(np.asarray(step.base_pose[3:], np.float64))
        self._put: dict[str, Put] = {}
        self._axes = np.stack((frame[:, 0], frame[:, 1], (0.0, 0.0, 1.0)), axis=1)
        self._added = 0
        self._wanted: dict[str, Floats] = {}
        self._stands = dict(self._poses)

    def check(self, step: Step) -> None:
        """See :func:`stage`."""
        if not self._wanted:
            return
        for entity, wanted in {**self._stands, **self._wanted}.items():
            now = step.object_pose[self._scene.object_index[entity]]
            level, up = float(np.linalg.norm(now[:2] - wanted[:2])), float(now[2] - wanted[2])
            if level > DRIFT or abs(up) > DROP:
                what = {own.name: own.category for own in self._scene.entities}[entity]
                raise CannotStage(
                    f"{entity} ({what}) does not stay where it should stand: it came to rest "
                    f"{100 * level:.0f} cm away and {100 * abs(up):.0f} cm "
                    f"{'higher' if up > 0.0 else 'lower'}; something is in the way, or nothing "
                    "below it"
                )

    def make(self, change: Change) -> None:
        """Make a change, but for those of what only cameras see."""
        if isinstance(change, Put | SetOpen | Fill):
            # What lies in a drawer comes along, or is pushed aside; what is poured flows.
            self._stands.clear()
        match change:
            case Put():
                self.put(change)
                self._put[change.role] = change
            case SetOpen():
                self.set_open(change)
            case Move():
                self.move(change)
            case Add():
                self.more(Put(self._next(), "beside", change.beside, (*change.by, 0.0)))
            case Store():
                self.more(self._stored(change))
            case Posture():
                self.pose(change)
            case Fill():
                self.fill(change)

    def move(self, change: Move) -> None:
        """Move an object on its level, and turn it about the middle of its box."""
        entity = self._object(change.role)
        body = self._scene.bodies[self._scene.object_index[entity]]
        pose = self._poses[entity].copy()
        middle = to_world(pose, np.array(body.centre))
        shift = self._axes @ np.array((*change.by, 0.0))
        pose[3:] = multiply(about(self._axes[:, 2], np.radians(change.turn)), pose[3:])
        pose[:3] = middle + shift - rotate(pose[3:], np.array(body.centre))
        pose[2] += CLEARANCE
        self._place(change.role, pose)
        self._wanted[entity] = pose

    def more(self, change: Put) -> None:
        """Put something more, whose role is :meth:`_next`, where it has to stay."""
        self.put(change)
        self._added += 1
        self._wanted[change.role] = self._poses[change.role]

    def _next(self) -> str:
        """The role of what is added next."""
        return f"added_{self._added + 1}"

    def _stored(self, change: Store) -> Put:
        """Where something more stands in a fixture."""
        body = self._scene.bodies[self._scene.object_index[self._next()]]
        heading = np.concatenate((np.zeros(3), self._poses[body.entity][3:]))
        own = corners(heading, body.half, body.centre) @ self._axes[:, 0]
        offset = (float(np.ptp(own)) / 2.0 - change.out, change.left, 0.0)
        return Put(self._next(), "in", change.fixture, offset, interior="*", from_edge=True)

    def pose(self, change: Posture) -> None:
        """Turn the arm's joints; the seed of the episode draws which way."""
        controller = self._env.robots[0].composite_controller.part_controllers["right"]
        index = np.array(controller.qpos_index)
        way = np.random.default_rng(self._env.seed).normal(size=len(index))
        way *= change.size * np.sqrt(len(index)) / np.linalg.norm(way)
        self._env.sim.data.qpos[index] += way

    def put(self, change: Put) -> None:
        """Put an object in, on or beside something; wherever it comes to rest."""
        entity, target = self._object(change.role), self._entity(change.target)
        floor = self._floor(change, target) + self._axes @ np.array(change.offset)
        about_left, about_up = np.radians(change.turn)
        turn = multiply(about(self._axes[:, 2], about_up), about(self._axes[:, 1], about_left))
        body = self._scene.bodies[self._scene.object_index[entity]]
        heading = self._poses[entity][3:]
        if change.across:
            heading = turned_across(heading, np.array(body.half), self._axes)
        pose = np.concatenate((np.zeros(3), multiply(turn, heading)))
        points = corners(pose, body.half, body.centre)
        low, high = points.min(axis=0), points.max(axis=0)
        pose[:2] = floor[:2] - (low + high)[:2] / 2.0
        pose[2] = floor[2] + CLEARANCE - low[2]
        self._place(change.role, pose)

    def check_stayed(self) -> None:
        """Refuse a scene in which something does not rest where it was put."""
        for role, change in self._put.items():
            there = self._poses[self._scene.roles[role]][:3]
            now = self._env.sim.data.get_joint_qpos(self._env.objects[role].joints[0])[:3]
            way = now - there
            if np.linalg.norm(way) > STAYS_WITHIN:
                fell = -way[2] > STAYS_WITHIN
                how = f"fell {-way[2]:.2f} m" if fell else f"moved {np.linalg.norm(way):.2f} m away"
                raise TaskError(
                    f"{role!r} has no room {change.relation} {change.target!r}: it {how} before "
                    "the episode began; put it elsewhere, or something smaller there"
                )

    def set_open(self, change: SetOpen) -> None:
        """Turn doors or controls; what is in a drawer comes along."""
        owner = self._entity(change.role)
        own = self._scene.joints_of(owner)
        named = {self._scene.joints[k].name: k for k in own}
        if change.joint and change.joint not in named:
            hint = did_you_mean(change.joint, named)
            raise TaskError(f"{change.role} has no joint {change.joint!r}; {hint}")
        access = [k for k in own if self._scene.joints[k].gives_access]
        if not change.joint and not access:
            raise TaskError(f"{change.role} has no door or drawer that could be open")
        for k in [named[change.joint]] if change.joint else access:
            address = self._about.joint_qpos[k]
            self._env.sim.data.qpos[address] = change.openness * self._about.joint_open[k]

    def _place(self, role: str, pose: Floats) -> None:
        self._poses[self._object(role)] = pose
        data, joint = self._env.sim.data, self._env.objects[role].joints[0]
        data.set_joint_qpos(joint, pose)
        data.set_joint_qvel(joint, np.zeros(6))

    def push(self, change: Push) -> None:
        self._object(change.role)
        data, joint = self._env.sim.data, self._env.objects[change.role].joints[0]
        velocity = np.zeros(6)
        velocity[:3] = self._axes @ np.append(change.velocity, 0.0)
        data.set_joint_qvel(joint, velocity)

    def fill(self, change: Fill) -> None:
        entity = self._object(change.role)
        body = self._scene.bodies[self._scene.object_index[entity]]
        fill(self._env, change, body, self._poses[entity])

    def _floor(self, change: Put, target: str) -> Floats:
        """From where the offset of what is put onto, beside or into something counts (3,)."""
        if change.relation == "in":
            number = self._interior(target, change.interior)
            floor = self._box_floor(number)
            return floor + self._edge(number) * self._axes[:, 0] if change.from_edge else floor
        if target not in self._poses:
            raise TaskError(f"{target!r} is no object that something is put {change.relation}")
        body = self._scene.bodies[self._scene.object_index[target]]
        points = corners(self._poses[target], body.half, body.centre)
        height = points[:, 2].max() if change.relation == "on" else points[:, 2].min()
        middle: Floats = np.append(points[:, :2].mean(axis=0), height)
        return middle

    def _interior(self, fixture: str, name: str) -> int:
        """The number of the box of an interior, see :class:`Put`."""
        inside = self._scene.boxes_of(fixture, "interior")
        if not inside:
            raise TaskError(f"{fixture} has no interior to put something in")
        if name:
            names = [self._scene.boxes[k].name for k in inside]
            inside = [k for k in inside if fnmatchcase(self._scene.boxes[k].name, name)]
            if not inside:
                raise TaskError(f"{fixture} has no interior {name!r}; {did_you_mean(name, names)}")

        def least(number: int) -> float:
            height = float(self._box_floor(number)[2])
            return abs(height - SHOULDER) if "*" in name else height

        return min(inside, key=least)

    def _box_floor(self, number: int) -> Floats:
        """The middle of the floor of a box (3,)."""
        pose = np.asarray(self._step.box_pose[number], np.float64)
        points = corners(pose, self._scene.boxes[number].half)
        middle: Floats = np.append(pose[:2], points[:, 2].min())
        return middle

    def _edge(self, number: int) -> float:
        """From the middle of the floor of a box ahead to its edge on the robot's side, m: < 0."""
        pose = np.asarray(self._step.box_pose[number], np.float64)
        points = corners(pose, self._scene.boxes[number].half) - pose[:3]
        return float((points @ self._axes[:, 0]).min())

    def _entity(self, role: str) -> str:
        if role not in self._scene.roles:
            raise TaskError(
                f"the scene has no role {role!r}; {did_you_mean(role, self._scene.roles)}"
            )
        return self._scene.roles[role]

    def _object(self, role: str) -> str:
        entity = self._entity(role)
        if entity not in self._poses:
            raise TaskError(f"{role!r} is a fixture; only objects can be put elsewhere")
        return entity
