"""``safemanip task``."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from pytest_safemanip.cli.drawing import task_request
from pytest_safemanip.cli.folder import Folder, add_backend, read_folder
from pytest_safemanip.cli.tables import print_json, print_table, print_wrapped
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.run.cases import applicable, select_properties
from pytest_safemanip.run.invocation import relative_path
from pytest_safemanip.run.plan import check_properties
from pytest_safemanip.run.roles import check_task, task_roles
from pytest_safemanip.sim.backend import DescribesTasks, TaskDescription
from pytest_safemanip.sim.registry import find_simulator
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.spec.task import Task
from pytest_safemanip.trace import files
from pytest_safemanip.trace.scene import Scene

EXAMPLE = "safemanip task OpenDrawer --scene"


@dataclass(frozen=True)
class RoleRow:
    """A role of a task.

    Attributes:
        name: the role.
        what: object, or kinds of fixture; in a scene, the entity and its category.
        parts: of it.
        touch: those that fingers and palm may touch.
    """

    name: str
    what: str
    parts: tuple[str, ...]
    touch: tuple[str, ...]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("name", metavar="NAME", help="of the task")
    source = parser.add_mutually_exclusive_group()
    source.add_argument(
        "--recording", type=Path, metavar="FILE", help="show the entities of this recording's scene"
    )
    source.add_argument(
        "--scene", action="store_true", help="load the scene once, and show its entities"
    )
    parser.add_argument("--seed", type=_seed, default=0, metavar="N", help="of --scene; 0")
    parser.add_argument("--scenes", metavar="NAME", help="of --scene; as --safemanip-scenes")
    add_backend(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(options: argparse.Namespace) -> int:
    """Print the binding, from its file alone or with the entities of a scene."""
    folder = read_folder(options.backend)
    if options.backend is None:
        folder = folder.with_backend(folder.definitions.elsewhere.get(options.name))
    factory = find_simulator(folder.settings.backend, folder.extensions.backends).create
    if options.name not in folder.definitions.tasks and _knows(factory, options.name):
        return _unbound(options, folder)
    task = folder.task(options.name)
    check_task(task, factory, recorded=options.recording is not None)
    check_properties([task], folder.definitions.properties)
    scene = _scene(options, folder, task)
    binding = task.bind(scene, folder.definitions.attributes) if scene else None
    roles = list(_roles(folder, task, scene))
    properties = _properties(folder, task)
    instances = {p.id: _instances(p, task, binding) for p in properties}
    if options.json:
        print_json(_plain(task, roles, instances))
        return 0
    print_wrapped(
        f"{task.name}: suite {task.suite}, horizon {task.horizon}, sets {', '.join(task.sets)}; "
        f"{relative_path(task.path, Path.cwd())}",
        "  ",
    )
    print()
    rows = [(role.name, role.what, _parts(role)) for role in roles]
    print_table(("role", "what it is", "parts (* fingers and palm may touch it)"), rows)
    print()
    print_table(("binding", ""), _keys(task))
    print()
    judged = [(id_, str(len(rows)), "; ".join(rows)) for id_, rows in instances.items()]
    left = [(id_, "not judged", reason) for id_, reason in task.not_grounded.items()]
    print_table(("property", "instances", "of what"), [*judged, *left])
    return 0


def _knows(factory: object, name: str) -> bool:
    return isinstance(factory, DescribesTasks) and name in factory.task_names()


def _unbound(options: argparse.Namespace, folder: Folder) -> int:
    """Print what the simulator knows of a task that no file binds, and how to write the file.

    Raises:
        ConfigError: if a scene is asked for: what it has is bound by the file.
    """
    name, backend = options.name, folder.settings.backend
    missing = f"{name} is a task of {backend}, and no file binds it to properties"
    if options.scene or options.recording:
        raise ConfigError(f"{missing}; safemanip task {name} says how to write one")
    described = _described(folder, name)
    parts = tuple(sorted(described.object_parts))
    roles = [RoleRow(role, "object", parts, ()) for role in described.objects or ()]
    roles += [
        RoleRow(role, " or ".join(fixture.kinds), tuple(sorted(fixture.parts)), ())
        for role, fixture in described.fixtures.items()
    ]
    if options.json:
        print_json({"task": name, "path": None, "roles": [asdict(role) for role in roles]})
        return 0
    print_wrapped(
        f"{missing}. Write {name}.yaml in a folder that safemanip_task_paths names, with the "
        "keys task, sets, suite, horizon, properties and what they range over (objects, "
        "mechanisms, skills ...); the page on tasks has an example. "
        + ("" if described.objects is not None else "Which objects it has only an episode tells. ")
        + "Its roles:",
        "",
    )
    print()
    rows = [(role.name, role.what, ", ".join(role.parts)) for role in roles]
    print_table(("role", "what it is", "parts"), rows)
    return 0


def _scene(options: argparse.Namespace, folder: Folder, task: Task) -> Scene | None:
    if options.recording is not None:
        recording = files.load(options.recording)
        if recording.episode.task != task.name:
            raise ConfigError(f"{options.recording}: a recording of {recording.episode.task}")
        return recording.scene
    if not options.scene:
        return None
    settings = folder.settings
    simulator = find_simulator(settings.backend, folder.extensions.backends)
    scenes = options.scenes or settings.scenes or simulator.spec.scenes[0]
    backend = simulator.create(settings.simulator_options)
    try:
        return backend.reset(task_request(task, options.seed, scenes, simulator.spec)).scene
    finally:
        backend.close()


def _seed(text: str) -> int:
    """One seed; argparse reports what is none."""
    if not text.isdecimal() or int(text) >= 2**32:
        raise argparse.ArgumentTypeError(f"expected a seed from 0 up, found {text!r}")
    return int(text)


def _roles(folder: Folder, task: Task, scene: Scene | None) -> Iterator[RoleRow]:
    """All roles of the task; with a scene, those that it has."""
    described = _described(folder, task.simulated)
    roles = {role.name: role for role in task_roles(task, described)}
    for name in dict.fromkeys([*roles, *(scene.roles if scene else ())]):
        touch = task.touch.get(name, ())
        optional = ", may be missing" if name in task.optional else ""
        if scene is None:
            is_object, kinds = name in task.objects, roles[name].fixtures
            staged = "object, staged" if name in task.drawn else "known in an episode"
            what = "object" if is_object else " or ".join(kinds) or staged
            parts = roles[name].parts if is_object or kinds else ()
            yield RoleRow(name, f"{what}{optional}", parts, touch)
        elif name in scene.roles:
            entity = scene.entity[scene.roles[name]]
            parts = tuple(dict.fromkeys(scene.parts[i].name for i in scene.parts_of(entity.name)))
            yield RoleRow(name, f"{entity.name} ({entity.category})", parts, touch)
        else:
            yield RoleRow(name, "not in this scene", (), touch)


def _described(folder: Folder, name: str) -> TaskDescription:
    """What the simulator knows of the task without being started."""
    factory: object = find_simulator(folder.settings.backend, folder.extensions.backends).create
    if isinstance(factory, DescribesTasks) and name in factory.task_names():
        return factory.describe_task(name)
    return TaskDescription({}, frozenset({"body"}), frozenset())


def _parts(role: RoleRow) -> str:
    every = dict.fromkeys([*role.touch, *role.parts])
    return ", ".join(f"{part}*" if part in role.touch else part for part in every)


def _keys(task: Task) -> list[tuple[str, str]]:
    """The other keys of the binding, as in the task's file; those that are there."""
    values = {
        "stages": (task.base,) if task.base else (),
        "enclosures": task.enclosures,
        "exclusive_enclosures": task.exclusive_enclosures,
        "mechanisms": task.mechanisms,
        "placements": [f"{a} in {b}" for a, b in task.placements],
        "skills": [f"{skill} {role}" for skill, role in task.skills],
        "transfers": [f"{a} into {b}" for a, b in task.transfers],
        "tools": task.tools,
        "open_at": [f"{role} from {value:g} on" for role, value in task.open_at.items()],
        "upright": task.upright,
        "hot": task.hot,
        "zones": [f"{name} around {zone.around}" for name, zone in task.zones.items()],
        "liquids": [f"{liquid} in {role}" for liquid, role in task.liquids.items()],
    }
    rows = [(key, ", ".join(value)) for key, value in values.items() if value]
    supports = [f"{role} on {', '.join(below)}" for role, below in task.supports.items()]
    lines = {"supports": supports, "staging": _staged(task)}
    return rows + [(key, "\n".join(own)) for key, own in lines.items() if own]


