"""robosuite's own environments, made and reset."""

from __future__ import annotations

import functools
import importlib
import importlib.util
from collections.abc import Sequence
from typing import Any

from pytest_safemanip.errors import ConfigError, install_command
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.robocasa.patches import importing
from pytest_safemanip.sim.robocasa.patches.memo import keep_model

PATCHES = ("settings", "quiet_import", "no_cv2", "robot_alone")
"""Those of what is changed for RoboCasa that are made here too."""


def check_installed() -> None:
    """Refuse to go on without robosuite; it is not imported.

    Raises:
        ConfigError: if it or MuJoCo is not installed.
    """
    for name in ("robosuite", "mujoco"):
        if importlib.util.find_spec(name) is None:
            raise ConfigError(f"{name} is not installed; {_remedy()}")


@functools.cache
def load() -> None:
    """Import robosuite, once per process.

    Raises:
        ConfigError: if it, or what it needs, is not installed.
    """
    with importing.quiet(), importing.robosuite_settings(), importing.stand_ins():
        try:
            robots = importlib.import_module("robosuite.models.robots")
        except ModuleNotFoundError as error:
            raise ConfigError(f"{error.name} is not installed; {_remedy()}") from error
    robots.RobotModel.set_mujoco_model = keep_model


def make(request: Request, robots: Sequence[str]) -> Any:
    """An environment after its reset, with what is robosuite's own wherever nothing is asked for.

    Args:
        request: which episode.
        robots: their names.
    """
    import robosuite

    env = robosuite.make(
        request.task,
        robots=list(robots) if len(robots) > 1 else robots[0],
        has_renderer=False,
        has_offscreen_renderer=False,
        use_camera_obs=False,
        renderer="mujoco",
        ignore_done=True,
        seed=request.seed,
    )
    env.reset()
    return env


def _remedy() -> str:
    return f"install it with: {install_command('robocasa')}"
