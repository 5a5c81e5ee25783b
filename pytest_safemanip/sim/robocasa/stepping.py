"""One control period, bit-identical to robosuite's ``env.step`` and a fraction of its cost.

Stock stepping spends most of its time in Python: observables nobody reads, four controllers that
each refill the whole mass matrix at every physics substep, limits rebuilt three times. Here the
arm and the torso, which change within a control period, are evaluated at every substep with the
same operations in the same order on arrays of the same layout (the layout decides which BLAS
routine runs); the base and the gripper, which do not change, once.
"""

from __future__ import annotations

import functools
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
        self._actuators = {
            name: _Actuators(self._model, self._data, index[name]) for name in controllers
        }
        self._arm = _Arm(env.sim, controllers["right"])
        self._torso = _Torso(env.sim, controllers["torso"])
        self._constant = [(n, c) for n, c in controllers.items() if n not in ("right", "torso")]
        self._substeps = int(env.control_timestep / env.model_timestep)
        # The fixtures ask for their joints' addresses at every step, by name.
        env.sim.model.get_joint_qpos_addr = functools.cache(env.sim.model.get_joint_qpos_addr)

    def step(self, action: Floats) -> None:
        """Run one control period, as ``env.step(action)`` does, without its observations."""
        env, model, data = self._env, self._model, self._data
        arm, torso = self._actuators["right"], self._actuators["torso"]
        env.timestep += 1
        for substep in range(self._substeps):
            mujoco.mj_step1(model, data)
            if substep == 0:
                self._set_goals(action)
            arm.apply(self._arm.torques())
            torso.apply(self._torso.torques())
            mujoco.mj_step2(model, data)
            self._after(data)
        env.cur_time += env.control_timestep
        env._post_action(action)

    def _set_goals(self, action: Floats) -> None:
        self._arm.refresh()
        self._torso.refresh()
        # A copy: the base controller turns the command in place.
        self._composite.set_goal(np.array(action, dtype=np.float64))
        for name, controller in self._constant:
            self._actuators[name].apply(controller.run_controller())


class _Actuators:
    """The actuators of one part, which take commands within their range."""

    def __init__(self, model: Any, data: Any, index: Any) -> None:
        self._index, self._ctrl = np.array(index), data.ctrl
        self._low, self._high = model.actuator_ctrlrange[self._index].T.copy()

    def apply(self, command: Floats) -> None:
        self._ctrl[self._index] = np.minimum(np.maximum(command, self._low), self._high)


class _Torso:
    """The torso's position control, for its one joint."""

    def __init__(self, sim: Any, controller: Any) -> None:
        data = sim.data._data
        self._controller = controller
        (self._dof,), (self._address,) = controller.qvel_index, controller.qpos_index
        self._qpos, self._qvel, self._bias = data.qpos, data.qvel, data.qfrc_bias
        self._inertia, self._where = data.qM, _mass_index(sim.model._model, [self._dof]).item()

    def refresh(self) -> None:
        """Let the controller set its next goal from the current state, without its own reading."""
        c = self._controller
        c.joint_pos, c.joint_vel = self._qpos[[self._address]], self._qvel[[self._dof]]
        c.new_update = False

    def torques(self) -> Floats:
        """Torque (1,)."""
        c = self._controller
        error = c.goal_qpos - self._qpos[self._address]
        wanted = error * c.kp - self._qvel[self._dof] * c.kd
        return np.asarray(self._inertia[self._where] * wanted + self._bias[self._dof])


