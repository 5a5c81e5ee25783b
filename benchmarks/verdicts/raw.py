"""What MuJoCo itself says of a rollout while it runs, past the plugin's readers.

States are those of ``MjData.qpos``, forces those of ``mj_contactForce`` at every physics substep,
distances those of ``mj_fwdPosition`` on a copy, in which nothing sleeps. Bodies are told apart by
RoboCasa's names and by their joints.
"""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.mujoco.contacts import ContactSampler

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ROBOT, OBJECT, FLOOR, FIXTURE = range(4)
"""Kinds of bodies."""
SECONDS = 0.02
"""Over which forces are averaged."""
HAND = "gripper0_right_eef"
FINGERS = ("gripper0_right_finger_joint1", "gripper0_right_finger_joint2")


@dataclass
class Raw:
    """A rollout of T control steps with B bodies, N objects and J hinges and slides of fixtures.

    Attributes:
        names: of bodies (B,).
        kinds: of bodies, one of the four above (B,).
        owner: number of the object that a body belongs to, -1 for others (B,).
        moved_by: number of the hinge or slide of a fixture that moves a body, or -1 (B,).
        objects: names of the objects (N,).
        sizes: extents of an object's geoms along the world's axes at step 0, m (N, 3).
        com: centres of mass, m (T, N, 3).
        turn: orientations, wxyz (T, N, 4).
        joints: positions, rad or m (T, J).
        ranges: of the joints (J,).
        fingers: how far the fingers are open, m (T,).
        hand: where the hand is, m, and its orientation, wxyz (T, 7).
        pressed: step and both bodies (R, 3).
        newtons: largest mean normal force over 20 ms of these rows, N (R,).
        met: step and both bodies of what touches when the step ends (M, 3).
        gap: smallest distance of these, m; below 0 where they penetrate (M,).
    """

    names: NDArray[np.str_]
    kinds: Ints
    owner: Ints
    moved_by: Ints
    objects: NDArray[np.str_]
    sizes: Floats
    com: Floats
    turn: Floats
    joints: Floats
    ranges: Floats
    fingers: Floats
    hand: Floats
    pressed: Ints
    newtons: Floats
    met: Ints
    gap: Floats

    def save(self, path: Path) -> None:
        """Write it as a file of arrays."""
        np.savez_compressed(path, **dataclasses.asdict(self))

    @classmethod
    def load(cls, path: Path) -> Raw:
        """Read such a file."""
        with np.load(path, allow_pickle=False) as arrays:
            return cls(**dict(arrays))


