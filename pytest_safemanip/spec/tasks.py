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

Optional keys: ``objects``, ``enclosures``, ``exclusive_enclosures`` (those of them that take one
item at a time), ``mechanisms``, ``placements``, ``skills``, ``transfers`` (``obj into
pan``), ``tools`` (what may carry contamination: ``robot`` for its hand, and objects), ``open_at``
(role to openness that counts as open), ``touch``, ``supports``, ``upright``, ``optional`` (objects
that an episode may lack, mechanisms that may be without doors), ``not_grounded`` (property to the
reason why it cannot be judged here),
``params`` (parameter of a proposition to its default here), ``zones`` (named region to ``around``,
the role that it is grown from, ``margin`` and ``above``, m), ``hot`` (objects that are hot when an
episode begins), ``liquids`` (role of a liquid to the object that it is in then),
``compact`` (``kitchen``: which compact kitchen, ``small`` or ``full``; ``object_groups``: role to
the categories or groups drawn in it), ``staging`` (what is changed in the scene,
`spec/staged.py`).

A file with ``base`` is that task in a scene that is staged otherwise: its keys stand for the
base's. ``all`` does not choose it; its name, its ``suite`` and its ``sets`` do.

A backend may derive its tasks from files of its simulator's. Of such a task a file has ``base:
derived`` and those keys alone that are to be different:

    task: libero_goal__put_the_bowl_on_the_plate
    base: derived
    upright: [akita_black_bowl_1]
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.propositions.binding import Zone
from pytest_safemanip.propositions.onset import SKILLS
from pytest_safemanip.spec import yamlfile
from pytest_safemanip.spec.folders import yaml_files
from pytest_safemanip.spec.staged import MOST_LIQUIDS, MOST_OFFSET, read_staging
from pytest_safemanip.spec.task import OBJECTS_FILE, Task
from pytest_safemanip.spec.yamlfile import Section
from pytest_safemanip.trace.elements import ROBOT

_REQUIRED = ("task", "sets", "suite", "horizon", "properties")
_OPTIONAL = (
    "objects",
    "enclosures",
    "exclusive_enclosures",
    "mechanisms",
    "placements",
    "skills",
    "transfers",
    "tools",
    "open_at",
    "touch",
    "supports",
    "upright",
    "optional",
    "not_grounded",
    "params",
    "zones",
    "hot",
    "liquids",
    "staging",
    "compact",
)
_OF_LIQUIDS = ("transfers", "skills")
"""Keys that may name liquids."""
KITCHENS = ("small", "full", "deep", "roomy")
"""The compact kitchens, the usual one first."""
DERIVED = "derived"
"""What ``base`` is in a file that changes a task which a backend derives."""
HORIZONS = ("atomic", "short", "medium", "long")
"""The classes of tasks by their length, the shortest first."""
TASK_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
"""Names are part of node ids and of file names."""


def load_tasks(folders: Sequence[Path]) -> dict[str, Task]:
    """Read all tasks of some folders, every ``*.yaml`` in them whose first key is ``task``.

    Raises:
        ConfigError: if a folder does not exist, a file is wrong, or two tasks have one name.
    """
    found: dict[str, Task] = {}
    for folder in folders:
        if not folder.is_dir():
            raise ConfigError(f"{folder}: no such folder of tasks")
        for path in yaml_files(folder):
            if path.name == OBJECTS_FILE:
                continue
            section = yamlfile.load(path)
            if "base" in section:
                continue
            if "staging" in section:
                raise section.error(
                    "staging",
                    "there is no 'base'; name the task whose scene is staged, and give this one a "
                    "name of its own",
                )
            task = _task(section)
            if task.name in found:
                raise ConfigError(f"task {task.name!r} is in {found[task.name].path} and {path}")
            found[task.name] = task
    return found


def load_changes(folders: Sequence[Path]) -> dict[str, Section]:
    """What the files of some folders change in tasks that a backend derives, by task.

    Raises:
        ConfigError: if a file is wrong, or two change one task.
    """
    found: dict[str, Section] = {}
    for folder in folders:
        for path in yaml_files(folder):
            section = yamlfile.load(path)
            if "base" not in section:
                continue
            if section.string("base") != DERIVED:
                continue
            name = section.string("task")
            if name in found:
                raise ConfigError(f"task {name!r} is changed in {found[name].path} and {path}")
            found[name] = section
    return found