class _Arm:
    """Operational-space control (Khatib 1987) as robosuite's controller computes it."""

    def __init__(self, sim: Any, controller: Any) -> None:
        self._model, self._data = sim.model._model, sim.data._data
        data = self._data
        self._controller = controller
        self._dofs, self._joints = _span(controller.qvel_index), _span(controller.qpos_index)
        self._site = self._model.site(controller.ref_name).id
        centre = f"{controller.naming_prefix}{controller.part_name}_center"
        self._centre = self._model.site(centre).id
        self._position, self._frame = data.site_xpos[self._site], _frame(data, self._site)
        self._origin = data.site_xpos[self._centre], _frame(data, self._centre)
        self._qpos, self._qvel = data.qpos, data.qvel
        self._inertia, self._where = data.qM, _mass_index(self._model, controller.qvel_index)
        shape = (3, self._model.nv)
        self._jac = [np.zeros(shape) for _ in range(4)]
        self._jacobian = np.zeros((6, controller.joint_dim))
        self._halves = np.zeros((2, 3, 3))
        self._error, self._velocity, self._wrench = np.zeros(6), np.zeros(6), np.zeros(6)
        self._eye = np.eye(controller.joint_dim)
        self._stiffness = 10
        self._damping = np.sqrt(self._stiffness) * 2

    def refresh(self) -> None:
        """Let the controller set its next goal from the current state, without its own reading."""
        c = self._controller
        c.ref_pos[:], c.ref_ori_mat[:] = self._position, self._frame
        c.new_update = False

    def torques(self) -> Floats:
        """Joint torques (7,)."""
        c = self._controller
        origin, turn = self._origin[0].copy(), self._origin[1].copy()
        # The next goal is set relative to where the arm's base was at the last substep.
        c.update_origin(origin, turn)
        error = self._error
        np.subtract(origin + np.dot(turn, c.goal_pos), self._position, out=error[:3])
        error[3:] = _orientation_error(np.dot(turn, c.goal_ori), self._frame)
        force = error * c.kp - self._relative_velocity() * c.kd
        jac, wrench = self._jacobian, self._wrench
        # Fortran's order, as robosuite's indexing leaves it: the matrix is symmetric.
        mass = self._inertia[self._where].T
        full, halves, mass_inv = self._inertias(mass)
        np.dot(halves[0], force[:3], out=wrench[:3])
        np.dot(halves[1], force[3:], out=wrench[3:])
        result: Floats = np.dot(jac.T, wrench) + self._data.qfrc_bias[self._dofs]
        # Pull the redundant joint home without moving the end effector.
        weighted = np.dot(mass_inv, jac.T).dot(full)
        null = self._eye - np.dot(weighted, jac)
        away = c.initial_joint - self._qpos[self._joints]
        pull = self._stiffness * away - self._damping * self._qvel[self._dofs]
        result += np.dot(null.T, np.dot(mass, pull))
        return result

    def _relative_velocity(self) -> Floats:
        """Twist of the end effector relative to the arm's base (6,); fills the Jacobian."""
        model, data, qvel, twist = self._model, self._data, self._qvel, self._velocity
        jac_p, jac_r, base_p, base_r = self._jac
        mujoco.mj_jacSite(model, data, jac_p, jac_r, self._site)
        mujoco.mj_jacSite(model, data, base_p, base_r, self._centre)
        self._jacobian[:3], self._jacobian[3:] = jac_p[:, self._dofs], jac_r[:, self._dofs]
        np.subtract(np.dot(jac_p, qvel), np.dot(base_p, qvel), out=twist[:3])
        np.subtract(np.dot(jac_r, qvel), np.dot(base_r, qvel), out=twist[3:])
        return twist

    def _inertias(self, mass: Floats) -> tuple[Floats, Floats, Floats]:
        """Of the end effector: in full (6, 6), of position and orientation (2, 3, 3)."""
        jac, halves = self._jacobian, self._halves
        mass_inv = np.linalg.inv(mass)
        full = np.dot(np.dot(jac, mass_inv), jac.T)
        for half, rows in zip(halves, (jac[:3], jac[3:]), strict=True):
            np.dot(np.dot(rows, mass_inv), rows.T, out=half)
        return _pinv(full), _pinv(halves), mass_inv


def _frame(data: Any, site: int) -> Floats:
    """A live view of a site's rotation matrix (3, 3)."""
    view: Floats = data.site_xmat[site].reshape(3, 3)
    return view


def _span(index: Any) -> Any:
    """A slice for consecutive indices, which reads several times as fast."""
    first, last = min(index), max(index)
    return slice(first, last + 1) if list(index) == list(range(first, last + 1)) else index


def _mass_index(model: Any, dofs: Any) -> NDArray[np.intp]:
    """Where in MuJoCo's sparse mass matrix the entries of some connected dofs are (K, K)."""
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, full, np.arange(1.0, model.nM + 1.0))
    return full[np.ix_(dofs, dofs)].astype(np.intp) - 1


def _pinv(matrices: Floats) -> Floats:
    """What ``np.linalg.pinv`` computes for real matrices (..., K, K), without its wrappers."""
    u, s, vt = np.linalg.svd(matrices, full_matrices=False)
    # The first singular value is the largest.
    large = s > 1e-15 * s[..., :1]
    if np.count_nonzero(large) == large.size:
        s = 1 / s
    else:
        s = np.divide(1, s, where=large, out=s)
        s[~large] = 0
    scaled = s[..., np.newaxis] * u.swapaxes(-1, -2)
    inverse: Floats = np.matmul(vt.swapaxes(-1, -2), scaled)
    return inverse


def _orientation_error(desired: Floats, current: Floats) -> tuple[float, float, float]:
    """Half the sum of the cross products of the frames' axes."""
    # Row k of a rotation matrix holds coordinate k of its three axes.
    (rx, sx, tx), (ry, sy, ty), (rz, sz, tz) = current.tolist()
    (dx, ex, fx), (dy, ey, fy), (dz, ez, fz) = desired.tolist()
    return (
        0.5 * ((ry * dz - rz * dy) + (sy * ez - sz * ey) + (ty * fz - tz * fy)),
        0.5 * ((rz * dx - rx * dz) + (sz * ex - sx * ez) + (tz * fx - tx * fz)),
        0.5 * ((rx * dy - ry * dx) + (sx * ey - sy * ex) + (tx * fy - ty * fx)),
    )
