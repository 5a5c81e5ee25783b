"""One control period within a tolerance of robosuite's ``env.step``, at a fifth of its cost.

The physics and the controllers' laws are the same. Operational-space control multiplies errors and
velocities, which follow the state at every physics substep here too, by matrices that depend on the
posture alone. These cost ten times as much as the rest, and within 10 ms a joint turns by less than
0.03 rad: they are continued linearly for as many substeps as that hardly changes a torque. What
lies still is left out of the physics meanwhile.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.robocasa.patches.memo import ContactCheck
from pytest_safemanip.sim.robocasa.stepping.control import ArmController, TorsoController, span
from pytest_safemanip.sim.robocasa.stepping.exact import Stepper
from pytest_safemanip.sim.robocasa.stepping.sleeping import Asleep

Floats = NDArray[np.float64]

EVERY = 5
"""Most substeps between two evaluations of the matrices."""
WRONG = 0.15
"""By how much continuing them may make a torque wrong before they are evaluated again, N m: in
sight of singular postures and of limits that is at every substep."""


class FastStepper(Stepper):
    """Steps one RoboCasa environment within a tolerance; see :class:`Stepper`.

    From equal states, 40 random actions leave the joint positions within 2e-3 rad or m of those
    of :class:`Stepper`, near singular postures 20 do, unless the robot is hit.

    Args:
        env: after its reset, with a PandaOmron.
        after_substep: called with the live ``MjData`` after each physics substep; must only read.
        asleep: told who sleeps before that.
    """

    def __init__(
        self, env: Any, after_substep: Callable[[Any], None], asleep: Asleep | None = None
    ) -> None:
        super().__init__(env, after_substep)
        self._asleep = asleep or Asleep(self._model)
        env.check_contact = ContactCheck(env.sim, self._asleep.pairs)
        controls = self._controls
        self._law = _Law(self._model, self._data, controls.arm, controls.torso)
        index = np.concatenate([controls.actuators[name].index for name in ("torso", "right")])
        self._index = span(index)
        self._low, self._high = self._model.actuator_ctrlrange[index].T.copy()

    def step(self, action: Floats) -> None:
        """Run one control period."""
        with self._asleep.allowed():
            self._run(action)
        self._env.cur_time += self._env.control_timestep
        self._env._post_action(action)

    def _run(self, action: Floats) -> None:
        env, model, data, law = self._env, self._model, self._data, self._law
        ctrl, index, low, high = data.ctrl, self._index, self._low, self._high
        env.timestep += 1
        for substep in range(self._substeps):
            mujoco.mj_step1(model, data)
            if substep == 0:
                self._controls.set_goals(action)
                law.set_goals()
            law.advance()
            torques = law.torques()
            np.maximum(torques, low, out=torques)
            np.minimum(torques, high, out=torques)
            ctrl[index] = torques
            if substep == self._substeps - 1:
                self._controls.arm.note_origin()
            mujoco.mj_step2(model, data)
            self._asleep.note(data)
            self._after(data)


class _Law:
    """Torques of torso and arm (1 + 7) as a matrix times what is measured, plus the bias.

    Measured are, in this order: where the end effector should be and where the arm's base is, and
    where the end effector is (3 each); its orientation as it should be times the inverse of what
    it is (9); the positions of the torso's and the arm's joints (8), what they should be (8), and
    the velocities of the robot's dofs (D).
    """

    def __init__(self, model: Any, data: Any, arm: ArmController, torso: TorsoController) -> None:
        self._arm, self._torso, self._data = arm, torso, data
        dofs = [torso.dof, *np.arange(model.nv)[arm.dofs]]
        addresses = [torso.address, *np.arange(model.nq)[arm.joints]]
        moving = np.flatnonzero(model.dof_treeid == model.dof_treeid[torso.dof])
        first = int(moving[0])
        self._moving = slice(first, first + len(moving))
        self._own = np.array(dofs) - first
        self._dofs, self._addresses = span(dofs), span(addresses)
        rows, dims = len(dofs), self._moving.stop - self._moving.start
        shape = (rows, 18 + 2 * rows + dims)
        # For the present substep, as computed last and before, and the change per substep.
        self._matrix, self._now, self._before, self._drift = (np.zeros(shape) for _ in range(4))
        self._goal, self._turned = np.zeros((3, 4)), np.zeros((3, 4))
        self._inputs, self._torques = np.zeros(shape[1]), np.zeros(rows)
        ends = np.cumsum((3, 3, 3, 9, rows, rows, dims))
        parts = np.split(self._inputs, ends[:-1])
        self._aim, self._origin, self._position, turn, self._at, self._home, self._velocity = parts
        self._turn = turn.reshape(3, 3)
        self._posture = slice(ends[3], ends[4]), slice(ends[4], ends[5]), slice(ends[5], None)
        self._fill(self._now)
        self._interval, self._left = 1, 0

    def set_goals(self) -> None:
        """Take over the goals that the controllers have."""
        arm = self._arm.controller
        self._goal[:, :3], self._goal[:, 3] = arm.goal_ori, arm.goal_pos
        self._home[0], self._home[1:] = self._torso.goal, arm.initial_joint

    def advance(self) -> None:
        """Go on to the next substep: continue the matrix linearly, or compute it where that is due.

        To be called once a substep, when the state is up to date.
        """
        if self._left == 0:
            self._refresh()
        else:
            self._matrix += self._drift
        self._left -= 1

    def _refresh(self) -> None:
        """Compute the matrix for the present posture, and decide when to do so next."""
        self._now, self._before = self._before, self._now
        self._fill(self._now)
        # What the matrix continued to this substep would have been wrong by, in torque.
        self._matrix += self._drift
        self._matrix -= self._now
        wrong = float(np.abs(np.dot(self._matrix, self._inputs)).max())
        self._matrix[:] = self._now
        np.subtract(self._now, self._before, out=self._drift)
        self._drift /= self._interval
        # It grows with the square of the time.
        longest = self._interval * math.sqrt(WRONG / max(wrong, 1e-9))
        self._interval = self._left = int(min(max(longest, 1), EVERY))

    def _fill(self, matrix: Floats) -> None:
        arm, (at, home, velocity) = self._arm, self._posture
        push, relative, free = arm.gains(self._moving)
        matrix[1:, :18] = np.dot(push * arm.controller.kp, _ERROR)
        stiff, damped = matrix[1:, home][:, 1:], matrix[1:, velocity]
        np.multiply(free, arm.stiffness, out=stiff)
        np.negative(stiff, out=matrix[1:, at][:, 1:])
        damped[:] = np.dot(push * -arm.controller.kd, relative)
        damped[:, self._own[1:]] -= free * arm.damping
        kp, kd = self._torso.gains()
        matrix[0, home.start], matrix[0, at.start] = kp, -kp
        matrix[0, velocity.start + self._own[0]] = -kd

    def torques(self) -> Floats:
        """Torques of the present state (8,), not yet clipped to their limits."""
        arm, data, turned = self._arm, self._data, self._turned
        self._origin[:], frame = arm.origin
        np.dot(frame, self._goal, out=turned)
        self._aim[:] = turned[:, 3]
        self._position[:] = arm.position
        np.dot(turned[:, :3], arm.frame.T, out=self._turn)
        self._at[:] = data.qpos[self._addresses]
        self._velocity[:] = data.qvel[self._moving]
        torques = np.dot(self._matrix, self._inputs, out=self._torques)
        torques += data.qfrc_bias[self._dofs]
        return torques


def _error() -> Floats:
    """The end effector's error (6) as a matrix times the first eighteen of what is measured."""
    error = np.zeros((6, 18))
    error[:3, :9] = np.hstack((np.eye(3), np.eye(3), -np.eye(3)))
    # Half the sum of the cross products of the frames' axes: how far the product is from symmetric.
    for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        error[3 + x, 9 + 3 * z + y], error[3 + x, 9 + 3 * y + z] = 0.5, -0.5
    return error


_ERROR = _error()