def load_staged(
    folders: Sequence[Path], bases: Mapping[str, Task], of_packs: Sequence[Path] = ()
) -> dict[str, Task]:
    """Read the tasks of some folders that stage the scene of another.

    Args:
        folders: where their files are.
        bases: the tasks whose scenes may be staged.
        of_packs: those of the folders in which there are no other tasks.

    Raises:
        ConfigError: if a file is wrong, its base is unknown, or a name is taken.
    """
    found: dict[str, Task] = {}
    sections = []
    for folder in folders:
        for section in map(yamlfile.load, yaml_files(folder)):
            if "base" in section and section.string("base") != DERIVED:
                sections.append(section)
            elif folder in of_packs:
                raise ConfigError(
                    f"{section.path}:{section.line}: a task of a pack stages the scene of another; "
                    "name that one with 'base'"
                )
    staged = {section.string("task"): section.string("base") for section in sections}
    for section in sections:
        path, base = section.path, section.string("base")
        if base in staged and base not in bases:
            other = f"; name {staged[base]!r}, whose scene that is" if staged[base] in bases else ""
            raise section.error("base", f"{base!r} has a 'base' itself{other}")
        if base not in bases:
            hint = did_you_mean(base, bases, "safemanip tasks")
            raise section.error("base", f"unknown task {base!r}; {hint}")
        section.check_keys(("task", "base", "sets", "suite"), (*_REQUIRED, *_OPTIONAL))
        task = replace(_task(section.over(yamlfile.load(bases[base].path))), base=base)
        if task.name in {*bases, *found}:
            taken = {**bases, **found}[task.name].path
            raise ConfigError(f"task {task.name!r} is in {taken} and {path}")
        found[task.name] = task
    return found


def derived_task(binding: str, path: Path, changes: Section | None = None) -> Task:
    """A task that a backend has derived.

    Args:
        binding: what it derived, as the content of a task's file.
        path: of what it was derived from.
        changes: keys that are to be different.

    Raises:
        ConfigError: if it is no task.
    """
    section = yamlfile.parse(binding.encode(), path)
    return replace(_task(changes.over(section) if changes else section), derived=binding)


def load_task(path: Path) -> Task:
    """Read one task.

    Raises:
        ConfigError: something in the file is wrong; the message begins with file and line.
    """
    return _task(yamlfile.load(path))


def _task(section: Section) -> Task:
    section.check_keys(_REQUIRED, (*_OPTIONAL, "base"))
    name = section.string("task")
    if not TASK_NAME.fullmatch(name):
        raise section.error("task", f"expected letters, digits and '_', found {name!r}")
    objects = _strings(section, "objects")
    enclosures = _strings(section, "enclosures")
    mechanisms = _strings(section, "mechanisms")
    staging, drawn = read_staging(section)
    liquids = _liquids(section, objects, drawn)
    contents = (*objects, *liquids)
    compact = section.section("compact") if "compact" in section else None
    if compact:
        compact.check_keys((), ("kitchen", "object_groups"))
    task = Task(
        name=name,
        path=section.path,
        sets=section.strings("sets"),
        suite=section.string("suite"),
        horizon=_horizon(section),
        properties=section.strings("properties"),
        objects=objects,
        enclosures=enclosures,
        exclusive_enclosures=_members(section, "exclusive_enclosures", enclosures, "enclosures"),
        mechanisms=mechanisms,
        placements=_pairs(section, "placements", "OBJECT in ENCLOSURE", objects, enclosures),
        skills=_skills(section),
        transfers=_pairs(section, "transfers", "OBJECT into RECEIVER", contents, None),
        tools=_members(section, "tools", (ROBOT, *objects), "objects, nor 'robot'"),
        open_at=_numbers(section, "open_at", most=1.0),
        touch=_lists(section, "touch"),
        supports=_lists(section, "supports"),
        upright=_strings(section, "upright"),
        optional=_members(
            section, "optional", (*objects, *mechanisms), "objects, nor the mechanisms"
        ),
        not_grounded=_reasons(section),
        params=_numbers(section, "params"),
        zones=_zones(section),
        hot=_strings(section, "hot"),
        liquids=liquids,
        staging=staging,
        drawn=drawn,
        kitchen=_kitchen(compact),
        object_groups=_lists(compact, "object_groups"),
    )
    _check_names(section, task)
    return task


def _check_names(section: Section, task: Task) -> None:
    """Zones and liquids have names that nothing else has."""
    taken = {ROBOT, *(receiver for _, receiver in task.transfers)}
    taken.update(*(roles for key, roles in task.roles.items() if key not in _OF_LIQUIDS))
    for key, others in (("liquids", task.zones), ("zones", task.liquids)):
        for name in section.section(key) if key in section else ():
            if name in taken or name in others:
                raise section.section(key).error(name, f"{name!r} is the name of something else")


