"""Reading a step out of the simulation without touching it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.mujoco.description import Attached, Description
from pytest_safemanip.sim.mujoco.scratch import Scratch
from pytest_safemanip.trace.geometry import cross, multiply, rotate
from pytest_safemanip.trace.steps import Contacts, Step


class Reader:
    """Reads steps of one episode.

    Args:
        model: its ``MjModel``.
        live: its ``MjData``, which is only read.
        describe: reads the scene, from ``MjData`` with kinematics and centres of mass up to date.

    Attributes:
        description: what it gave.
    """

    def __init__(self, model: Any, live: Any, describe: Callable[[Any], Description]) -> None:
        self._copy = Scratch(model, live)
        self._model, self._scratch = model, self._copy.data
        self._refresh()
        self.description = describe(self._scratch)
        hands = [hand.body for hand in self.description.hands]
        self._bodies = np.append(self.description.object_body, np.array(hands, np.intp))
        self._boxes = _Follower(self.description.boxes)
        self._cameras = _Follower(self.description.cameras)

    def fingerprint(self) -> str:
        """Digest of the episode's state as it is now."""
        names = "\0".join(b.entity for b in self.description.scene.bodies)
        return hashlib.sha256(self._copy.state.tobytes() + names.encode()).hexdigest()[:16]

    def read(
        self, success: bool, contacts: Contacts, commands: NDArray[np.float64] | None = None
    ) -> Step:
        """The current state as a step.

        Args:
            success: whether the task's own check holds.
            contacts: of the step.
            commands: what the grippers were told (G,); nothing if there is none.
        """
        self._refresh()
        d, info = self._scratch, self.description
        body, hands = info.object_body, info.hands
        twist = _twists(self._model, d, self._bodies)
        eef_poses = np.array([hand.pose(d) for hand in hands]).reshape(-1, 7)
        eef_twists = twist[len(body) :]
        arms = eef_poses[:, :3] - d.xpos[self._bodies[len(body) :]]
        eef_twists[:, :3] += cross(eef_twists[:, 3:], arms)
        way = info.joint_open - info.joint_closed
        openness = (d.qpos[info.joint_qpos] - info.joint_closed) / way
        told = np.zeros(len(hands)) if commands is None else commands
        return Step(
            eef_poses=_f32(eef_poses),
            eef_twists=_f32(eef_twists),
            openings=_f32(np.array([hand.opening(d) for hand in hands]).reshape(-1, 2)),
            commands=_f32(told),
            base_pose=_f32(np.concatenate((d.xpos[info.base], d.xquat[info.base]))),
            object_pose=_f32(np.concatenate((d.xpos[body], d.xquat[body]), axis=1)),
            object_twist=_f32(twist[: len(body)]),
            joint=_f32(np.stack((openness, d.qvel[info.joint_dof] / way), axis=1)),
            box_pose=self._boxes.poses(d),
            switch=np.array([on for read in info.read_switches for on in read()], np.float32),
            qpos=_f32(d.qpos),
            qvel=_f32(d.qvel),
            success=success,
            contacts=contacts,
            camera_pose=self._cameras.poses(d),
            particles=_f32(d.xpos[info.particles]),
        )

    def _refresh(self) -> None:
        m = self._model
        self._copy.take()
        mujoco.mj_kinematics(m, self._scratch)
        mujoco.mj_comPos(m, self._scratch)
        mujoco.mj_comVel(m, self._scratch)


class _Follower:
    """Follows what is attached to bodies.

    Args:
        attached: what it is.
    """

    def __init__(self, attached: Attached) -> None:
        self._attached, self._seen = attached, b""
        self._poses = np.zeros((0, 7), np.float32)

    def poses(self, data: Any) -> NDArray[np.float32]:
        """Where it is (B, 7); computed anew only if something has moved."""
        body, local = self._attached.body, self._attached.local
        place, turn = data.xpos[body], data.xquat[body]
        seen = place.tobytes() + turn.tobytes()
        if seen != self._seen:
            positions = place + rotate(turn, local[:, :3])
            turns = multiply(turn, local[:, 3:])
            self._poses = _f32(np.concatenate((positions, turns), axis=1))
            self._seen = seen
        return self._poses


def _twists(model: Any, data: Any, bodies: NDArray[np.intp]) -> NDArray[np.float64]:
    """Linear velocity of each body's origin and angular velocity, world frame (K, 6)."""
    turn, move = data.cvel[bodies, :3], data.cvel[bodies, 3:]
    # MuJoCo's cvel is taken at the centre of mass of the kinematic tree.
    arm = data.xpos[bodies] - data.subtree_com[model.body_rootid[bodies]]
    return np.concatenate((move + cross(turn, arm), turn), axis=1)


def _f32(values: NDArray[np.float64]) -> NDArray[np.float32]:
    return np.asarray(values, np.float32)
