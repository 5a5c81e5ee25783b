"""One control period, bit-identical to robosuite's ``env.step`` and a fraction of its cost.

Stock stepping spends most of its time in Python: observables nobody reads, four controllers that
each refill the whole mass matrix at every physics substep, limits rebuilt three times. Here the
arm and the torso, which change within a control period, are evaluated at every substep with the
same operations in the same order on arrays of the same layout (the layout decides which BLAS
routine runs); the base and the gripper, which do not change, once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.robocasa.patches.environments import quicken
from pytest_safemanip.sim.robocasa.stepping.control import Actuators, ArmController, TorsoController

Floats = NDArray[np.float64]


class Controls:
    """The controllers of one RoboCasa environment, whose robot is a PandaOmron.

    Args:
        env: when its controllers are loaded.

    Attributes:
        arm: that of the arm.
        torso: that of the torso.
        actuators: of each part.
    """

    def __init__(self, env: Any) -> None:
        robot = env.robots[0]
        model, data = env.sim.model._model, env.sim.data._data
        self._composite = robot.composite_controller
        controllers = self._composite.part_controllers
        index = robot._ref_actuators_indexes_dict
        self.actuators = {name: Actuators(model, data, index[name]) for name in controllers}
        self.arm = ArmController(env.sim, controllers["right"])
        self.torso = TorsoController(env.sim, controllers["torso"])
        self._constant = [(n, c) for n, c in controllers.items() if n not in ("right", "torso")]

    def set_goals(self, action: Floats) -> None:
        """Begin an action, and do what does not change while it lasts."""
        self.arm.refresh()
        self.torso.refresh()
        # A copy: the base controller turns the command in place.
        self._composite.set_goal(np.array(action, dtype=np.float64))
        for name, controller in self._constant:
            self.actuators[name].apply(controller.run_controller())

    def act(self) -> None:
        """Do what is to be done at every substep, after ``mj_step1``."""
        self.actuators["right"].apply(self.arm.torques())
        self.actuators["torso"].apply(self.torso.torques())


class Stepper:
    """Steps one RoboCasa environment.

    Args:
        env: after its reset, with a PandaOmron.
        after_substep: called with the live ``MjData`` after each physics substep; must only read.
    """

    def __init__(self, env: Any, after_substep: Callable[[Any], None]) -> None:
        self._env, self._after = env, after_substep
        self._model, self._data = env.sim.model._model, env.sim.data._data
        self._controls = Controls(env)
        self._substeps = int(env.control_timestep / env.model_timestep)
        # Nothing reads the sensors, which robosuite's grippers bring; the state is the same.
        self._model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
        quicken(env)

    def step(self, action: Floats) -> None:
        """Run one control period, as ``env.step(action)`` does, without its observations."""
        env, model, data, controls = self._env, self._model, self._data, self._controls
        env.timestep += 1
        for substep in range(self._substeps):
            mujoco.mj_step1(model, data)
            if substep == 0:
                controls.set_goals(action)
            controls.act()
            mujoco.mj_step2(model, data)
            self._after(data)
        env.cur_time += env.control_timestep
        env._post_action(action)
