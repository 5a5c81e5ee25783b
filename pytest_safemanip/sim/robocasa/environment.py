"""RoboCasa's own environments, made and reset."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import ConfigError, TaskError, did_you_mean
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.robocasa import scenes
from pytest_safemanip.sim.robocasa.liquids import fills_of, with_particles
from pytest_safemanip.sim.robocasa.patches import environments
from pytest_safemanip.sim.robocasa.robot import ROBOT_MODEL
from pytest_safemanip.sim.robocasa.stepping.exact import Controls
from pytest_safemanip.sim.staging import Add, Store

ARGUMENTS = {
    "robots": ROBOT_MODEL,
    "has_renderer": False,
    "has_offscreen_renderer": False,
    "use_camera_obs": False,
    "renderer": "mujoco",
    "ignore_done": True,
}
"""Of every environment: headless, without observations, without an end of its own."""

_UNPLACED = "could not initialize task"
"""In what RoboCasa says when no place was found in fifty attempts."""


def make(request: Request, assets_root: Path, edit: Callable[[str], str] | None = None) -> Any:
    """A RoboCasa environment after its reset, headless and without observations.

    Args:
        request: which episode.
        assets_root: the folder that RoboCasa was loaded with.
        edit: changes the XML of its model.

    Raises:
        ConfigError: if RoboCasa has no such task.
        TaskError: if its objects cannot be drawn as is asked, or find no place, or if the kitchen
            lacks a fixture that the task is about.
    """
    arguments = scenes.arguments(request.scenes, assets_root, request.kitchen, request.style)
    env = unset(request.task, request.seed, **arguments)
    if request.object_groups:
        environments.choose_objects(env, request.object_groups)
    added = [change.category for change in request.changes if isinstance(change, Add | Store)]
    if added:
        environments.add_objects(env, added)
    fills = fills_of(request.changes)

    def edited(model: str) -> str:
        changed = edit(model) if edit is not None else model
        return with_particles(changed, fills) if fills else changed

    if edit is not None or fills:
        env.set_xml_processor(edited)
    with environments.quick_settling(env, Controls):
        try:
            env.reset()
        except Exception as error:
            _check_fixtures(env, request)
            if isinstance(error, RuntimeError) and _UNPLACED in str(error):
                raise TaskError(_no_place(request)) from error
            raise
    _check_fixtures(env, request)
    if added:
        environments.list_added(env)
    return env


def _check_fixtures(env: Any, request: Request) -> None:
    """Refuse a kitchen that lacks a fixture of the task: RoboCasa goes on with None.

    Raises:
        TaskError: if it does.
    """
    found = getattr(env, "fixture_refs", {})
    lacking = [
        role for role, of in found.items() if (of[0] if isinstance(of, tuple) else of) is None
    ]
    if not lacking:
        return
    where = f"the {request.scenes} kitchen"
    remedy = "--safemanip-scenes=target has RoboCasa's own kitchens"
    if request.scenes == "compact":
        where = f"the compact kitchen {request.kitchen or 'small'!r}"
        if request.kitchen != "full":
            remedy = f"'compact: {{kitchen: full}}' in the task's file asks for more, {remedy}"
    raise TaskError(f"{where} has no fixture for {', '.join(map(repr, lacking))}; {remedy}")


def _no_place(request: Request) -> str:
    """That objects of an episode do not fit into its scene."""
    drawn = [f"{role} ({', '.join(of)})" for role, of in request.object_groups.items()]
    remedy = f"; draw smaller ones than {', '.join(drawn)}" if drawn else ""
    return f"seed {request.seed}: RoboCasa finds no place for the task's objects{remedy}"


def unset(task: str, seed: int, **arguments: Any) -> Any:
    """A RoboCasa environment before its reset, headless and without observations.

    Args:
        task: its name.
        seed: of its random numbers.
        arguments: of the environment, beside those that are always the same.

    Raises:
        ConfigError: if RoboCasa has no such task.
    """
    import robosuite
    from robocasa.environments.kitchen.kitchen import REGISTERED_KITCHEN_ENVS
    from robosuite.controllers import load_composite_controller_config

    if task not in REGISTERED_KITCHEN_ENVS:
        hint = did_you_mean(task, REGISTERED_KITCHEN_ENVS)
        raise ConfigError(f"RoboCasa has no task {task!r}; {hint}")
    env = robosuite.make(
        task,
        controller_configs=load_composite_controller_config(robot=ROBOT_MODEL),
        seed=seed,
        **{**ARGUMENTS, **arguments},
    )
    environments.keep_layout_fresh(env)
    return env


def horizon(task: str) -> int:
    """The number of control steps that RoboCasa's own evaluation gives a task."""
    from robocasa.utils.dataset_registry_utils import get_task_horizon

    return int(get_task_horizon(task))


def instruction(env: Any) -> str:
    """The task's instruction in this episode."""
    return str(env.get_ep_meta()["lang"])