class Capture:
    """Takes down one rollout.

    Args:
        model: a ``mujoco.MjModel`` of RoboCasa's.
    """

    def __init__(self, model: Any) -> None:
        self._model, self._copy = model, mujoco.MjData(model)
        roots = model.body_rootid
        self._names = np.array([model.body(body).name for body in range(model.nbody)])
        free = {
            int(model.jnt_bodyid[joint])
            for joint in range(model.njnt)
            if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        }
        self._kinds = np.array([_kind(self._names[root], int(root) in free) for root in roots])
        self._floor_geoms = np.array(["floor" in model.geom(g).name for g in range(model.ngeom)])
        self._kinds[[name.startswith("floor") for name in self._names]] = FLOOR
        self._roots = [body for body in sorted(free) if self._kinds[body] == OBJECT]
        number = {root: place for place, root in enumerate(self._roots)}
        self._owner = np.array([number.get(int(root), -1) for root in roots])
        self._jointed = [
            joint
            for joint in range(model.njnt)
            if model.jnt_type[joint] in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
            and self._kinds[model.jnt_bodyid[joint]] == FIXTURE
        ]
        self._moved_by = np.array([self._mover(body) for body in range(model.nbody)])
        self._fingers = [model.jnt_qposadr[model.joint(name).id] for name in FINGERS]
        self._state: list[Floats] = []
        self._series: list[dict[tuple[int, int], float]] = []
        self._before: list[dict[tuple[int, int], float]] = []
        self._pressed: list[tuple[int, int, int]] = []
        self._newtons: list[float] = []
        self._window = max(1, round(SECONDS / model.opt.timestep))

    def substep(self, data: Any) -> None:
        """Take down the forces of a physics substep, but what an object stands on with."""
        found: dict[tuple[int, int], float] = defaultdict(float)
        if data.ncon:
            bodies = self._model.geom_bodyid[data.contact.geom]
            kinds, moves = self._kinds[bodies], self._moved_by[bodies] >= 0
            roots = self._model.body_rootid[bodies]
            wanted = ((kinds == ROBOT) | moves).any(axis=1) | (kinds == OBJECT).all(axis=1)
            wanted &= roots[:, 0] != roots[:, 1]
            wrench = np.zeros(6)
            for index in np.flatnonzero(wanted & (data.contact.efc_address >= 0)).tolist():
                mujoco.mj_contactForce(self._model, data, index, wrench)
                one, other = sorted(bodies[index].tolist())
                found[one, other] += float(wrench[0])
        self._series.append(found)

    def step(self, data: Any) -> None:
        """Take down the state when a control step is over."""
        step, self._before = len(self._state), self._before[-self._window + 1 :]
        series = self._before + self._series
        self._before, self._series = series, []
        for pair in sorted({pair for found in series for pair in found}):
            force = np.array([found.get(pair, 0.0) for found in series])
            mean = np.convolve(force, np.full(self._window, 1.0 / self._window), "full")
            if len(force) and mean[: len(force)].max() > 0.1:
                self._pressed.append((step, *pair))
                self._newtons.append(float(mean[: len(force)].max()))
        self._state.append(data.qpos.copy())

    def taken(self) -> Raw:
        """All of it."""
        met, gap, com, turn, hand, first = [], [], [], [], [], None
        palm = self._model.body(HAND).id
        for step, qpos in enumerate(self._state):
            self._copy.qpos[:] = qpos
            mujoco.mj_fwdPosition(self._model, self._copy)
            first = self._sizes() if first is None else first
            com.append(self._copy.subtree_com[self._roots].copy())
            turn.append(self._copy.xquat[self._roots].copy())
            hand.append(np.append(self._copy.xpos[palm], self._copy.xquat[palm]))
            for pair, distance in self._touching().items():
                met.append((step, *pair))
                gap.append(distance)
        states, model = np.array(self._state), self._model
        return Raw(
            names=self._names,
            kinds=self._kinds,
            owner=self._owner,
            moved_by=self._moved_by,
            objects=np.array([self._names[root].removesuffix("_main") for root in self._roots]),
            sizes=np.zeros((0, 3)) if first is None else first,
            com=np.array(com),
            turn=np.array(turn),
            joints=states[:, model.jnt_qposadr[self._jointed]],
            ranges=np.ptp(model.jnt_range[self._jointed], axis=1),
            fingers=np.abs(states[:, self._fingers]).sum(axis=1),
            hand=np.array(hand),
            pressed=np.array(self._pressed, np.int64).reshape(-1, 3),
            newtons=np.array(self._newtons),
            met=np.array(met, np.int64).reshape(-1, 3),
            gap=np.array(gap),
        )

    def _touching(self) -> dict[tuple[int, int], float]:
        """Pairs of bodies that touch in the copy, one of which is an object or the robot."""
        contact = self._copy.contact
        found: dict[tuple[int, int], float] = {}
        bodies = self._model.geom_bodyid[contact.geom]
        roots, kinds = self._model.body_rootid[bodies], self._kinds[bodies]
        wanted = (roots[:, 0] != roots[:, 1]) & np.isin(kinds, (ROBOT, OBJECT)).any(axis=1)
        for index in np.flatnonzero(wanted & (contact.dist <= 0.0)).tolist():
            one, other = sorted(bodies[index].tolist())
            if self._floor_geoms[contact.geom[index]].any():
                one, other = -1, other if self._kinds[one] in (FLOOR, FIXTURE) else one
            found[one, other] = min(found.get((one, other), 0.0), float(contact.dist[index]))
        return found

    def _sizes(self) -> Floats:
        """Extents of the objects (N, 3), from the boxes of their geoms."""
        low, high = np.full((len(self._roots), 3), np.inf), np.full((len(self._roots), 3), -np.inf)
        for geom in range(self._model.ngeom):
            place = self._owner[self._model.geom_bodyid[geom]]
            if place < 0 or not self._model.geom_contype[geom]:
                continue
            frame = self._copy.geom_xmat[geom].reshape(3, 3)
            middle = self._copy.geom_xpos[geom] + frame @ self._model.geom_aabb[geom, :3]
            reach = np.abs(frame) @ self._model.geom_aabb[geom, 3:]
            low[place] = np.minimum(low[place], middle - reach)
            high[place] = np.maximum(high[place], middle + reach)
        sizes: Floats = high - low
        return sizes

    def _mover(self, body: int) -> int:
        """Number of the fixture's joint that moves a body, or -1."""
        while body > 0:
            for place, joint in enumerate(self._jointed):
                if self._model.jnt_bodyid[joint] == body:
                    return place
            body = int(self._model.body_parentid[body])
        return -1


