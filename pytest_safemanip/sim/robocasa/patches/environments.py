"""Patches of a single environment of RoboCasa, on the object itself."""

from __future__ import annotations

import atexit
import contextlib
import copy
import functools
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import yaml

from pytest_safemanip.sim.robocasa.patches.memo import ContactCheck, DrawerUpdate, LastCorners


def quicken(env: Any) -> None:
    """Let fixtures and tasks have the same answers sooner: at every step, and some several times,
    they ask for joints' addresses, buttons' contacts, drawers' interiors and objects' corners.
    """
    from robocasa.models.fixtures import Drawer

    env.sim.model.get_joint_qpos_addr = functools.cache(env.sim.model.get_joint_qpos_addr)
    env.check_contact = ContactCheck(env.sim)
    for fixture in env.fixtures.values():
        if type(fixture).update_state is Drawer.update_state:
            fixture.update_state = DrawerUpdate(fixture, env.sim)
    for thing in env.objects.values():
        thing.get_bbox_points = LastCorners(thing.get_bbox_points)


class Acts(Protocol):
    """What commands a robot's actuators."""

    def act(self) -> None:
        """Go on with the present action for a physics substep."""


@contextlib.contextmanager
def quick_settling(env: Any, controls: Callable[[Any], Acts]) -> Iterator[None]:
    """Let a scene come to rest with other controllers meanwhile, as RoboCasa does in its reset.

    Args:
        env: a RoboCasa environment.
        controls: makes the controllers of an environment in which an action has begun.
    """
    original = env._pre_action
    made: list[Acts] = []

    def pre_action(action: Any, policy_step: bool = False) -> None:
        if policy_step:
            # In a reset, what robosuite's controllers know at first is older than the state.
            original(action, policy_step)
            made[:] = [controls(env)]
        else:
            made[0].act()

    env._pre_action = pre_action
    try:
        yield
    finally:
        del env._pre_action
    for controller in env.robots[0].composite_controller.part_controllers.values():
        controller.new_update = True


def choose_objects(env: Any, groups: Mapping[str, Sequence[str]]) -> None:
    """Let the task draw some of its objects from other groups; all else stays the task's own."""
    original = env._get_obj_cfgs

    def get_obj_cfgs() -> Any:
        configs = original()
        for config in configs:
            if config.get("name") in groups:
                config["obj_groups"] = list(groups[config["name"]])
        return configs

    env._get_obj_cfgs = get_obj_cfgs


def keep_layout_fresh(env: Any) -> None:
    """Let every load of the model start from an unchanged layout.

    RoboCasa renames the fixtures in the very dictionary that it is given, so that a second load,
    after a failed placement, would give other names.
    """
    pairs = env.layout_and_style_ids
    if not any(isinstance(layout, dict) for layout, _ in pairs):
        return
    _let_read(next(layout for layout, _ in pairs if isinstance(layout, dict)))
    setup = env._setup_model

    def setup_model() -> None:
        env.layout_and_style_ids = copy.deepcopy(pairs)
        setup()

    env._setup_model = setup_model


def _let_read(layout: dict[str, Any]) -> None:
    """Let RoboCasa read a layout of ours where it asks for the file of one of its own.

    It does so to find the stools and the counters of an island.
    """
    from robocasa.models.scenes import scene_registry

    path = _written(yaml.safe_dump(layout))
    original = getattr(
        scene_registry.get_layout_path, "__wrapped__", scene_registry.get_layout_path
    )

    @functools.wraps(original)
    def get_layout_path(layout_id: Any) -> str:
        return path if isinstance(layout_id, dict) else str(original(layout_id))

    scene_registry.get_layout_path = get_layout_path


@functools.cache
def _written(text: str) -> str:
    """A file with this text, until the process ends."""
    folder = tempfile.TemporaryDirectory(prefix="safemanip-layout-")
    atexit.register(folder.cleanup)
    path = Path(folder.name) / "layout.yaml"
    path.write_text(text)
    return str(path)
