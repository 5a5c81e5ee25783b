"""The arm and the base of a PandaOmron, as foresight needs them."""

from __future__ import annotations

from typing import Any

import numpy as np

from pytest_safemanip.sim.mujoco.description import Description
from pytest_safemanip.sim.mujoco.foresight import Foresight
from pytest_safemanip.sim.mujoco.osc import Arm

WHEELS = tuple(f"mobilebase0_joint_mobile_{way}" for way in ("forward", "side", "yaw"))
TORSO = "mobilebase0_joint_torso_height"
PULL = 10.0
"""robosuite's stiffness towards the home posture, 1/s2, which its controller does not keep."""


def open_foresight(env: Any, description: Description) -> Foresight:
    """Foresight in an environment.

    Args:
        env: after its reset.
        description: of its scene.
    """
    model = env.sim.model._model
    controller = env.robots[0].composite_controller.part_controllers["right"]
    arm = Arm(
        site=description.hands[0].site,
        base=description.base,
        qpos=np.array(controller.qpos_index, np.intp),
        dof=np.array(controller.qvel_index, np.intp),
        home=np.array(controller.initial_joint),
        stiffness=float(controller.kp[0]),
        damping=float(controller.kd[0]),
        pull=PULL,
        step=float(controller.output_max[0]),
        spin=float(controller.output_max[3]),
        period=float(env.control_timestep),
    )
    wheels = tuple(model.joint(name).id for name in WHEELS)
    torso = model.joint(TORSO).id
    return Foresight(model, env.sim.data._data, description, arm, wheels, torso)
