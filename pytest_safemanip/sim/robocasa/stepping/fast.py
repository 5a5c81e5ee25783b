"""One control period within a tolerance of robosuite's ``env.step``, at an eighth of its cost.

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

from pytest_safemanip.sim.mujoco.sleeping import Asleep
from pytest_safemanip.sim.robocasa.patches.memo import ContactCheck
from pytest_safemanip.sim.robocasa.stepping.control import ArmController, TorsoController
from pytest_safemanip.sim.robocasa.stepping.exact import Stepper

Floats = NDArray[np.float64]

EVERY = 5
"""Most substeps between two evaluations of the matrices."""
WRONG = 0.15
"""By how much continuing them may make a torque wrong before they are evaluated again, N m: in
sight of singular postures and of limits that is at every substep."""


class LawStepper(Stepper):
    """Steps one RoboCasa environment as :class:`Stepper` does but for rounding, in half the time:
    torques are a matrix times what is measured, without pseudo-inverses.

    Args:
        env: after its reset, with a PandaOmron.
        after_substep: called with the live ``MjData`` after each physics substep; must only read.
        every: most substeps between two evaluations of the matrix.
    """

    def __init__(self, env: Any, after_substep: Callable[[Any], None], every: int = 1) -> None:
        super().__init__(env, after_substep)
        controls = self._controls
        controls.arm.controller.set_goal = controls.arm.set_goal
        self._law = _Law(self._model, self._data, controls.arm, controls.torso, every)
        parts = [controls.actuators[name].index for name in ("torso", "right")]
        self._index = np.concatenate(parts)

    def step(self, action: Floats) -> None:
        """Run one control period."""
        self._run(action)
        self._env.cur_time += self._env.control_timestep
        self._env._post_action(action)

    def _run(self, action: Floats) -> None:
        env, model, data, law = self._env, self._model, self._data, self._law
        ctrl, index, after = data.ctrl, self._index, self._after
        env.timestep += 1
        for substep in range(self._substeps):
            mujoco.mj_step1(model, data)
            if substep == 0:
                self._controls.set_goals(action)
                law.set_goals()
            # MuJoCo itself keeps them within the actuators' range.
            ctrl[index] = law.torques()
            if substep == self._substeps - 1:
                self._controls.arm.note_origin()
            mujoco.mj_step2(model, data)
            after(data)


class FastStepper(LawStepper):
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
        super().__init__(env, self._noted, EVERY)
        self._told = after_substep
        self._asleep = asleep or Asleep(self._model)
        env.check_contact = ContactCheck(env.sim, self._asleep.pairs)

    def _noted(self, data: Any) -> None:
        self._asleep.note(data)
        self._told(data)

    def _run(self, action: Floats) -> None:
        with self._asleep.allowed():
            super()._run(action)


class _Law:
    """Torques of torso and arm (1 + 7) as a matrix times what is measured, plus the bias.

    Measured are, in this order: how far the end effector is from where it should be (3); its
    orientation as it should be times the inverse of what it is (9); how far the torso's and the
    arm's joints are from where they should be (8); and the velocities of the robot's dofs (D).

    The matrix is a product: torques per acceleration (8, 14), which the posture decides, times
    accelerations of the torso, the end effector (6) and, towards home, the arm (7).
    """

    def __init__(
        self, model: Any, data: Any, arm: ArmController, torso: TorsoController, every: int
    ) -> None:
        self._arm, self._torso, self._every = arm, torso, every
        # The arm's joints come right after the torso's.
        rows = 1 + len(arm.controller.qvel_index)
        moving = np.flatnonzero(model.dof_treeid == model.dof_treeid[torso.dof])
        self._moving = slice(moving[0], moving[-1] + 1)
        self._bias = data.qfrc_bias[torso.dof : torso.dof + rows]
        self._positions = data.qpos[torso.address : torso.address + rows]
        self._velocities = data.qvel[self._moving]
        self._base, self._base_frame = arm.origin
        self._end, self._inverse = arm.position, arm.frame.T
        self._goal, self._turned, self._home = np.zeros((3, 4)), np.zeros((3, 4)), np.zeros(rows)
        self._axes, self._aim = self._turned[:, :3], self._turned[:, 3]
        ends = np.cumsum((3, 9, rows, len(moving)))
        self._inputs, self._torques = np.zeros(ends[-1]), np.zeros(rows)
        self._apart, turn, self._away, self._velocity = np.split(self._inputs, ends[:-1])
        self._turn = turn.reshape(3, 3)
        self._inertias = np.zeros((rows, 6 + rows))
        self._accelerations = self._constant(rows, torso.dof - int(moving[0]))
        # For the present substep, as computed last and before, and the change per substep.
        shape = rows, len(self._inputs)
        self._matrix, self._now, self._before, self._drift = (np.zeros(shape) for _ in range(4))
        self._fill(self._now)
        self._interval, self._left = 1, 0

    def _constant(self, rows: int, own: int) -> Floats:
        """The accelerations, but for what velocities do to the end effector's.

        Args:
            rows: number of torques.
            own: which of the robot's dofs is the torso's.
        """
        arm, controller, towards_home = self._arm, self._arm.controller, np.eye(rows)[1:]
        made = np.zeros((6 + rows, len(self._inputs)))
        torso, end, joints = made[0], made[1:7], made[7:]
        away, velocity = 12, 12 + rows
        torso[away], damping = self._torso.gains
        torso[velocity + own] = -damping
        end[:, :away] = controller.kp[:, None] * _ERROR
        joints[:, away:velocity] = arm.stiffness * towards_home
        joints[:, velocity + own :][:, :rows] = -arm.damping * towards_home
        self._friction, self._damping = end[:, velocity:], -controller.kd[:, None]
        return made

    def set_goals(self) -> None:
        """Take over the goals that the controllers have."""
        arm = self._arm.controller
        self._goal[:, :3], self._goal[:, 3] = arm.goal_ori, arm.goal_pos
        self._home[0], self._home[1:] = self._torso.goal, arm.initial_joint

    def torques(self) -> Floats:
        """Torques of the next substep (8,), not yet clipped to their limits.

        To be called once a substep, when the state is up to date.
        """
        self._measure()
        if self._every == 1:
            self._fill(self._matrix)
        elif self._left == 0:
            self._refresh()
        else:
            self._matrix += self._drift
        self._left -= 1
        torques = self._matrix.dot(self._inputs, self._torques)
        torques += self._bias
        return torques

    def _measure(self) -> None:
        self._base_frame.dot(self._goal, self._turned)
        self._axes.dot(self._inverse, self._turn)
        np.add(self._aim, self._base, out=self._apart)
        self._apart -= self._end
        np.subtract(self._home, self._positions, out=self._away)
        self._velocity[:] = self._velocities

    def _refresh(self) -> None:
        """Compute the matrix for the present posture, and decide when to do so next."""
        self._now, self._before = self._before, self._now
        self._fill(self._now)
        # What the matrix continued to this substep would have been wrong by, in torque.
        self._matrix += self._drift
        self._matrix -= self._now
        wrong = max(map(abs, self._matrix.dot(self._inputs).tolist()))
        self._matrix[:] = self._now
        np.subtract(self._now, self._before, out=self._drift)
        self._drift /= self._interval
        # It grows with the square of the time; after short intervals little is known of long ones.
        longest = self._interval * math.sqrt(WRONG / max(wrong, 1e-9))
        self._interval = self._left = int(min(max(longest, 1), 2 * self._interval, self._every))

    def _fill(self, matrix: Floats) -> None:
        push, relative, free = self._arm.gains(self._moving)
        inertias = self._inertias
        inertias[0, 0] = self._torso.inertia
        inertias[1:, 1:7], inertias[1:, 7:] = push, free
        np.multiply(relative, self._damping, out=self._friction)
        inertias.dot(self._accelerations, matrix)


def _error() -> Floats:
    """The end effector's error (6) as a matrix times the first twelve of what is measured."""
    error = np.zeros((6, 12))
    error[:3, :3] = np.eye(3)
    # Half the sum of the cross products of the frames' axes: how far the product is from symmetric.
    for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        error[3 + x, 3 + 3 * z + y], error[3 + x, 3 + 3 * y + z] = 0.5, -0.5
    return error


_ERROR = _error()
