"""What a robot would touch on a way: the posture by its controller's law, the rest by geoms."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import RolloutError, did_you_mean
from pytest_safemanip.sim.clearance import ROOM, Clearance, Path, Touch
from pytest_safemanip.sim.mujoco.description import Description
from pytest_safemanip.sim.mujoco.osc import Arm, Law
from pytest_safemanip.sim.mujoco.proximity import Near, Proximity
from pytest_safemanip.sim.mujoco.scratch import Scratch
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import conjugate, matrix, multiply, rotate

Floats = NDArray[np.float64]
Goal = tuple[Floats, Floats]

DRIVEN, TURNED = 0.015, math.radians(1.5)
"""How far the base moves in a control step, m and rad: as fast as scripts drive with a load."""
DEEP = 0.02
"""Deeper than this nobody asks how deep, m."""
CLOSER = 0.001
"""By how much nearer what was near from the beginning may come, m."""
RESTING, STILL = 0.02, 4
"""A hand whose joints are no faster, rad/s, for so many control steps, comes no nearer."""


class Foresight:
    """Answers for paths of one episode.

    Args:
        model: its ``MjModel``.
        live: its ``MjData``, which is only read.
        description: of its scene.
        arm: its arm.
        wheels: ids of the joints that move the base ahead, aside and round; empty if it is fixed.
        torso: id of the joint that raises the arm; None if none does.
    """

    def __init__(
        self,
        model: Any,
        live: Any,
        description: Description,
        arm: Arm,
        wheels: tuple[int, ...],
        torso: int | None = None,
    ) -> None:
        self._model, self._arm, self._description = model, arm, description
        self._scratch = Scratch(model, live)
        self._data = self._scratch.data
        self._wheels = model.jnt_qposadr[list(wheels)].astype(np.intp)
        self._axes = list(wheels[:2])
        self._torso = torso
        parts, self._part = description.table.parts, description.table.of_geom
        self._geoms = np.flatnonzero(self._part >= 0)
        owners = [parts[part] for part in self._part[self._geoms]]
        self._names = [(part.entity, part.name) for part in owners]
        bodies = description.scene.bodies
        self._bodies = {
            body.entity: int(at) for body, at in zip(bodies, description.object_body, strict=True)
        }

    def answer(self, path: Path) -> Clearance:
        """What would touch on a path.

        Raises:
            RolloutError: if it names what is not there.
        """
        self._begin(path)
        reach = max(ROOM, path.margin)
        own, others, permitted = self._sides(path)
        self._proximity = Proximity(self._model, self._data, own, others, reach)
        self._start: dict[tuple[int, int], float] = {}
        for near in self._proximity.near():
            pair = near.own, int(self._part[near.other])
            self._start[pair] = min(near.distance, self._start.get(pair, math.inf))
        self._room = math.inf
        short = askew = 0.0
        touch: Near | None = None
        for waypoint in range(len(path.hand)):
            if waypoint == path.since:
                self._proximity.permit(permitted)
            for _ in self._moves(path, waypoint):
                found = self._look(path) if waypoint >= path.begins else None
                if found and (touch is None or found.distance < touch.distance):
                    touch = found
                if touch is not None and -touch.distance > DEEP:
                    break
            if touch is not None:
                break
            short, askew = self._missing(path, waypoint)
            if short or askew:
                break
        position, frame = self._law.pose
        quat = np.empty(4)
        mujoco.mju_mat2Quat(quat, frame.ravel())
        return Clearance(
            waypoint,
            self._named(touch) if touch else None,
            short,
            askew,
            min(self._room, ROOM),
            np.concatenate((position, quat)),
            self._data.qpos[self._arm.qpos].copy(),
        )

    def _begin(self, path: Path) -> None:
        """The present state, the fingers as they are to be."""
        self._scratch.take()
        data = self._data
        if path.raised:
            self._raise(path.raised)
        mujoco.mj_kinematics(self._model, data)
        hand = self._description.hands[0]
        if not math.isnan(path.opening):
            data.qpos[hand.qpos] = hand.closed + path.opening * (hand.opened - hand.closed)
        self._law = Law(self._model, data, self._arm)
        pose = hand.pose(data)
        self._held = []
        for name in path.held:
            if name not in self._bodies:
                raise RolloutError(f"a path with {name!r} held; {did_you_mean(name, self._bodies)}")
            body = self._bodies[name]
            joint = int(self._model.body_jntadr[body])
            back = conjugate(pose[3:])
            local = rotate(back, data.xpos[body] - pose[:3]), multiply(back, data.xquat[body])
            self._held.append((int(self._model.jnt_qposadr[joint]), *local))
        self._place()

    def _raise(self, by: float) -> None:
        """Raise the torso as far as it goes.

        Raises:
            RolloutError: if there is none.
        """
        if self._torso is None:
            raise RolloutError("a path with its torso raised; this robot has none")
        address, limits = self._model.jnt_qposadr[self._torso], self._model.jnt_range[self._torso]
        self._data.qpos[address] = np.clip(self._data.qpos[address] + by, *limits)

    def _place(self) -> None:
        """Kinematics of a posture, with what is held."""
        mujoco.mj_kinematics(self._model, self._data)
        if self._held:
            pose = self._description.hands[0].pose(self._data)
            for address, where, turned in self._held:
                self._data.qpos[address : address + 3] = pose[:3] + rotate(pose[3:], where)
                self._data.qpos[address + 3 : address + 7] = multiply(pose[3:], turned)
            mujoco.mj_kinematics(self._model, self._data)

    def _sides(self, path: Path) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.bool_]]:
        """Geoms that move, the others, and which pairs of them may touch."""
        moves = {ROBOT, *path.held}
        own = [k for k, (entity, _) in enumerate(self._names) if entity in moves]
        others = [k for k, (entity, _) in enumerate(self._names) if entity not in moves]
        permitted = np.zeros((len(own), len(others)), bool)
        for mine, theirs in path.permits:
            rows = [_is(mine, *self._names[k]) for k in own]
            columns = [_meets(theirs, *self._names[k]) for k in others]
            permitted |= np.outer(rows, columns)
        return self._geoms[own], self._geoms[others], permitted

    def _moves(self, path: Path, waypoint: int) -> Iterator[None]:
        """The control steps to a waypoint."""
        base, relative = path.base[waypoint], self._in_base(self._law.pose)
        while not np.isnan(base[0]) and self._drive(base):
            self._law.hold(self._in_world(relative))
            self._place()
            yield
        still, goal = 0, _goal(path, waypoint)
        yield
        for _ in range(path.steps):
            if goal is None or not any(self._missing(path, waypoint)) or still >= STILL:
                break
            self._law.advance(goal, float(path.speed[waypoint]))
            self._place()
            yield
            still = still + 1 if self._law.speed < RESTING else 0

    def _missing(self, path: Path, waypoint: int) -> tuple[float, float]:
        """How far from a waypoint the hand is, m and rad; 0 if it is there."""
        goal = _goal(path, waypoint)
        short, askew = self._law.apart(goal) if goal else (0.0, 0.0)
        there = short < path.tolerance[waypoint] and askew < path.turn_tolerance
        return (0.0, 0.0) if there else (short, askew)

    def _look(self, path: Path) -> Near | None:
        """The deepest touch that counts, now."""
        deepest = None
        for near in self._proximity.near():
            limit = path.margin
            start = self._start.get((near.own, int(self._part[near.other])))
            if start is not None and start < limit + CLOSER:
                limit = start - CLOSER
            else:
                self._room = min(self._room, near.distance)
            if near.distance < limit and (deepest is None or near.distance < deepest.distance):
                deepest = near
        return deepest

    def _named(self, near: Near) -> Touch:
        parts = self._description.table.parts
        own, other = parts[self._part[near.own]], parts[self._part[near.other]]
        x, y, z = near.place.tolist()
        name = own.name if own.entity == ROBOT else own.entity
        return Touch(name, other.entity, other.name, (x, y, z), -near.distance)

    def _in_base(self, pose: Goal) -> Goal:
        body = self._arm.base
        frame = self._data.xmat[body].reshape(3, 3)
        return frame.T @ (pose[0] - self._data.xpos[body]), frame.T @ pose[1]

    def _in_world(self, pose: Goal) -> Goal:
        body = self._arm.base
        frame = self._data.xmat[body].reshape(3, 3)
        return frame @ pose[0] + self._data.xpos[body], frame @ pose[1]

    def _drive(self, goal: Floats) -> bool:
        """Move the base on towards a place and heading (3,); False if it is there."""
        data, body = self._data, self._description.base
        way = goal[:2] - data.xpos[body][:2]
        frame = data.xmat[body].reshape(3, 3)
        turn = (goal[2] - math.atan2(frame[1, 0], frame[0, 0]) + math.pi) % (2 * math.pi) - math.pi
        length = float(np.linalg.norm(way))
        if (length < 1e-4 and abs(turn) < 1e-4) or not len(self._wheels):
            return False
        share = min(1.0, DRIVEN / max(length, 1e-9), TURNED / max(abs(turn), 1e-9))
        there = data.xpos[body][:2] + share * way
        data.qpos[self._wheels[2]] += share * turn
        mujoco.mj_kinematics(self._model, data)
        # A base that turns about another point than its origin is put back.
        axes = data.xaxis[self._axes][:, :2].T
        data.qpos[self._wheels[:2]] += np.linalg.solve(axes, there - data.xpos[body][:2])
        mujoco.mj_kinematics(self._model, data)
        return True


def _goal(path: Path, waypoint: int) -> Goal | None:
    """Where the hand goes; None if it keeps its pose relative to the base."""
    hand = path.hand[waypoint]
    return None if np.isnan(hand[0]) else (hand[:3], np.asarray(matrix(hand[3:]), np.float64))


def _meets(permit: str, entity: str, part: str) -> bool:
    """Whether a permit is for what is met."""
    whose, _, which = permit.partition("/")
    return not permit or (entity == whose and part.startswith(which))


def _is(permit: str, entity: str, part: str) -> bool:
    """Whether a permit is for what moves."""
    return permit in ("", entity) or (entity == ROBOT and part.startswith(permit))