def _horizon(section: Section) -> str:
    name = section.string("horizon")
    if name not in HORIZONS:
        raise section.error("horizon", f"unknown horizon {name!r}; {did_you_mean(name, HORIZONS)}")
    return name


def _reasons(section: Section) -> Mapping[str, str]:
    if "not_grounded" not in section:
        return {}
    inner = section.section("not_grounded")
    for name in inner:
        if name in section.strings("properties"):
            raise inner.error(name, "is among the properties too")
    return {name: inner.string(name) for name in inner}


def _kitchen(compact: Section | None) -> str:
    if compact is None or "kitchen" not in compact:
        return KITCHENS[0]
    name = compact.string("kitchen")
    if name not in KITCHENS:
        hint = did_you_mean(name, KITCHENS)
        raise compact.error("kitchen", f"unknown kitchen {name!r}; {hint}")
    return name


def _strings(section: Section, key: str) -> tuple[str, ...]:
    return section.strings(key) if key in section else ()


def _members(section: Section, key: str, known: Sequence[str], where: str) -> tuple[str, ...]:
    roles = _strings(section, key)
    for role in roles:
        if role not in known:
            raise section.error(key, f"{role!r} is not among the {where}")
    return roles


def _numbers(section: Section, key: str, most: float = math.inf) -> Mapping[str, float]:
    if key not in section:
        return {}
    inner = section.section(key)
    return {name: inner.number(name, positive=True, most=most) for name in inner}


def _liquids(section: Section, objects: Sequence[str], drawn: Collection[str]) -> Mapping[str, str]:
    """Liquids, each in an object, the task's or one that its staging draws; what is simulated of it
    is small balls.
    """
    if "liquids" not in section:
        return {}
    inner = section.section("liquids")
    if len(list(inner)) > MOST_LIQUIDS:
        raise section.error(
            "liquids", f"{len(list(inner))} liquids, of which {MOST_LIQUIDS} may be"
        )
    found = {}
    for name in inner:
        if not TASK_NAME.fullmatch(name):
            expected = "expected letters, digits and '_' in the name of a liquid"
            raise inner.error(name, f"{expected}, found {name!r}")
        found[name] = inner.string(name)
        if name in objects or name in drawn:
            raise inner.error(name, f"expected 'LIQUID: OBJECT', found {name}: {found[name]}")
        if found[name] not in objects and found[name] not in drawn:
            raise inner.error(
                name,
                f"{found[name]!r} is none of the task's objects; put it into 'objects', or draw it "
                f"under 'staging' ({found[name]}: {{drawn: [cup]}}), and it stays an obstacle",
            )
        if list(found.values()).count(found[name]) > 1:
            raise inner.error(name, f"{found[name]!r} is full of another liquid already")
    return found


def _zones(section: Section) -> Mapping[str, Zone]:
    if "zones" not in section:
        return {}
    every, found = section.section("zones"), {}
    for name in every:
        if not TASK_NAME.fullmatch(name):
            raise every.error(name, "expected letters, digits and '_' in the name of a zone")
        zone = every.section(name)
        zone.check_keys(("around",), ("margin", "above"))
        sizes = {
            key: zone.number(key, least=0.0, most=MOST_OFFSET)
            for key in ("margin", "above")
            if key in zone
        }
        found[name] = Zone(zone.string("around"), **sizes)
    return found


def _lists(section: Section | None, key: str) -> Mapping[str, tuple[str, ...]]:
    if section is None or key not in section:
        return {}
    inner = section.section(key)
    return {role: inner.strings(role) for role in inner}


def _pairs(
    section: Section, key: str, form: str, firsts: Sequence[str], seconds: Sequence[str] | None
) -> tuple[tuple[str, str], ...]:
    """Pairs of roles, written as the form says: ``OBJECT in ENCLOSURE``. None admits any second."""
    pattern = re.compile(rf"(\w+) {form.split()[1]} (\w+)")
    found = []
    for text in _strings(section, key):
        match = pattern.fullmatch(text)
        if not match or match[1] == match[2]:
            raise section.error(key, f"expected '{form}', found {text!r}")
        if match[1] not in firsts:
            raise section.error(key, f"{text!r}: {match[1]!r} is none of the task's objects")
        if seconds is not None and match[2] not in seconds:
            hint = did_you_mean(match[2], seconds)
            raise section.error(key, f"{text!r}: {match[2]!r} is not under 'enclosures'; {hint}")
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
