"""Physics between recorded states: what touched what, and how hard, is in no data set.

From each state a short time is simulated again. The robot is led to its next recorded state, by
computed torques; fingers that touch something press as they were commanded, with the model's own
actuators: where they stand does not tell how hard they press.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.mujoco.description import Description, find
from pytest_safemanip.sim.mujoco.extents import below
from pytest_safemanip.sim.mujoco.layout import HandLayout, Layout
from pytest_safemanip.sim.mujoco.stability import check_stable
from pytest_safemanip.trace.elements import ROBOT

Floats = NDArray[np.float64]

FIRMNESS = 2.5
"""Natural frequency at which joints are held on their way, times the seconds to the next state: 50
rad/s for 20 states a second; critically damped. At that, torques agree best with those that the
demonstrations of robosuite 1.0 have (``joint_torques``): within 6 N m while the table is wiped. At
three times that it is 65 N m, since states of another MuJoCo lie deeper in what they touch."""
FASTEST = 0.5
"""Largest natural frequency times the physics step: beyond, the control would not be stable."""


@dataclass(frozen=True)
class State:
    """A state of a simulation.

    Attributes:
        qpos: MuJoCo's positions (nq,).
        qvel: MuJoCo's velocities (nv,).
    """

    qpos: Floats
    qvel: Floats


@dataclass(frozen=True)
class _Hand:
    """What moves a hand.

    Attributes:
        led: which of the joints that are led are its (L,).
        geoms: which geoms are of its fingers (ngeom,).
        actuators: ids (K,).
        opens: their controls when it opens (K,).
        closes: when it closes (K,).
    """

    led: NDArray[np.bool_]
    geoms: NDArray[np.bool_]
    actuators: NDArray[np.intp]
    opens: Floats
    closes: Floats


class Resimulation:
    """Simulates from one recorded state to the next.

    Args:
        model: a ``mujoco.MjModel``, which stays as it is.
        layout: what is what in it.
        description: read by it.

    Attributes:
        data: ``MjData`` of the present substep.
        fingers: qpos addresses of the fingers' joints (F,).
    """

    def __init__(self, model: Any, layout: Layout, description: Description) -> None:
        self._model = copy.copy(model)
        self.data = mujoco.MjData(self._model)
        robot = np.zeros(model.nbody, bool)
        for body in layout.robot.bodies:
            robot |= below(model, find(model, "body", body, "the robot"))
        kinds = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
        joints = np.flatnonzero(robot[model.jnt_bodyid] & np.isin(model.jnt_type, kinds))
        self._qpos, self._dof = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        of_robot = [part.entity == ROBOT for part in description.table.parts]
        self._foreign = ~np.append(of_robot, True)[description.table.of_geom]
        self._hands = [_hand(self._model, hand, joints) for hand in layout.robot.hands]
        of_fingers = [hand.led for hand in self._hands]
        self.fingers = self._qpos[np.any([np.zeros(len(joints), bool), *of_fingers], axis=0)]
        self._gain, self._bias = model.actuator_gainprm.copy(), model.actuator_biasprm.copy()

    def put(self, state: State) -> None:
        """Set a recorded state; nothing is derived from it yet."""
        self.data.qpos[:], self.data.qvel[:] = state.qpos, state.qvel

    def run(self, state: State, then: State, count: int, commands: Floats) -> Iterator[None]:
        """Substeps from a state, with the robot led to another.

        Args:
            state: where they begin.
            then: where the robot is after the last one.
            count: how many.
            commands: to the grippers, above 0 to close (G,).

        Yields:
            After each substep, when contacts and forces belong together.

        Raises:
            TraceError: if it comes to numbers that are not finite.
        """
        self.put(state)
        model, data, dof, qpos = self._model, self.data, self._dof, self._qpos
        way = _way(state, then, qpos, dof, count, model.opt.timestep)
        led = np.ones(len(dof), bool)
        step = model.opt.timestep
        firm = min(FIRMNESS / (count * step), FASTEST / step)
        pull = np.zeros(model.nv)
        torque = np.empty(model.nv)
        for number, (position, speed, acceleration) in enumerate(zip(*way, strict=True)):
            mujoco.mj_step1(model, data)
            if number == 0:
                led = self._press(commands)
            off, slow = position - data.qpos[qpos], speed - data.qvel[dof]
            pull[dof] = acceleration + firm * (firm * off + 2.0 * slow)
            mujoco.mj_mulM(model, data, torque, pull)
            torque += data.qfrc_bias - data.qfrc_passive
            data.qfrc_applied[dof] = np.where(led, torque[dof], 0.0)
            mujoco.mj_step2(model, data)
            yield
        check_stable(data)

    def _press(self, commands: Floats) -> NDArray[np.bool_]:
        """Switch on the actuators of hands whose fingers touch something.

        Returns:
            Which joints are led (L,): all others.
        """
        model, data = self._model, self.data
        model.actuator_gainprm[:], model.actuator_biasprm[:] = 0.0, 0.0
        led = np.ones(len(self._dof), bool)
        pairs = data.contact.geom[data.contact.dist <= 0.0]
        for hand, command in zip(self._hands, commands, strict=True):
            mine, foreign = hand.geoms[pairs], self._foreign[pairs]
            if not (mine & foreign[:, ::-1]).any() or not len(hand.actuators):
                continue
            led &= ~hand.led
            ids = hand.actuators
            model.actuator_gainprm[ids] = self._gain[ids]
            model.actuator_biasprm[ids] = self._bias[ids]
            data.ctrl[ids] = hand.closes if command > 0 else hand.opens
        return led


def _way(
    state: State, then: State, qpos: Any, dof: Any, count: int, dt: float
) -> tuple[Floats, Floats, Floats]:
    """Positions, speeds and accelerations of joints at the substeps of the cubic between two
    states ((count, L) each).
    """
    span = count * dt
    q, v = state.qpos[qpos], state.qvel[dof] * span
    d, w = then.qpos[qpos] - q, then.qvel[dof] * span
    s = (np.arange(count) / count)[:, None]
    square, cube = 3.0 * d - 2.0 * v - w, v + w - 2.0 * d
    position = q + s * (v + s * (square + s * cube))
    speed = (v + s * (2.0 * square + s * 3.0 * cube)) / span
    return position, speed, (2.0 * square + 6.0 * s * cube) / span**2


def _hand(model: Any, hand: HandLayout, joints: NDArray[np.intp]) -> _Hand:
    what = f"hand {hand.spec.name!r}"
    fingers = np.zeros(model.nbody, bool)
    for name in (name for group in hand.fingers for name in group):
        fingers |= below(model, find(model, "body", name, what))
    own = [find(model, "joint", joint.name, what) for joint in hand.joints]
    lengths = [
        _lengths(model, own, [getattr(joint, end) for joint in hand.joints])
        for end in ("opened", "closed")
    ]
    actuators = np.flatnonzero(np.abs(lengths[1] - lengths[0]) > 1e-9)
    opens, closes = (
        np.array([_control(model, what, int(a), lengths[1 - end], lengths[end]) for a in actuators])
        for end in (0, 1)
    )
    return _Hand(
        led=fingers[model.jnt_bodyid[joints]],
        geoms=fingers[model.geom_bodyid],
        actuators=actuators,
        opens=opens,
        closes=closes,
    )


def _lengths(model: Any, joints: Sequence[int], positions: Sequence[float]) -> Floats:
    """Lengths of all actuators with some joints somewhere (nu,)."""
    data = mujoco.MjData(model)
    for joint, position in zip(joints, positions, strict=True):
        data.qpos[model.jnt_qposadr[joint]] = position
    mujoco.mj_fwdPosition(model, data)
    lengths: Floats = data.actuator_length.copy()
    return lengths


def _control(model: Any, what: str, actuator: int, come_from: Floats, to: Floats) -> float:
    """The control that moves an actuator to a length with all it has: the end of its range."""
    if model.actuator_ctrllimited[actuator]:
        return float(model.actuator_ctrlrange[actuator, int(to[actuator] > come_from[actuator])])
    if model.actuator_biasprm[actuator, 1]:  # a position
        return float(to[actuator])
    name = model.actuator(actuator).name
    raise ConfigError(
        f"{what}: its actuator {name!r} has no ctrlrange, so that nobody knows a grip"
    )
