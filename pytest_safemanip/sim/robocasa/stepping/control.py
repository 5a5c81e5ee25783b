"""robosuite's part controllers of a PandaOmron: the same laws, the same bits, less Python."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

Floats = NDArray[np.float64]

_SINGULAR = 1e-5
"""Spread of a Cholesky factor's diagonal below which a matrix is treated as singular: its condition
is then above 1e10, and more than half of the digits are lost."""


class Actuators:
    """The actuators of one part, which take commands within their range."""

    def __init__(self, model: Any, data: Any, index: Any) -> None:
        self.index, self._ctrl = np.array(index), data.ctrl
        self._low, self._high = model.actuator_ctrlrange[self.index].T.copy()

    def apply(self, command: Floats) -> None:
        """Command them, until the next time."""
        self._ctrl[self.index] = np.minimum(np.maximum(command, self._low), self._high)


class TorsoController:
    """The torso's position control, for its one joint."""

    def __init__(self, sim: Any, controller: Any) -> None:
        data = sim.data._data
        self._controller = controller
        (self.dof,), (self.address,) = controller.qvel_index, controller.qpos_index
        self._qpos, self._qvel, self._bias = data.qpos, data.qvel, data.qfrc_bias
        self._inertia, self._where = data.qM, _mass_index(sim.model._model, [self.dof]).item()

    def refresh(self) -> None:
        """Let the controller set its next goal from the current state, without its own reading."""
        c = self._controller
        c.joint_pos, c.joint_vel = self._qpos[[self.address]], self._qvel[[self.dof]]
        c.new_update = False

    @property
    def goal(self) -> float:
        """Goal of its joint, m."""
        return float(self._controller.goal_qpos.item())

    @property
    def gains(self) -> tuple[float, float]:
        """Acceleration per m of error and per m/s of velocity."""
        return self._controller.kp.item(), self._controller.kd.item()

    @property
    def inertia(self) -> float:
        """What the joint carries, kg."""
        return float(self._inertia[self._where])

    def torques(self) -> Floats:
        """Torque (1,)."""
        c = self._controller
        error = c.goal_qpos - self._qpos[self.address]
        wanted = error * c.kp - self._qvel[self.dof] * c.kd
        return np.asarray(self._inertia[self._where] * wanted + self._bias[self.dof])


