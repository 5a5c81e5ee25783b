"""Patches of a single environment of RoboCasa, on the object itself."""

from __future__ import annotations

import contextlib
import copy
import functools
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import yaml
from numpy.typing import NDArray

from pytest_safemanip.errors import TaskError
from pytest_safemanip.sim.robocasa.patches.memo import ContactCheck, LastCorners, Unchanged


def quicken(env: Any) -> None:
    """Let fixtures and tasks have the same answers sooner: at every step, and some several times,
    they ask for joints' addresses, contacts of buttons and racks, fixtures' states and interiors
    and objects' corners.
    """
    from robocasa.models import fixtures

    joints = {
        fixtures.Sink: ("update_state", "get_handle_state"),
        fixtures.Stove: ("update_state", "get_knobs_state"),
        fixtures.Oven: ("update_state",),
        fixtures.Dishwasher: ("update_state",),
    }
    touched = {
        fixtures.Dishwasher: "check_rack_contact",
        fixtures.Oven: "check_rack_contact",
        fixtures.ToasterOven: "check_rack_contact",
        fixtures.Toaster: "check_slot_contact",
    }
    env.sim.model.get_joint_qpos_addr = functools.cache(env.sim.model.get_joint_qpos_addr)
    env.check_contact = ContactCheck(env.sim)
    for fixture in env.fixtures.values():
        for kind, methods in joints.items():
            if isinstance(fixture, kind):
                _remember(fixture, methods, _positions(env, fixture))
        for kind, method in touched.items():
            if isinstance(fixture, kind):
                _remember(fixture, (method,), _touching(env))
        if isinstance(fixture, (fixtures.Drawer, fixtures.Fridge)):
            _remember(fixture, ("update_state",), _interiors(env, fixture))
        if isinstance(fixture, fixtures.Fixture):
            _remember(fixture, ("get_int_sites",), _regions(fixture))
    for thing in env.objects.values():
        thing.get_bbox_points = LastCorners(thing.get_bbox_points)


def _remember(fixture: Any, methods: Sequence[str], seen: Callable[[], Any]) -> None:
    for name in methods:
        setattr(fixture, name, Unchanged(getattr(type(fixture), name).__get__(fixture), seen))


def _touching(env: Any) -> Callable[[], Any]:
    """Reads what touches what; fast stepping has another check than this one."""

    def read() -> Any:
        return env.check_contact.touching()

    return read


def _positions(env: Any, fixture: Any) -> Callable[[], bytes]:
    """Reads the positions of a fixture's joints."""
    model = env.sim.model
    own = [name for name in model.joint_names if name.startswith(fixture.naming_prefix)]
    return _rows(env.sim.data._data.qpos, [model.get_joint_qpos_addr(name) for name in own])


def _interiors(env: Any, fixture: Any) -> Callable[[], bytes]:
    """Reads the places of a fixture's regions, some of which go with its drawers."""
    model, prefix = env.sim.model, f"{fixture.naming_prefix}reg_"
    own = [name for name in model.geom_names if name.startswith(prefix)]
    return _rows(env.sim.data._data.geom_xpos, [model.geom_name2id(name) for name in own])


def _rows(live: NDArray[Any], index: Sequence[int]) -> Callable[[], bytes]:
    rows = np.array(index, np.intp)

    def read() -> bytes:
        return live[rows].tobytes()

    return read


def _regions(fixture: Any) -> Callable[[], tuple[Any, ...]]:
    """Reads where a fixture and the corners of its regions are."""
    place = fixture._obj.attrib

    def read() -> tuple[Any, ...]:
        regions = (fixture._regions.get(name) for name in fixture.get_reset_region_names())
        corners = (r[key].tobytes() for r in regions if r for key in ("p0", "px", "py", "pz"))
        return place.get("pos"), place.get("euler"), *corners

    return read


AWAY = 20.0
"""Where what is added is before it is put somewhere, m: outside any kitchen."""


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


_UPRIGHT = "model_upright.xml"
"""The file of a model that stands, which few categories have."""


