"""Reading a step out of the simulation without touching it."""

from __future__ import annotations

import hashlib
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.robocasa.description import (
    BASE_BODY,
    EEF_SITE,
    GRIPPER_OPEN,
    Description,
    describe,
)
from pytest_safemanip.sim.robocasa.stepping.scratch import Scratch
from pytest_safemanip.trace.geometry import cross, multiply
from pytest_safemanip.trace.steps import Contacts, Step

_NO_COMMAND = np.zeros(1)


class Reader:
    """Reads steps of one episode.

    Args:
        env: a RoboCasa environment, after its reset.
    """

    def __init__(self, env: Any) -> None:
        self._copy = Scratch(env)
        self._model, self._scratch = self._copy.model, self._copy.data
        self._refresh()
        self.description: Description = describe(env, self._scratch)
        self._site = self._model.site(EEF_SITE).id
        self._hand = int(self._model.site_bodyid[self._site])
        self._bodies = np.append(self.description.object_body, self._hand)
        self._base = self._model.body(BASE_BODY).id
        boxes = self.description.box_geom
        self._box_body = self._model.geom_bodyid[boxes]
        self._box_quat = self._model.geom_quat[boxes]
        self._boxes_at, self._boxes = b"", np.zeros((0, 7), np.float32)

    def fingerprint(self) -> str:
        """Digest of the episode's state as it is now."""
        names = "\0".join(b.entity for b in self.description.scene.bodies)
        return hashlib.sha256(self._copy.state.tobytes() + names.encode()).hexdigest()[:16]

    def read(
        self, success: bool, contacts: Contacts, commands: NDArray[np.float64] = _NO_COMMAND
    ) -> Step:
        """The current state as a step.

        Args:
            success: whether the task's own check holds.
            contacts: of the step.
            commands: what the gripper was told (1,).
        """
        self._refresh()
        d, info = self._scratch, self.description
        body = info.object_body
        twist = _twists(self._model, d, self._bodies)
        eef = d.site_xpos[self._site]
        eef_quat = np.empty(4)
        mujoco.mju_mat2Quat(eef_quat, d.site_xmat[self._site])
        twist[-1, :3] += cross(twist[-1, 3:], eef - d.xpos[self._hand])
        opening = d.qpos[info.joint_qpos] / info.joint_open
        return Step(
            eef_poses=_f32(np.concatenate((eef, eef_quat))[None]),
            eef_twists=_f32(twist[-1:]),
            openings=_f32(self._gripper()[None]),
            commands=_f32(commands),
            base_pose=_f32(np.concatenate((d.xpos[self._base], d.xquat[self._base]))),
            object_pose=_f32(np.concatenate((d.xpos[body], d.xquat[body]), axis=1)),
            object_twist=_f32(twist[:-1]),
            joint=_f32(np.stack((opening, d.qvel[info.joint_dof] / info.joint_open), axis=1)),
            box_pose=self._box_poses(),
            switch=np.array([on for read in info.read_switches for on in read()], np.float32),
            qpos=_f32(d.qpos),
            qvel=_f32(d.qvel),
            success=success,
            contacts=contacts,
        )

    def _box_poses(self) -> NDArray[np.float32]:
        """Poses of the scene's boxes (B, 7); those of the last time where none has moved."""
        d, geom, site = self._scratch, self.description.box_geom, self.description.box_site
        places = d.geom_xpos[geom], d.xquat[self._box_body], d.site_xpos[site], d.site_xmat[site]
        seen = b"".join(place.tobytes() for place in places)
        if seen != self._boxes_at:
            turned = multiply(places[1], self._box_quat).reshape(-1, 4)
            sites = np.empty((len(site), 4))
            for quat, axes in zip(sites, places[3], strict=True):
                mujoco.mju_mat2Quat(quat, axes)
            positions, turns = np.concatenate(places[::2]), np.concatenate((turned, sites))
            self._boxes = _f32(np.concatenate((positions, turns), axis=1))
            self._boxes_at = seen
        return self._boxes

    def _refresh(self) -> None:
        m = self._model
        self._copy.take()
        mujoco.mj_kinematics(m, self._scratch)
        mujoco.mj_comPos(m, self._scratch)
        mujoco.mj_comVel(m, self._scratch)

    def _gripper(self) -> NDArray[np.float64]:
        """Opening in [0, 1] and its rate in 1/s; the two fingers move in opposite directions."""
        d, info = self._scratch, self.description
        gap = d.qpos[info.finger_qpos[0]] - d.qpos[info.finger_qpos[1]]
        rate = d.qvel[info.finger_dof[0]] - d.qvel[info.finger_dof[1]]
        return np.array((gap, rate)) / (2.0 * GRIPPER_OPEN)


def _twists(model: Any, data: Any, bodies: NDArray[np.intp]) -> NDArray[np.float64]:
    """Linear velocity of each body's origin and angular velocity, world frame (K, 6)."""
    turn, move = data.cvel[bodies, :3], data.cvel[bodies, 3:]
    # MuJoCo's cvel is taken at the centre of mass of the kinematic tree.
    arm = data.xpos[bodies] - data.subtree_com[model.body_rootid[bodies]]
    return np.concatenate((move + cross(turn, arm), turn), axis=1)


def _f32(values: NDArray[np.float64]) -> NDArray[np.float32]:
    return np.asarray(values, np.float32)
