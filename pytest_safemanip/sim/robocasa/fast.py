"""One control period within a tolerance of robosuite's ``env.step``, at half the cost.

The physics and the controllers' laws are the same. Operational-space control multiplies errors and
velocities, which follow the state at every physics substep here too, by matrices that depend on the
posture alone. These cost ten times as much as the rest, and within 10 ms a joint turns by less than
0.03 rad: they are computed every 10 ms and continued linearly in between, and at every substep
where they change much.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.robocasa.control import Arm, Torso
from pytest_safemanip.sim.robocasa.stepping import Stepper

Floats = NDArray[np.float64]

EVERY = 5
"""Substeps between two evaluations of the matrices."""
LARGE = 0.05
"""Relative change of the stiffness within that time from which on the matrices are evaluated at
every substep: near singular postures. It is below 0.02 in random motion away from them."""


class FastStepper(Stepper):
    """Steps one RoboCasa environment within a tolerance; see :class:`Stepper`.

    From equal states, 40 random actions leave the joint positions within 2e-3 rad or m of those
    of :class:`Stepper`.
    """

    def __init__(self, env: Any, after_substep: Callable[[Any], None]) -> None:
        super().__init__(env, after_substep)
        self._law = _Law(self._model, self._data, self._arm, self._torso)
        names = ("right", "torso")
        self._index = np.concatenate([self._actuators[name].index for name in names])
        self._low, self._high = self._model.actuator_ctrlrange[self._index].T.copy()

    def step(self, action: Floats) -> None:
        """Run one control period."""
        env, model, data, law = self._env, self._model, self._data, self._law
        ctrl, index, low, high = data.ctrl, self._index, self._low, self._high
        env.timestep += 1
        for substep in range(self._substeps):
            mujoco.mj_step1(model, data)
            if substep == 0:
                self._set_goals(action)
                law.set_goals()
            torques = law.torques()
            np.maximum(torques, low, out=torques)
            np.minimum(torques, high, out=torques)
            ctrl[index] = torques
            if substep == self._substeps - 1:
                self._arm.note_origin()
            mujoco.mj_step2(model, data)
            self._after(data)
        env.cur_time += env.control_timestep
        env._post_action(action)


class _Law:
    """Torques of arm and torso as a matrix times errors and velocities, plus the bias.

    The rows are the torques; the columns are the end effector's error (6), the posture's (7), the
    torso's (1) and all velocities (NV).
    """

    def __init__(self, model: Any, data: Any, arm: Arm, torso: Torso) -> None:
        self._arm, self._torso, self._data = arm, torso, data
        self._goal = np.zeros((3, 4))
        self._dofs = np.append(np.arange(model.nv)[arm.dofs], torso.dof)
        self._joints = len(self._dofs) - 1
        shape = (len(self._dofs), 6 + self._joints + 1 + model.nv)
        # For the present substep, as computed last and before, and the change per substep.
        self._matrix, self._now, self._before, self._drift = (np.zeros(shape) for _ in range(4))
        self._fill(self._now)
        self._interval, self._left = 1, 0
        self._stiff = slice(self._joints), slice(6)
        self._inputs, self._torques = np.zeros(shape[1]), np.zeros(shape[0])
        self._pose, self._rest = self._inputs[:6], self._inputs[6:]

    def set_goals(self) -> None:
        """Take over the goals that the controllers have."""
        arm = self._arm.controller
        self._goal[:, :3], self._goal[:, 3] = arm.goal_ori, arm.goal_pos
        self._home = arm.initial_joint
        self._torso_goal = self._torso.goal

    def _refresh(self) -> None:
        """Compute the matrix for the present posture, and decide when to do so next."""
        self._now, self._before = self._before, self._now
        self._fill(self._now)
        self._matrix[:] = self._now
        np.subtract(self._now, self._before, out=self._drift)
        self._drift /= self._interval
        drift, size = (np.abs(matrix[self._stiff]).max() for matrix in (self._drift, self._now))
        self._interval = EVERY if EVERY * drift < LARGE * size else 1
        self._left = self._interval

    def _fill(self, matrix: Floats) -> None:
        arm, torso, joints = self._arm, self._torso, self._joints
        push, twist, posture = arm.gains()
        of_pose, of_posture = matrix[:joints, :6], matrix[:joints, 6 : 6 + joints]
        of_velocity = matrix[:, 7 + joints :]
        np.multiply(push, arm.controller.kp, out=of_pose)
        np.multiply(posture, arm.stiffness, out=of_posture)
        of_velocity[:joints] = np.dot(push * -arm.controller.kd, twist)
        of_velocity[:joints, arm.dofs] -= posture * arm.damping
        kp, kd = torso.gains()
        matrix[joints, 6 + joints], of_velocity[joints, torso.dof] = kp, -kd

    def torques(self) -> Floats:
        """Those of the present state (8,), not yet within their limits; call once a substep."""
        if self._left == 0:
            self._refresh()
        self._left -= 1
        arm, data, rest, joints = self._arm, self._data, self._rest, self._joints
        x, y, z = arm.position.tolist()
        ox, oy, oz = arm.origin[0].tolist()
        # Goal and frame have the three axes as columns; the goal's position is the fourth.
        rows = np.dot(arm.origin[1], self._goal).tolist()
        (dx, ex, fx, px), (dy, ey, fy, py), (dz, ez, fz, pz) = rows
        (rx, sx, tx), (ry, sy, ty), (rz, sz, tz) = arm.frame.tolist()
        self._pose[:] = (
            ox + px - x,
            oy + py - y,
            oz + pz - z,
            0.5 * ((ry * dz - rz * dy) + (sy * ez - sz * ey) + (ty * fz - tz * fy)),
            0.5 * ((rz * dx - rx * dz) + (sz * ex - sx * ez) + (tz * fx - tx * fz)),
            0.5 * ((rx * dy - ry * dx) + (sx * ey - sy * ex) + (tx * fy - ty * fx)),
        )
        np.subtract(self._home, data.qpos[arm.joints], out=rest[:joints])
        rest[joints] = self._torso_goal - data.qpos[self._torso.address]
        rest[joints + 1 :] = data.qvel
        torques = np.dot(self._matrix, self._inputs, out=self._torques)
        torques += data.qfrc_bias[self._dofs]
        self._matrix += self._drift
        return torques