def choose_objects(env: Any, groups: Mapping[str, Sequence[str]]) -> None:
    """Let the task draw some of its objects from other groups; all else stays the task's own.

    A reset raises TaskError if none of the groups has what the task asks of an object.
    """
    original, sample = env._get_obj_cfgs, env.sample_object

    def get_obj_cfgs() -> Any:
        configs = original()
        for config in configs:
            if config.get("name") in groups:
                config["obj_groups"] = list(groups[config["name"]])
        return configs

    def sample_object(drawn: Any, **asked: Any) -> Any:
        try:
            return sample(drawn, **asked)
        except (ValueError, FileNotFoundError) as error:  # nothing to choose from, or not upright
            missing = str(getattr(error, "filename", None) or _UPRIGHT)
            roles = [role for role, own in groups.items() if list(own) == drawn]
            if not roles or not missing.endswith(_UPRIGHT):
                raise
            wanted = ", ".join(name for name, value in asked.items() if value is True)
            raise TaskError(
                f"{roles[0]}: nothing in {', '.join(drawn)} is as the task asks"
                f"{f' ({wanted})' if wanted else ''}; draw it from others"
            ) from error

    env._get_obj_cfgs, env.sample_object = get_obj_cfgs, sample_object


def add_objects(env: Any, categories: Sequence[str]) -> None:
    """Let a scene have some things more, ``added_1`` and so on, far away until somebody puts them
    where they are wanted; all else is drawn as without them.

    To be called before the reset; :func:`list_added` after it.
    """
    original = env._create_objects

    def create_objects() -> None:
        from robocasa.utils import env_utils

        original()
        drawn = copy.deepcopy(env.rng.bit_generator.state)
        env.added_cfgs = []
        for number, category in enumerate(categories, start=1):
            config = {"name": f"added_{number}", "type": "object", "obj_groups": category}
            model, config["info"] = env_utils.create_obj(env, config)
            model.get_obj().set("pos", f"{AWAY + number} {AWAY} 1")
            env.objects[model.name] = model
            env.model.merge_objects([model])
            env.added_cfgs.append({**config, "placement": {}})
        env.rng.bit_generator.state = drawn

    env._create_objects = create_objects


def list_added(env: Any) -> None:
    """List what was added among the things of a scene that was just reset."""
    env.object_cfgs = [*env.object_cfgs, *env.added_cfgs]


@contextlib.contextmanager
def stored_scene(env: Any, model: Any, begins: Any) -> Iterator[None]:
    """Let a reset take a model as it was stored, with fixtures and objects where they are in it.

    RoboCasa's playback draws places of its own: fixtures, and checks that ask where they are, are
    then not where the model has them. To find free places takes seconds where it is narrow.

    Args:
        env: a RoboCasa environment before its reset.
        model: a ``mujoco.MjModel``.
        begins: its ``MjData`` when the episode begins, with the poses of bodies.
    """
    from robocasa.utils import env_utils
    from robosuite.utils.binding_utils import MjSim

    original = env_utils._get_placement_initializer

    def initializer(*args: Any, **named: Any) -> Any:
        found = original(*args, **named)
        things = [thing for own in found.samplers.values() for thing in own.mujoco_objects]
        places = {thing.name: (*_place(thing, model, begins), thing) for thing in things}
        found.sample = lambda placed_objects: places
        return found

    def initialize_sim() -> None:
        env.sim = MjSim(model)
        env.sim.forward()
        env.initialize_time(env.control_freq)

    env_utils._get_placement_initializer, env._initialize_sim = initializer, initialize_sim
    try:
        yield
    finally:
        env_utils._get_placement_initializer = original
        del env._initialize_sim


def _place(thing: Any, model: Any, begins: Any) -> tuple[Any, Any]:
    """Position and quaternion of a fixture in a model, or of an object when its episode begins."""
    from robocasa.models.fixtures import Fixture

    if isinstance(thing, Fixture):  # some, as lids, fall from there
        body = model.body(thing.root_body)
        return body.pos, body.quat
    body = begins.body(thing.root_body)
    return body.xpos, body.xquat


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
    """A file with this text, in memory: nothing is left of it, however the process ends."""
    file = os.memfd_create("layout.yaml")
    os.write(file, text.encode())
    return f"/proc/self/fd/{file}"
