"""What RoboCasa's datasets have of an episode beside what a recording has."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.mujoco.drawing import Painter
from pytest_safemanip.sim.robocasa import environment, observation
from pytest_safemanip.sim.robocasa.description import open_reader
from pytest_safemanip.sim.robocasa.playback import episode_meta, model_xml, task_choices
from pytest_safemanip.sim.robocasa.playback.roots import file_roots
from pytest_safemanip.sim.robocasa.rendering.observing import proprioception
from pytest_safemanip.sim.robocasa.robot import ROBOT_MODEL
from pytest_safemanip.trace.scene import Scene


class Capture:
    """The scene of an episode, set up again and put into its states one after the other.

    Args:
        request: which episode.
        scene: its recording's, to see whether it is the same.
        assets_root: the folder that RoboCasa was loaded with.
        context: where to draw, see :mod:`~pytest_safemanip.sim.mujoco.graphics`;
            None if nothing is drawn.

    Attributes:
        meta: RoboCasa's description of the episode, plain JSON.
        model: the model's XML, without paths of this machine.

    Raises:
        ConfigError: if the scene is another one now.
    """

    def __init__(
        self, request: Request, scene: Scene, assets_root: Path, context: Any = None
    ) -> None:
        self._env = env = environment.make(request, assets_root)
        if open_reader(env).description.scene.bodies != scene.bodies:
            raise ConfigError(
                "the episode begins with other objects now; it is from other assets than these"
            )
        kitchen = (request.kitchen or "small") if request.scenes == "compact" else ""
        told = {**env.get_ep_meta(), task_choices.KEY: task_choices.choices(env)}
        self.meta = episode_meta.published(told, kitchen)
        self.model = model_xml.published(env.model.get_xml(), file_roots(assets_root))
        self._model = env.sim.model._model
        self._data = mujoco.MjData(self._model)
        self._painter = (
            None if context is None else Painter(self._model, context, observation.IMAGE_SIZE)
        )

    def pose(self, qpos: NDArray[Any]) -> None:
        """Set the positions of all joints (nq,)."""
        self._data.qpos[:] = qpos
        mujoco.mj_forward(self._model, self._data)

    def proprioception(self) -> dict[str, NDArray[np.float32]]:
        """The robot's own state, as in an observation."""
        return proprioception(self._env, self._data)

    def images(self) -> dict[str, NDArray[np.uint8]]:
        """The images of an observation; nothing if nothing is drawn."""
        if self._painter is None:
            return {}
        return {
            key: self._painter.take(self._data, key.removeprefix("video."))
            for key in observation.CAMERAS
        }

    def close(self) -> None:
        """Free what was uploaded for drawing."""
        if self._painter is not None:
            self._painter.close()


def environment_arguments(task: str, control_period: float) -> dict[str, Any]:
    """What RoboCasa's own tools make a task's environment of (``env_args`` of a dataset).

    Args:
        task: its name.
        control_period: s.
    """
    import robocasa
    from robosuite.controllers import load_composite_controller_config

    return {
        "env_name": task,
        "env_version": robocasa.__version__,
        "type": 1,  # robosuite, in robomimic's numbers
        "env_kwargs": {
            "robots": ROBOT_MODEL,
            "controller_configs": load_composite_controller_config(robot=ROBOT_MODEL),
            "control_freq": round(1 / control_period),
            "ignore_done": True,
            "use_object_obs": True,
            "translucent_robot": False,
        },
    }
