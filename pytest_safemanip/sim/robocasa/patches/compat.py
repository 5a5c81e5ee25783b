"""Supplies what RoboCasa 1.0.1 expects of robosuite and PyPI's robosuite 1.5.2 lacks.

RoboCasa is written against robosuite's unreleased master, which also calls itself 1.5.2. Three
things differ; each is supplied only when it is missing.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import OrderedDict
from typing import Any

import numpy as np

from pytest_safemanip.sim.robocasa.patches.table import NEEDED


def install() -> list[str]:
    """Supply what is missing; to be called once in a process.

    Returns:
        The names of what was supplied, empty on robosuite's master.
    """
    supplied = [name for name in SUPPLIES if NEEDED[name]()]
    for name in supplied:
        SUPPLIES[name]()
    return supplied


def _supply_task_flags() -> None:
    """``Task(enable_multiccd=..., enable_sleeping_islands=...)``: two flags of the model."""
    from robosuite.models.tasks.task import Task

    original = Task.__init__

    def init(
        self: Any,
        *args: Any,
        enable_multiccd: bool = False,
        enable_sleeping_islands: bool = False,
        **kwargs: Any,
    ) -> None:
        original(self, *args, **kwargs)
        for wanted, flag in ((enable_multiccd, "multiccd"), (enable_sleeping_islands, "sleep")):
            if wanted:
                ET.SubElement(ET.SubElement(self.root, "option"), "flag", {flag: "enable"})

    Task.__init__ = init


def _supply_deferred_load() -> None:
    """``load_model_on_init=False``: the constructor leaves the model to the first reset."""
    from robosuite.environments.manipulation.manipulation_env import ManipulationEnv

    original = ManipulationEnv.__init__
    loading = ("_load_model", "_initialize_sim", "initialize_renderer", "_reset_internal")

    def init(self: Any, *args: Any, load_model_on_init: bool = True, **kwargs: Any) -> None:
        if load_model_on_init:
            original(self, *args, **kwargs)
            return
        for name in loading:
            self.__dict__[name] = lambda *_, **__: None
        self.__dict__["_setup_observables"] = lambda *_, **__: OrderedDict()
        try:
            original(self, *args, **kwargs)
        finally:
            for name in (*loading, "_setup_observables"):
                self.__dict__.pop(name, None)
        self.sim = None

    ManipulationEnv.__init__ = init


def _supply_legacy_base() -> None:
    """The base controller that RoboCasa asks for: velocities in the frame of the base itself.

    The released controller turns a planar command by ``-(yaw - yaw0)``, after a quarter turn
    "backward" then drives forward. The legacy one turns it by ``+(yaw - yaw0)``.
    """
    import robosuite.utils.transform_utils as transform
    from robosuite.controllers.parts import controller_factory as factory

    base = factory.mobile_base_controllers.MobileBaseJointVelocityController

    class LegacyBaseController(base):  # type: ignore[misc, valid-type]
        def set_goal(self, action: Any, set_qpos: Any = None) -> None:
            yaw = transform.mat2euler(self.get_base_pose()[1])[2]
            turn = 2.0 * (yaw - transform.mat2euler(self.init_ori)[2])
            turned = np.array(action, float)
            cosine, sine = np.cos(turn), np.sin(turn)
            turned[0] = cosine * action[0] - sine * action[1]
            turned[1] = sine * action[0] + cosine * action[1]
            super().set_goal(turned, set_qpos)

    original = factory.mobile_base_controller_factory

    def mobile_base_controller_factory(name: str, params: Any) -> Any:
        if name == "JOINT_VELOCITY_LEGACY":
            return LegacyBaseController(interpolator=None, **params)
        return original(name, params)

    factory.mobile_base_controller_factory = mobile_base_controller_factory


SUPPLIES = {
    "task_flags": _supply_task_flags,
    "deferred_load": _supply_deferred_load,
    "legacy_base": _supply_legacy_base,
}