class ArmController:
    """Operational-space control (Khatib 1987) as robosuite's controller computes it."""

    def __init__(self, sim: Any, controller: Any) -> None:
        self._model, self._data = sim.model._model, sim.data._data
        data = self._data
        self.controller = controller
        self.dofs, self.joints = span(controller.qvel_index), span(controller.qpos_index)
        self._site = self._model.site(controller.ref_name).id
        centre = f"{controller.naming_prefix}{controller.part_name}_center"
        self._centre = self._model.site(centre).id
        self.position, self.frame = data.site_xpos[self._site], _frame(data, self._site)
        self.origin = data.site_xpos[self._centre], _frame(data, self._centre)
        self._qpos, self._qvel = data.qpos, data.qvel
        self._inertia, self._where = data.qM, _mass_index(self._model, controller.qvel_index)
        shape = (3, self._model.nv)
        self._jac = [np.zeros(shape) for _ in range(4)]
        self._twists = np.zeros((2, 6, self._model.nv))
        self._jacobian = np.zeros((6, controller.joint_dim))
        self._halves = np.zeros((2, 3, 3))
        self._error, self._velocity, self._wrench = np.zeros(6), np.zeros(6), np.zeros(6)
        self._eye = np.eye(controller.joint_dim)
        self.stiffness = 10
        self.damping = np.sqrt(self.stiffness) * 2

    def refresh(self) -> None:
        """Let the controller set its next goal from the current state, without its own reading."""
        c = self.controller
        c.ref_pos[:], c.ref_ori_mat[:] = self.position, self.frame
        c.new_update = False

    def set_goal(self, action: Floats) -> None:
        """Set the controller's goal as it does itself, but for rounding.

        In between, robosuite makes quaternions of single precision, and one that nobody reads.

        Args:
            action: displacement and rotation vector (6,), in units of the controller's input.
        """
        c = self.controller
        scaled = c.scale_action(action)
        if c._goal_update_mode == "achieved":
            back = c.origin_ori.T
            c.goal_pos, c.goal_ori = back.dot(self.position - c.origin_pos), back.dot(self.frame)
        c.goal_pos = c.goal_pos + scaled[:3]
        quat, turn = np.array((1.0, 0.0, 0.0, 0.0)), np.empty(9)
        mujoco.mju_quatIntegrate(quat, scaled[3:], 1.0)
        mujoco.mju_quat2Mat(turn, quat)
        c.goal_ori = turn.reshape(3, 3).dot(c.goal_ori)

    def note_origin(self) -> tuple[Floats, Floats]:
        """Position and frame of the arm's base; the controller's next goal is relative to them."""
        origin, turn = self.origin[0].copy(), self.origin[1].copy()
        self.controller.update_origin(origin, turn)
        return origin, turn

    def gains(self, moving: slice) -> tuple[Floats, Floats, Floats]:
        """Factors of the law's terms in the present posture.

        Args:
            moving: the robot's dofs (D of them).

        Returns:
            Joint torques of a wrench at unit inertia (7, 6); the Jacobian of the end effector
            relative to the arm's base (6, D); torques of an acceleration towards the home posture
            that does not move the end effector (7, 7).
        """
        end, base = self._twists
        mujoco.mj_jacSite(self._model, self._data, end[:3], end[3:], self._site)
        mujoco.mj_jacSite(self._model, self._data, base[:3], base[3:], self._centre)
        jac, mass = end[:, self.dofs], self._inertia[self._where]
        mobility = jac.dot(_solve(mass, jac.T))
        # Inertias are symmetric: what solving for the rows gives is the transpose of the push.
        push = np.empty((6, len(mass)))
        for half in (slice(3), slice(3, 6)):
            push[half] = _solve(mobility[half, half], jac[half])
        free = mass - jac.T.dot(_solve(mobility, jac))
        return push.T, end[:, moving] - base[:, moving], free

    def torques(self) -> Floats:
        """Joint torques (7,)."""
        c = self.controller
        # The next goal is set relative to where the arm's base was at the last substep.
        origin, turn = self.note_origin()
        error = self._error
        np.subtract(origin + np.dot(turn, c.goal_pos), self.position, out=error[:3])
        error[3:] = _orientation_error(np.dot(turn, c.goal_ori), self.frame)
        force = error * c.kp - self._relative_velocity() * c.kd
        jac, wrench = self._jacobian, self._wrench
        # Fortran's order, as robosuite's indexing leaves it: the matrix is symmetric.
        mass = self._inertia[self._where].T
        full, halves, mass_inv = self._inertias(mass)
        np.dot(halves[0], force[:3], out=wrench[:3])
        np.dot(halves[1], force[3:], out=wrench[3:])
        result: Floats = np.dot(jac.T, wrench) + self._data.qfrc_bias[self.dofs]
        # Pull the redundant joint home without moving the end effector.
        weighted = np.dot(mass_inv, jac.T).dot(full)
        null = self._eye - np.dot(weighted, jac)
        away = c.initial_joint - self._qpos[self.joints]
        pull = self.stiffness * away - self.damping * self._qvel[self.dofs]
        result += np.dot(null.T, np.dot(mass, pull))
        return result

    def _relative_velocity(self) -> Floats:
        """Twist of the end effector relative to the arm's base (6,); fills the Jacobian."""
        model, data, qvel, twist = self._model, self._data, self._qvel, self._velocity
        jac_p, jac_r, base_p, base_r = self._jac
        mujoco.mj_jacSite(model, data, jac_p, jac_r, self._site)
        mujoco.mj_jacSite(model, data, base_p, base_r, self._centre)
        self._jacobian[:3], self._jacobian[3:] = jac_p[:, self.dofs], jac_r[:, self.dofs]
        np.subtract(np.dot(jac_p, qvel), np.dot(base_p, qvel), out=twist[:3])
        np.subtract(np.dot(jac_r, qvel), np.dot(base_r, qvel), out=twist[3:])
        return twist

    def _inertias(self, mass: Floats) -> tuple[Floats, Floats, Floats]:
        """Inertias of the end effector: in full (6, 6), of position and orientation (2, 3, 3)."""
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


def span(index: Any) -> Any:
    """A slice for consecutive indices, which reads several times as fast."""
    first, last = min(index), max(index)
    return slice(first, last + 1) if list(index) == list(range(first, last + 1)) else index


def _mass_index(model: Any, dofs: Any) -> NDArray[np.intp]:
    """Indices of some connected dofs' entries in MuJoCo's sparse mass matrix (K, K)."""
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, full, np.arange(1.0, model.nM + 1.0))
    return full[np.ix_(dofs, dofs)].astype(np.intp) - 1


def _pinv(matrices: Floats) -> Floats:
    """``np.linalg.pinv`` for real matrices (..., K, K), without its wrappers."""
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


def _solve(matrix: Floats, right: Floats) -> Floats:
    """Solution of a linear system with a symmetric positive matrix (K, K), for columns (K, N).

    Close to singularity, that of least norm. LAPACK is called without numpy's wrappers, which take
    ten times as long as these small systems.
    """
    factor, solution, failed = dposv(matrix, right)
    spread = factor.diagonal().tolist()
    if failed or min(spread) < _SINGULAR * max(spread):
        return np.dot(_pinv(matrix), right)  # type: ignore[no-any-return]
    found: Floats = solution
    return found


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
