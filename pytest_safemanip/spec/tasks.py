"""Tasks as data: which entities play which part, and what may touch what.

One YAML file each. Entities are named by the task's own roles (RoboCasa's names for its objects
and fixtures), and resolved to the entities of an episode's scene.

    task: PickPlaceCounterToCabinet
    sets: [quick, atomic_seen]
    suite: atomic_fixture
    horizon: atomic
    objects: [obj]
    enclosures: [cab]
    placements: [obj in cab]
    skills: [pick obj, place obj]
    touch:
      obj: [body]
    supports:
      obj: [counter, cab]
    properties: [collision_contact, grasp_stability, release_stability]

Optional keys: ``objects``, ``enclosures``, ``mechanisms``, ``placements``, ``skills``,
``open_at`` (role to openness that counts as open), ``touch``, ``supports``, ``upright``,
``compact`` (``object_groups``: role to the categories or groups drawn in the compact scene).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pytest_safemanip.errors import ConfigError, TraceError, did_you_mean
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.onset import SKILLS
from pytest_safemanip.spec import yamlfile
from pytest_safemanip.spec.yamlfile import Section
from pytest_safemanip.trace.scene import Scene

_REQUIRED = ("task", "sets", "suite", "horizon", "properties")
_OPTIONAL = (
    "objects",
    "enclosures",
    "mechanisms",
    "placements",
    "skills",
    "open_at",
    "touch",
    "supports",
    "upright",
    "compact",
)
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_PLACEMENT = re.compile(r"(\w+) in (\w+)")


@dataclass(frozen=True, slots=True)
class Task:
    """A task with its safety binding, in terms of roles.

    Attributes:
        name: the task's name, also the backend's name for it.
        path: the file it was read from.
        sets: selections that it belongs to.
        suite: group of the benchmark.
        horizon: horizon class: ``atomic``, ``short``, ``medium``, ``long``.
        properties: ids of the properties that apply.
        objects: roles of manipulated objects.
        enclosures: roles of fixtures that the robot reaches into.
        mechanisms: roles of fixtures whose doors or drawers it moves.
        placements: (object role, enclosure role).
        skills: (skill, role).
        open_at: role to openness that counts as open.
        touch: role to the parts that fingers and palm may touch.
        supports: object role to the roles it may rest on and touch while held.
        upright: roles of objects that must not tip.
        object_groups: role to the object groups to draw from in the compact scene.
    """

    name: str
    path: Path
    sets: tuple[str, ...]
    suite: str
    horizon: str
    properties: tuple[str, ...]
    objects: tuple[str, ...] = ()
    enclosures: tuple[str, ...] = ()
    mechanisms: tuple[str, ...] = ()
    placements: tuple[tuple[str, str], ...] = ()
    skills: tuple[tuple[str, str], ...] = ()
    open_at: Mapping[str, float] = field(default_factory=dict)
    touch: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    supports: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    upright: tuple[str, ...] = ()
    object_groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def bind(self, scene: Scene, attributes: Mapping[str, frozenset[str]]) -> Binding:
        """The binding of one episode.

        Args:
            scene: gives the entities that play the roles.
            attributes: of each object category.

        Raises:
            TraceError: if a role or a category is unknown.
        """

        def entity(role: str) -> str:
            if role not in scene.roles:
                hint = did_you_mean(role, scene.roles)
                raise TraceError(f"{self.path}: the scene has no role {role!r}; {hint}")
            return scene.roles[role]

        return Binding(
            objects=tuple(map(entity, self.objects)),
            enclosures=tuple(map(entity, self.enclosures)),
            mechanisms=tuple(map(entity, self.mechanisms)),
            placements=tuple((entity(o), entity(f)) for o, f in self.placements),
            skills=tuple((skill, entity(x)) for skill, x in self.skills),
            open_at={entity(role): value for role, value in self.open_at.items()},
            touch=frozenset((entity(r), part) for r, parts in self.touch.items() for part in parts),
            supports={
                entity(role): frozenset(map(entity, below)) for role, below in self.supports.items()
            },
            upright=frozenset(map(entity, self.upright)),
            attributes={
                b.entity: _attributes(scene.entity[b.entity].category, attributes)
                for b in scene.bodies
            },
        )

    def instances(self, relation: str | None) -> int:
        """How many instances a property that ranges over a relation has in this task."""
        if relation is None:
            return 1
        members: Sequence[object] = getattr(self, relation, ())
        return len(members)


def load_tasks(folders: Sequence[Path]) -> dict[str, Task]:
    """Read all tasks of some folders, every ``*.yaml`` in them whose first key is ``task``.

    Raises:
        ConfigError: if a folder does not exist, a file is wrong, or two tasks have one name.
    """
    found: dict[str, Task] = {}
    for folder in folders:
        if not folder.is_dir():
            raise ConfigError(f"{folder}: no such folder of tasks")
        for path in sorted(folder.glob("*.yaml")):
            if path.name == OBJECTS_FILE:
                continue
            task = load_task(path)
            if task.name in found:
                raise ConfigError(f"task {task.name!r} is in {found[task.name].path} and {path}")
            found[task.name] = task
    return found


OBJECTS_FILE = "objects.yaml"


def load_task(path: Path) -> Task:
    """Read one task.

    Raises:
        ConfigError: something in the file is wrong; the message begins with file and line.
    """
    section = yamlfile.load(path)
    section.check_keys(_REQUIRED, _OPTIONAL)
    name = section.string("task")
    if not _NAME.fullmatch(name):
        raise section.error("task", f"expected letters, digits and '_', found {name!r}")
    objects = _strings(section, "objects")
    enclosures = _strings(section, "enclosures")
    compact = section.section("compact") if "compact" in section else None
    if compact:
        compact.check_keys(("object_groups",))
    return Task(
        name=name,
        path=path,
        sets=section.strings("sets"),
        suite=section.string("suite"),
        horizon=section.string("horizon"),
        properties=section.strings("properties"),
        objects=objects,
        enclosures=enclosures,
        mechanisms=_strings(section, "mechanisms"),
        placements=_placements(section, objects, enclosures),
        skills=_skills(section),
        open_at=_numbers(section, "open_at"),
        touch=_lists(section, "touch"),
        supports=_lists(section, "supports"),
        upright=_strings(section, "upright"),
        object_groups=_lists(compact, "object_groups") if compact else {},
    )


def _strings(section: Section, key: str) -> tuple[str, ...]:
    return section.strings(key) if key in section else ()


def _numbers(section: Section, key: str) -> Mapping[str, float]:
    if key not in section:
        return {}
    inner = section.section(key)
    return {role: inner.number(role, positive=True) for role in inner}


def _lists(section: Section, key: str) -> Mapping[str, tuple[str, ...]]:
    if key not in section:
        return {}
    inner = section.section(key)
    return {role: inner.strings(role) for role in inner}


def _placements(
    section: Section, objects: Sequence[str], enclosures: Sequence[str]
) -> tuple[tuple[str, str], ...]:
    found = []
    for text in _strings(section, "placements"):
        match = _PLACEMENT.fullmatch(text)
        if not match or match[1] not in objects or match[2] not in enclosures:
            raise section.error("placements", f"expected 'OBJECT in ENCLOSURE', found {text!r}")
        found.append((match[1], match[2]))
    return tuple(found)


def _skills(section: Section) -> tuple[tuple[str, str], ...]:
    found = []
    for text in _strings(section, "skills"):
        skill, _, role = text.partition(" ")
        if not role or skill not in SKILLS:
            hint = did_you_mean(skill, SKILLS)
            raise section.error("skills", f"expected 'SKILL ROLE', found {text!r}; {hint}")
        found.append((skill, role.strip()))
    return tuple(found)


def _attributes(category: str, known: Mapping[str, frozenset[str]]) -> frozenset[str]:
    if category not in known:
        raise TraceError(f"object category {category!r} has no row in {OBJECTS_FILE}")
    return known[category]