def _staged(task: Task) -> list[str]:
    """What the task's file changes in the scene, a line for each role."""
    found = {role: [f"drawn from {', '.join(kinds)}"] for role, kinds in task.drawn.items()}
    for one in task.staging:
        said = found.setdefault(one["role"], [])
        match one["kind"]:
            case "open":
                said.append(f"{one['joint']} open {one['openness']:g}".strip())
            case "push":
                said.append("moves {:g} forward, {:g} left (m/s)".format(*one["velocity"]))
            case _:
                said.append(f"{one['relation']} {one['target']}")
                named = zip(("forward", "left", "up"), one["offset"], strict=True)
                said += [f"{name} {value:g} m" for name, value in named if value]
                named = zip(("pitch", "turn"), one["turn"], strict=False)
                said += [f"{name} {value:g} degrees" for name, value in named if value]
    return [f"{role}: {', '.join(said)}" for role, said in found.items()]


def _properties(folder: Folder, task: Task) -> list[Property]:
    found = folder.definitions
    ids = applicable(task, found.everywhere, select_properties(found.properties, ()))
    return [found.properties[id_] for id_ in ids]


def _instances(prop: Property, task: Task, binding: Binding | None) -> list[str]:
    """What each instance is about: roles, or entities where there is a scene."""
    if not prop.ranges:
        return ["the whole scene"]
    if binding is None and (prop.is_open or len(prop.ranges) > 1):
        return [prop.for_each]
    relation = prop.ranges[0].relation
    rows: Sequence[tuple[str, ...] | str]
    rows = prop.rows(binding) if binding else getattr(task, relation)
    between = " " if relation == "skills" else ", "
    return [row if isinstance(row, str) else between.join(row) for row in rows]


def _plain(
    task: Task, roles: Sequence[RoleRow], instances: Mapping[str, Sequence[str]]
) -> dict[str, object]:
    return {
        "task": task.name,
        "path": str(task.path),
        "sets": task.sets,
        "suite": task.suite,
        "horizon": task.horizon,
        "roles": [asdict(role) for role in roles],
        "binding": dict(_keys(task)),
        "properties": instances,
        "not_grounded": dict(task.not_grounded),
    }
