"""The roles of a task beside what the simulator knows of them, before anything is simulated."""

from __future__ import annotations

import fnmatch
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.sim.backend import DescribesTasks, DrawsObjects, TaskDescription
from pytest_safemanip.spec import yamlfile
from pytest_safemanip.spec.task import Task


@dataclass(frozen=True, slots=True)
class Role:
    """A role of a task, for a table.

    Attributes:
        name: the role.
        uses: keys of the task's file under which it stands, ``touch`` left out.
        fixtures: kinds of fixture that can play it; empty for an object, and if nobody knows.
        parts: the parts that it can have.
        touch: those of them that fingers and palm may touch.
    """

    name: str
    uses: tuple[str, ...]
    fixtures: tuple[str, ...]
    parts: tuple[str, ...]
    touch: tuple[str, ...]


def task_roles(task: Task, described: TaskDescription) -> tuple[Role, ...]:
    """All roles that the task's file or the simulator names, objects first.

    Args:
        task: the binding.
        described: what the simulator knows of the task.
    """
    uses = _uses(task)
    return tuple(
        Role(
            name=name,
            uses=uses.get(name, ()),
            fixtures=described.fixtures[name].kinds if name in described.fixtures else (),
            parts=tuple(sorted(parts_of(name, task, described))),
            touch=task.touch.get(name, ()),
        )
        for name in dict.fromkeys((*uses, *task.touch, *described.fixtures))
    )


def parts_of(role: str, task: Task, described: TaskDescription) -> frozenset[str]:
    """The parts that whatever plays a role can have."""
    if role in described.fixtures:
        return described.fixtures[role].parts
    return described.object_parts if role in task.objects else described.any_part


def check_task(task: Task, factory: object, *, recorded: bool = False) -> None:
    """Refuse a task that the simulator does not have, or that names a role, a part or a category
    which cannot exist.

    Nothing is refused for a simulator whose factory does not describe its tasks. Of recordings the
    roles are known when they are bound, but for those that are staged alone.

    Args:
        task: the binding.
        factory: makes the backend; one that describes its tasks is a :class:`DescribesTasks`.
        recorded: whether recordings are judged, which may be another simulator's.

    Raises:
        ConfigError: naming file and line, and the near miss.
    """
    if not isinstance(factory, DescribesTasks):
        return
    names = factory.task_names()
    name = task.simulated
    if not names or (recorded and name not in names):
        return
    if name not in names:
        place = yamlfile.load(task.path).place("base" if task.base else "task")
        hint = did_you_mean(name, names)
        raise ConfigError(f"{place}: the simulator has no task {name!r}; {hint}")
    described = factory.describe_task(name)
    if not recorded:
        _check_scene(task, factory, described)
    elif described.objects is not None:  # nothing binds what is only staged
        _check_roles(task, described, described.objects, ("staging", "liquids"))
    for role, touched in task.touch.items():
        parts = parts_of(role, task, described)
        for part in touched:
            if part not in parts:
                message = f"unknown part {part!r} of {role}; {_hint(part, parts)}"
                raise _refused(task, ("touch", role), message)


def _check_scene(task: Task, factory: object, described: TaskDescription) -> None:
    """The simulator can arrange what the task's file says of its scene, as far as it is known."""
    if not described.stages and (task.staging or task.liquids or task.object_groups):
        key = "staging" if task.staging else "liquids" if task.liquids else "compact"
        raise _refused(task, (key,), "the simulator stages nothing and draws nothing else")
    if described.objects is not None:
        _check_roles(task, described, described.objects)
    if isinstance(factory, DrawsObjects):
        _check_kinds(task, factory.object_kinds())


def _check_roles(
    task: Task, described: TaskDescription, objects: Iterable[str], under: Collection[str] = ()
) -> None:
    """Every role may be in the scene, as an object where an object is wanted; those under some keys
    of the file alone, if any are given.
    """
    for keys, role, wanted in _named(task):
        if under and keys[0] not in under:
            continue
        is_object = any(fnmatch.fnmatchcase(role, pattern) for pattern in objects)
        is_fixture = role in described.fixtures or role in described.other_fixtures
        if not is_object and not is_fixture:
            known = {*described.fixtures, *(name for name in objects if "*" not in name)}
            message = f"{task.simulated} has no role {role!r}; {did_you_mean(role, known)}"
            raise _refused(task, keys, message)
        if wanted == "object" and not is_object:
            warm = "; what heats has 'hot_source' in objects.yaml" if keys == ("hot",) else ""
            raise _refused(task, keys, f"{role!r} is a fixture, expected an object{warm}")
        if wanted == "fixture" and not is_fixture:
            raise _refused(task, keys, f"{role!r} is an object, expected a fixture")


def _named(task: Task) -> Iterator[tuple[tuple[str, ...], str, str]]:
    """The roles that a task's file names: the keys there, the role, and whether it has to be an
    ``object`` or a ``fixture``; empty for either.
    """
    for key in ("objects", "upright", "hot"):
        yield from (((key,), role, "object") for role in task.roles[key])
    for key in ("enclosures", "mechanisms", "skills", "transfers"):
        yield from (((key,), role, "") for role in task.roles[key] if role not in task.liquids)
    for key in ("touch", "open_at"):
        yield from (((key, role), role, "") for role in task.roles[key])
    for role, below in task.supports.items():
        yield ("supports", role), role, "object"
        yield from ((("supports", role), other, "") for other in below)
    for name, zone in task.zones.items():
        yield ("zones", name, "around"), zone.around, ""
    for role in task.object_groups:
        yield ("compact", "object_groups", role), role, "object"
    for liquid, role in task.liquids.items():
        yield ("liquids", liquid), role, "object"
    for role in task.drawn:
        yield ("staging", role), role, "object"
    for one in task.staging:
        opens = one["kind"] == "open"
        yield ("staging", one["role"]), one["role"], "fixture" if opens else "object"
        if one["kind"] == "put":
            wanted = "fixture" if one["relation"] == "in" else "object"
            yield ("staging", one["role"], one["relation"]), one["target"], wanted


def _check_kinds(task: Task, known: Collection[str]) -> None:
    """Every category and group that objects are drawn from exists."""
    drawn = {("staging", role, "drawn"): names for role, names in task.drawn.items()}
    drawn |= {("compact", "object_groups", role): n for role, n in task.object_groups.items()}
    for keys, names in drawn.items():
        for name in names:
            if known and name not in known:
                message = f"unknown category or group {name!r}; {did_you_mean(name, known)}"
                raise _refused(task, keys, message)


def _refused(task: Task, keys: Sequence[str], message: str) -> ConfigError:
    """An error about what a task's file has under some keys, one in the other; if the file of its
    base has that, without the line.
    """
    section = yamlfile.load(task.path)
    for key in keys[:-1]:
        if key not in section:
            break
        section = section.section(key)
    if keys[-1] in section:
        return section.error(keys[-1], message)
    return ConfigError(f"{task.path}: key {'.'.join(keys)!r} of its base: {message}")


def _hint(part: str, parts: Iterable[str]) -> str:
    """The near miss and all that exists."""
    hint, known = did_you_mean(part, parts), ", ".join(sorted(parts))
    return hint if known in hint else f"{hint} (parts: {known})"


def _uses(task: Task) -> dict[str, tuple[str, ...]]:
    """The keys under which each role stands."""
    found: dict[str, list[str]] = {}
    for key, roles in task.roles.items():
        for role in dict.fromkeys(roles if key != "touch" else ()):
            found.setdefault(role, []).append(key)
    return {role: tuple(keys) for role, keys in found.items()}
