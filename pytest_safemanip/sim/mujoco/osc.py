"""The posture that operational-space control takes, without the physics of anything else.

The controller's own law (Khatib 1987, as robosuite has it) drives the arm alone: with gravity and
Coriolis forces compensated, accelerations follow from its mass matrix. Which of the postures with
the same hand the arm takes, how its elbow lags behind and what its joints' limits do to the hand is
in that law, and is therefore not asked of an inverse kinematics.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.trace.geometry import cross, matrix

Floats = NDArray[np.float64]

SUBSTEPS = 2
"""Steps of the law in a control period: implicit in the damping, it is stable at any length."""
TURN_GAIN = 0.75
"""Share of the remaining rotation that scripts ask for in a control period."""


@dataclass(frozen=True)
class Arm:
    """An arm under operational-space control.

    Attributes:
        site: id of the site that it moves.
        base: id of the body that its goals are relative to.
        qpos: addresses of its joints (J,).
        dof: likewise (J,).
        home: positions that its spare joint is pulled to (J,).
        stiffness: of the hand, 1/s2.
        damping: of the hand, 1/s.
        pull: stiffness towards home, 1/s2; critically damped.
        step: position that a control period may ask for, m.
        spin: rotation that it may ask for, rad.
        period: of control, s.
    """

    site: int
    base: int
    qpos: NDArray[np.intp]
    dof: NDArray[np.intp]
    home: Floats
    stiffness: float
    damping: float
    pull: float
    step: float
    spin: float
    period: float


class Law:
    """Moves an arm in ``MjData`` that nothing else uses.

    Args:
        model: a ``mujoco.MjModel``.
        data: ``MjData``.
        arm: whose law it is.
    """

    def __init__(self, model: Any, data: Any, arm: Arm) -> None:
        self._model, self._data, self._arm = model, data, arm
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, full, np.arange(1.0, model.nM + 1.0))
        self._mass = full[np.ix_(arm.dof, arm.dof)].astype(np.intp) - 1
        joints = model.dof_jntid[arm.dof]
        self._low, self._high = model.jnt_range[joints].T
        self._jac = np.zeros((6, model.nv))
        self._position = data.site_xpos[arm.site]
        self._frame = data.site_xmat[arm.site].reshape(3, 3)
        self.rest()

    def rest(self) -> None:
        """Begin at the velocities of the data."""
        self._velocity = np.array(self._data.qvel[self._arm.dof])

    @property
    def pose(self) -> tuple[Floats, Floats]:
        """Position (3,) and frame (3, 3) of the hand."""
        return self._position.copy(), self._frame.copy()

    def apart(self, goal: tuple[Floats, Floats]) -> tuple[float, float]:
        """Distance, m, and angle, rad, from a goal."""
        turn = _rotation_vector(goal[1] @ self._frame.T)
        return float(np.linalg.norm(goal[0] - self._position)), float(np.linalg.norm(turn))

    @property
    def speed(self) -> float:
        """Of the joint that moves fastest, rad/s."""
        return float(np.abs(self._velocity).max())

    def advance(self, goal: tuple[Floats, Floats], speed: float) -> None:
        """Go on for a control period towards a goal, kinematics up to date before and after.

        Args:
            goal: position (3,) and frame (3, 3), world.
            speed: share of the top speed.
        """
        arm = self._arm
        position = self._position + _limited(goal[0] - self._position, speed * arm.step)
        turn = TURN_GAIN * _rotation_vector(goal[1] @ self._frame.T)
        frame = _about(_limited(turn, arm.spin)) @ self._frame
        self.hold((position, frame))

    def hold(self, goal: tuple[Floats, Floats]) -> None:
        """Go on for a control period with this goal of the controller's."""
        self._refresh()
        for _ in range(SUBSTEPS):
            self._substep(*goal, self._arm.period / SUBSTEPS)
            mujoco.mj_kinematics(self._model, self._data)

    def _refresh(self) -> None:
        """The law's matrices, which depend on the posture alone and hardly change in a period."""
        model, data, arm = self._model, self._data, self._arm
        mujoco.mj_comPos(model, data)
        _INERTIA(model, data)
        mujoco.mj_jacSite(model, data, self._jac[:3], self._jac[3:], arm.site)
        jac = self._jac[:, arm.dof]
        self._mobility = np.linalg.inv(data.qM[self._mass])
        moved = self._mobility @ jac.T
        inertia = jac @ moved
        halves = (slice(3), slice(3, 6))
        push = [np.linalg.solve(inertia[h, h] + _EYE6[h, h], moved[:, h].T) for h in halves]
        self._push = np.concatenate(push).T
        self._free = np.eye(len(arm.dof)) - moved @ np.linalg.solve(inertia + _EYE6, jac)
        brake = arm.damping * self._push @ jac + 2.0 * np.sqrt(arm.pull) * self._free
        dt = arm.period / SUBSTEPS
        self._slowed = np.linalg.inv(np.eye(len(arm.dof)) + dt * brake)

    def _substep(self, position: Floats, frame: Floats, dt: float) -> None:
        data, arm, mobility = self._data, self._arm, self._mobility
        error = np.empty(6)
        error[:3] = position - self._position
        error[3:] = 0.5 * cross(self._frame.T, frame.T).sum(axis=0)
        away = arm.home - data.qpos[arm.qpos]
        wanted = arm.stiffness * self._push @ error + arm.pull * self._free @ away
        velocity = self._slowed @ (self._velocity + dt * wanted)
        joints = data.qpos[arm.qpos] + dt * velocity
        for _ in range(2):
            # At the end of its way a joint is stopped by a torque, which moves the others too.
            over = joints - np.clip(joints, self._low, self._high)
            if not over.any():
                break
            joint = int(np.abs(over).argmax())
            back = mobility[joint] * over[joint] / mobility[joint, joint]
            joints, velocity = joints - back, velocity - back / dt
        data.qpos[arm.qpos] = np.clip(joints, self._low, self._high)
        self._velocity = velocity


_INERTIA = mujoco.mj_makeM if hasattr(mujoco, "mj_makeM") else mujoco.mj_crb
"""Fills the mass matrix; MuJoCo 3.3.1 has the second one alone."""
_EYE6 = 1e-6 * np.eye(6)
"""Keeps singular postures solvable, 1/kg."""


def _limited(vector: Floats, length: float) -> Floats:
    norm = float(np.linalg.norm(vector))
    return vector * (length / norm) if norm > length else vector


def _rotation_vector(rotation: Floats) -> Floats:
    quat, vector = np.empty(4), np.empty(3)
    mujoco.mju_mat2Quat(quat, rotation.ravel())
    mujoco.mju_quat2Vel(vector, quat, 1.0)
    return vector


def _about(vector: Floats) -> Floats:
    quat = np.array((1.0, 0.0, 0.0, 0.0))
    mujoco.mju_quatIntegrate(quat, vector, 1.0)
    return np.asarray(matrix(quat), np.float64)
