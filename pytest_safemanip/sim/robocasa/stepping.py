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

from pytest_safemanip.sim.robocasa.control import Actuators, Arm, Torso
from pytest_safemanip.sim.robocasa.memo import ContactCheck

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
            name: Actuators(self._model, self._data, index[name]) for name in controllers
        }
        self._arm = Arm(env.sim, controllers["right"])
        self._torso = Torso(env.sim, controllers["torso"])
        self._constant = [(n, c) for n, c in controllers.items() if n not in ("right", "torso")]
        self._substeps = int(env.control_timestep / env.model_timestep)
        # Nothing reads the sensors, which robosuite's grippers bring; the state is the same.
        self._model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
        # The fixtures ask for their joints' addresses and their buttons' contacts at every step.
        env.sim.model.get_joint_qpos_addr = functools.cache(env.sim.model.get_joint_qpos_addr)
        env.check_contact = ContactCheck(env.sim)

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
