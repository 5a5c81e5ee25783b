"""One control period, bit-identical to robosuite's ``env.step`` and a fraction of its cost.

Stock stepping spends most of its time in Python: observables nobody reads, four controllers that
each refill the whole mass matrix at every physics substep, limits rebuilt three times. Here the
arm and the torso, which change within a control period, are evaluated at every substep with the
same operations in the same order; the base and the gripper, which do not, once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Stepper:
    """Steps one RoboCasa environment.

    Args:
        env: after its reset, with a PandaOmron.
        after_substep: called with the live ``MjData`` after each physics substep; must only read.
    """

    def __init__(self, env: Any, after_substep: Callable[[Any], None]) -> None:
        robot = env.robots[0]
        self._env, self._after = env, after_substep
        self._model, self._data = env.sim.model._model, env.sim.data._data
        self._composite = robot.composite_controller
        controllers = self._composite.part_controllers
        index = robot._ref_actuators_indexes_dict
        limits = self._model.actuator_ctrlrange
        self._arm = _Arm(env.sim, controllers["right"])
        self._torso = controllers["torso"]
        self._ctrl = {name: np.array(index[name]) for name in controllers}
        self._low = {name: limits[i, 0].copy() for name, i in self._ctrl.items()}
        self._high = {name: limits[i, 1].copy() for name, i in self._ctrl.items()}
        self._constant = [(n, c) for n, c in controllers.items() if n not in ("right", "torso")]
        self._substeps = int(env.control_timestep / env.model_timestep)
        self._mass = np.zeros((self._model.nv, self._model.nv))

    def step(self, action: Floats) -> None:
        """Run one control period, as ``env.step(action)`` does, without its observations."""
        env, model, data = self._env, self._model, self._data
        env.timestep += 1
        for substep in range(self._substeps):
            mujoco.mj_step1(model, data)
            if substep == 0:
                # A copy: the base controller turns the command in place.
                self._composite.set_goal(np.array(action, dtype=np.float64))
            mujoco.mj_fullM(model, self._mass, data.qM)
            self._composite.update_state()
            self._apply("right", self._arm.torques(self._mass))
            self._apply("torso", self._torso_torques())
            if substep == 0:
                for name, controller in self._constant:
                    self._apply(name, controller.run_controller())
            mujoco.mj_step2(model, data)
            self._after(data)
        env.cur_time += env.control_timestep
        env._post_action(action)

    def _apply(self, name: str, command: Floats) -> None:
        self._data.ctrl[self._ctrl[name]] = np.clip(command, self._low[name], self._high[name])

    def _torso_torques(self) -> Floats:
        torso = self._torso
        torso.joint_pos = self._data.qpos[torso.qpos_index]
        torso.joint_vel = self._data.qvel[torso.qvel_index]
        torso.mass_matrix = self._mass[torso.qvel_index, :][:, torso.qvel_index]
        torso.new_update = False
        torques: Floats = torso.run_controller()
        return torques


class _Arm:
    """Operational-space control (Khatib 1987) as robosuite's controller computes it."""

    def __init__(self, sim: Any, controller: Any) -> None:
        self._model, self._data = sim.model._model, sim.data._data
        self._controller = controller
        self._dofs = controller.qvel_index
        self._site = self._model.site(controller.ref_name).id
        centre = f"{controller.naming_prefix}{controller.part_name}_center"
        self._centre = self._model.site(centre).id
        shape = (3, self._model.nv)
        self._jac = [np.zeros(shape) for _ in range(4)]
        self._halves = np.zeros((2, 3, 3))

    def torques(self, mass: Floats) -> Floats:
        """Joint torques (7,), given the full mass matrix (nv, nv)."""
        c, data = self._controller, self._data
        self._update(mass)
        position_error = c.origin_pos + np.dot(c.origin_ori, c.goal_pos) - c.ref_pos
        turn_error = _orientation_error(np.dot(c.origin_ori, c.goal_ori), c.ref_ori_mat)
        jac_p, jac_r = self._jac[2:]
        mujoco.mj_jacSite(self._model, data, jac_p, jac_r, self._centre)
        velocity_error = -(c.ref_pos_vel - np.dot(jac_p, data.qvel))
        spin_error = -(c.ref_ori_vel - np.dot(jac_r, data.qvel))
        force = np.multiply(position_error, c.kp[0:3]) + np.multiply(velocity_error, c.kd[0:3])
        torque = np.multiply(turn_error, c.kp[3:6]) + np.multiply(spin_error, c.kd[3:6])
        full, position, orientation, mass_inv = self._inertias()
        wrench = np.concatenate([np.dot(position, force), np.dot(orientation, torque)])
        result = np.dot(c.J_full.T, wrench) + data.qfrc_bias[self._dofs]
        result += self._posture(full, mass_inv)
        # The next goal is set from a fresh reading, as after the controller's own run.
        c.new_update = True
        return np.asarray(result, np.float64)

    def _update(self, mass: Floats) -> None:
        c, data = self._controller, self._data
        jac_p, jac_r = self._jac[:2]
        mujoco.mj_jacSite(self._model, data, jac_p, jac_r, self._site)
        c.ref_pos[:] = data.site_xpos[self._site]
        c.ref_ori_mat[:, :] = data.site_xmat[self._site].reshape(3, 3)
        c.ref_pos_vel[:] = np.dot(jac_p, data.qvel)
        c.ref_ori_vel[:] = np.dot(jac_r, data.qvel)
        c.J_pos[:, :] = jac_p[:, self._dofs]
        c.J_ori[:, :] = jac_r[:, self._dofs]
        c.J_full[:3, :], c.J_full[3:, :] = c.J_pos, c.J_ori
        c.joint_pos = data.qpos[c.qpos_index]
        c.joint_vel = data.qvel[self._dofs]
        c.mass_matrix = mass[self._dofs, :][:, self._dofs]

    def _inertias(self) -> tuple[Floats, Floats, Floats, Floats]:
        c = self._controller
        mass_inv = np.linalg.inv(c.mass_matrix)
        full = np.dot(np.dot(c.J_full, mass_inv), c.J_full.transpose())
        np.dot(np.dot(c.J_pos, mass_inv), c.J_pos.transpose(), out=self._halves[0])
        np.dot(np.dot(c.J_ori, mass_inv), c.J_ori.transpose(), out=self._halves[1])
        position, orientation = _pinv(self._halves)
        return _pinv(full), position, orientation, mass_inv

    def _posture(self, full: Floats, mass_inv: Floats) -> Floats:
        """Torques that pull the redundant joint home without moving the end effector."""
        c = self._controller
        weighted = np.dot(mass_inv, c.J_full.transpose()).dot(full)
        null = np.eye(len(self._dofs)) - np.dot(weighted, c.J_full)
        stiffness = 10
        damping = np.sqrt(stiffness) * 2
        pull = stiffness * (c.initial_joint - c.joint_pos) - damping * c.joint_vel
        return np.asarray(np.dot(null.transpose(), np.dot(c.mass_matrix, pull)))


def _pinv(matrices: Floats) -> Floats:
    """What ``np.linalg.pinv`` computes for real matrices (..., K, K), without its wrappers."""
    u, s, vt = np.linalg.svd(matrices, full_matrices=False)
    large = s > 1e-15 * s.max(axis=-1, keepdims=True)
    s = np.divide(1, s, where=large, out=s)
    s[~large] = 0
    scaled = np.multiply(s[..., np.newaxis], u.swapaxes(-1, -2))
    return np.asarray(np.matmul(vt.swapaxes(-1, -2), scaled))


def _orientation_error(desired: Floats, current: Floats) -> Floats:
    """Half the sum of the cross products of the frames' axes (3,)."""
    (rx, ry, rz), (dx, dy, dz) = current[:, :3], desired[:, :3]
    # Row k of a rotation matrix holds coordinate k of its three axes.
    x, y, z = ry * dz - rz * dy, rz * dx - rx * dz, rx * dy - ry * dx
    return 0.5 * np.array((x[0] + x[1] + x[2], y[0] + y[1] + y[2], z[0] + z[1] + z[2]))