class Examined:
    """A backend of RoboCasa's in this process, of whose rollouts it is taken down what happens.

    Args:
        backend: a ``RoboCasaBackend``.
        twin: another one, in a process of its own, that goes along: in it scripts look ahead and
            rehearse, so that nothing of that is taken down.
    """

    def __init__(self, backend: Any, twin: Any) -> None:
        self._backend, self._twin, self._trials = backend, twin, 0
        self.clearance = twin.clearance
        self._capture: Capture | None = None
        self.spec, self.provenance, self.observe = backend.spec, backend.provenance, backend.observe
        sample = ContactSampler.sample

        def heard(sampler: ContactSampler, data: Any) -> None:
            sample(sampler, data)
            if self._capture is not None:
                self._capture.substep(data)

        # It is called after every substep, which is all that is wanted of it.
        setattr(ContactSampler, "sample", heard)  # noqa: B010  (mypy refuses to assign to a method)

    def reset(self, request: Any) -> Any:
        """Begin another rollout."""
        self._capture, self._trials = None, 0
        start = self._backend.reset(request)
        self._twin.reset(request)
        simulation = self._backend._env.sim
        capture = Capture(simulation.model._model)
        capture.step(simulation.data._data)
        self._capture = capture
        return start

    def step(self, action: Any) -> Any:
        """Run one control period."""
        tried = self._twin.step(action)
        if self._trials:
            return tried
        step = self._backend.step(action)
        if self._capture is not None:
            self._capture.step(self._backend._env.sim.data._data)
        return step

    def begin_trial(self) -> None:
        """See :class:`~pytest_safemanip.sim.rehearsal.Rehearses`; likewise the next two."""
        self._twin.begin_trial()
        self._trials += 1

    def undo_trial(self) -> None:
        """Take back what was tried."""
        self._twin.undo_trial()
        self._trials -= 1

    def keep_trial(self) -> None:
        """Keep what was tried."""
        self._twin.keep_trial()
        self._trials -= 1

    def taken(self) -> Raw:
        """What happened since the reset."""
        assert self._capture is not None, "nothing was reset"
        return self._capture.taken()

    def close(self) -> None:
        """See the backend's own."""
        self._backend.close()
        self._twin.close()


def _kind(root: str, free: bool) -> int:
    if root.startswith(("robot0_", "mobilebase0_", "gripper0_")):
        return ROBOT
    return OBJECT if free else FIXTURE
