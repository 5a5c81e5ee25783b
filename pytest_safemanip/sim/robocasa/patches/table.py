"""The table of patches of RoboCasa and robosuite: what, why, and how long it is needed.

A patch has a probe that reads the source of the installed package, which is not imported for it.
Where a probe says no, the patch can go; a test says so.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Patch:
    """A change in other people's code.

    Attributes:
        name: in the provenance of a recording.
        target: what is changed, as ``module:attribute``.
        why: what would go wrong, or what it saves.
        done: module of this folder that does it.
        needed: says whether the installed package still needs it.
        optional: whether it is left out where it is not needed.
    """

    name: str
    target: str
    why: str
    done: str
    needed: Callable[[], bool]
    optional: bool = False


def source(module: str) -> str:
    """Source text of a module of an installed package; empty if there is none.

    Args:
        module: full name; nothing is imported.
    """
    package, *below = module.split(".")
    spec = importlib.util.find_spec(package)
    for folder in (spec.submodule_search_locations or ()) if spec else ():
        base = Path(folder, *below)
        for file in (base.with_suffix(".py"), base / "__init__.py"):
            if file.is_file():
                return file.read_text(encoding="utf-8")
    return ""


def _has(module: str, text: str) -> Callable[[], bool]:
    return lambda: text in source(module)


def _lacks(module: str, text: str) -> Callable[[], bool]:
    return lambda: text not in source(module)


_UTILS, _SCENES = "robosuite.utils", "robocasa.models.scenes"
_FIXTURES = "robocasa.models.fixtures"

PATCHES = (
    Patch(
        "task_flags",
        "robosuite.models.tasks.task:Task.__init__",
        "RoboCasa gives the model two flags, which PyPI's robosuite does not take",
        "compat",
        _lacks("robosuite.models.tasks.task", "enable_multiccd"),
        optional=True,
    ),
    Patch(
        "deferred_load",
        "robosuite.environments.manipulation.manipulation_env:ManipulationEnv.__init__",
        "RoboCasa leaves loading the model to the first reset; PyPI's robosuite loads it at once",
        "compat",
        _lacks("robosuite.environments.base", "load_model_on_init"),
        optional=True,
    ),
    Patch(
        "legacy_base",
        "robosuite.controllers.parts.controller_factory:mobile_base_controller_factory",
        "PyPI's robosuite lacks the base controller that RoboCasa asks for; its own drives "
        "backward after a quarter turn",
        "compat",
        _lacks("robosuite.controllers.parts.controller_factory", "JOINT_VELOCITY_LEGACY"),
        optional=True,
    ),
    Patch(
        "settings",
        "robosuite.macros_private",
        "by default robosuite compiles its helpers (14 s, and bits depend on it) and turns on EGL",
        "importing",
        _has("robosuite.macros", "ENABLE_NUMBA = True"),
    ),
    Patch(
        "quiet_import",
        "os.environ, sys.stdout, sys.stderr, warnings",
        "robosuite sets MUJOCO_GL, and both print, log and warn while they are imported",
        "importing",
        _has("robosuite.macros", "ROBOSUITE_DEFAULT_LOGGER.warn"),
    ),
    Patch(
        "no_cv2",
        "sys.modules:cv2",
        "robosuite imports OpenCV, which needs libGL, for a viewer on the screen",
        "importing",
        _has("robosuite.renderers.viewer.opencv_renderer", "import cv2"),
    ),
    Patch(
        "no_viewer",
        "sys.modules:mujoco.viewer",
        "robosuite imports MuJoCo's viewer, which starts a process to look for windows",
        "importing",
        _has("robosuite.renderers.viewer.mjviewer_renderer", "from mujoco import viewer"),
    ),
    Patch(
        "assets_root",
        "robocasa.models:assets_root",
        "the assets are read from a folder of ours; RoboCasa's own releases have no setting for it",
        "importing",
        _has("robocasa.models", "assets_root ="),
    ),
    Patch(
        "known_vectors",
        ", ".join(
            (
                f"{_UTILS}.mjcf_utils:string_to_array",
                *(
                    f"{_UTILS}.transform_utils:{name}"
                    for name in ("euler2mat", "quat2mat", "mat2euler", "mat2quat")
                ),
            )
        ),
        "fixtures and controllers parse the same texts and turn the same angles at every step",
        "memo",
        _lacks(f"{_UTILS}.mjcf_utils", "cache"),
    ),
    Patch(
        "robot_alone",
        "robosuite.models.robots.robot_model:RobotModel.set_mujoco_model",
        "at every reset robosuite compiles a model of the robot alone, which nothing reads",
        "memo",
        _has("robosuite.models.robots.robot_model", "self.mujoco_model = self.get_model()"),
    ),
    Patch(
        "quick_placement",
        "robocasa.utils.object_utils:objs_intersect",
        "where it is narrow, thousands of placements are tried; numpy is slow with eight numbers",
        "memo",
        _has("robocasa.utils.object_utils", "np.min(other_obj_projs)"),
    ),
    Patch(
        "quick_settling",
        "robosuite.environments.robot_env:RobotEnv._pre_action",
        "a reset ends with ten control steps of robosuite's own loop: a third of its time",
        "environments",
        _has("robocasa.environments.kitchen.kitchen", "self._pre_action(action, policy_step)"),
    ),
    Patch(
        "known_contacts",
        "robosuite.environments.base:MujocoEnv.check_contact",
        "names of all geoms in contact are compared at every step; numbers are sooner",
        "environments",
        _has(f"{_UTILS}.sim_utils", "geom_id2name"),
    ),
    Patch(
        "known_joints",
        f"{_UTILS}.binding_utils:MjModel.get_joint_qpos_addr",
        "fixtures ask for the same addresses at every step",
        "environments",
        _lacks(f"{_UTILS}.binding_utils", "cache"),
    ),
    Patch(
        "known_racks",
        ", ".join(
            f"{_FIXTURES}.{name}"
            for name in (
                "dishwasher:Dishwasher.check_rack_contact",
                "oven:Oven.check_rack_contact",
                "toaster_oven:ToasterOven.check_rack_contact",
                "toaster:Toaster.check_slot_contact",
            )
        ),
        "what lies on a rack is looked for among all of the kitchen's geoms, several times a step",
        "environments",
        _has(f"{_FIXTURES}.dishwasher", "range(env.sim.model.ngeom)"),
    ),
    Patch(
        "known_fixtures",
        ", ".join(
            f"{_FIXTURES}.{name}"
            for name in (
                "sink:Sink.update_state",
                "sink:Sink.get_handle_state",
                "stove:Stove.update_state",
                "stove:Stove.get_knobs_state",
                "oven:Oven.update_state",
                "dishwasher:Dishwasher.update_state",
                "fridge:Fridge.update_state",
                "cabinets:Drawer.update_state",
                "fixture:Fixture.get_int_sites",
            )
        ),
        "states and interiors of fixtures are computed at every step, of those too that did not "
        "move",
        "environments",
        _has(f"{_FIXTURES}.cabinets", "reg_int"),
    ),
    Patch(
        "known_corners",
        "robocasa.models.objects.objects:MJCFObject.get_bbox_points",
        "checks ask for an object's corners several times in a step",
        "environments",
        _lacks("robocasa.models.objects.objects", "cache"),
    ),
    Patch(
        "known_yaml",
        "robocasa.*:yaml.safe_load",
        "RoboCasa parses the same files for every fixture: half of a reset of its own kitchens",
        "registry",
        _has(f"{_SCENES}.scene_utils", "yaml.safe_load"),
    ),
    Patch(
        "ordered_places",
        f"{_FIXTURES}.counter:Counter.get_reset_regions",
        "the places to either side of a fixture come in the order of their addresses in memory: "
        "with the same seed, things stand on another side in another process",
        "order",
        _has(f"{_FIXTURES}.counter", "list(set(valid_geoms))"),
    ),
    Patch(
        "stored_scene",
        "robocasa.utils.env_utils:_get_placement_initializer, "
        "robosuite.environments.base:MujocoEnv._initialize_sim",
        "RoboCasa's playback draws other places for fixtures than the stored model has: its checks "
        "ask where they are not; to find places takes seconds where it is narrow",
        "environments",
        _has("robocasa.environments.kitchen.kitchen", "EnvUtils._get_placement_initializer("),
    ),
    Patch(
        "fresh_layout",
        "robocasa.environments.kitchen.kitchen:Kitchen._setup_model",
        "RoboCasa renames fixtures in the layout that it is given: a second load, after a failed "
        "placement, would have other names",
        "environments",
        _has(f"{_SCENES}.kitchen_arena", "layout_config = layout_id"),
    ),
    Patch(
        "layout_file",
        f"{_SCENES}.scene_registry:get_layout_path",
        "to find stools and islands, RoboCasa opens the file of a layout, which ours do not have",
        "environments",
        _lacks(f"{_SCENES}.scene_registry", "isinstance(layout_id, dict)"),
    ),
    Patch(
        "object_groups",
        "robocasa.environments.kitchen.kitchen:Kitchen._get_obj_cfgs",
        "RoboCasa has no argument that says what a task's objects are drawn from",
        "environments",
        _lacks("robocasa.environments.kitchen.kitchen", "obj_groups=None,"),
    ),
    Patch(
        "added_objects",
        "robocasa.environments.kitchen.kitchen:Kitchen._create_objects",
        "RoboCasa has no argument for things that a task does not have",
        "environments",
        _lacks("robocasa.environments.kitchen.kitchen", "added_cfgs"),
    ),
)
"""All patches, in the order in which they are made."""

NEEDED = {patch.name: patch.needed for patch in PATCHES}


def active(supplied: Iterable[str]) -> tuple[str, ...]:
    """Names of the patches that are made.

    Args:
        supplied: those of the optional ones that are.
    """
    chosen = set(supplied)
    return tuple(p.name for p in PATCHES if not p.optional or p.name in chosen)


def document() -> list[str]:
    """The lines of a table in Markdown."""
    rows = [f"| `{p.name}` | `{p.target}` | {p.why} | `{p.done}.py` |" for p in PATCHES]
    return ["| patch | what is changed | why | where |", "|---|---|---|---|", *rows]
