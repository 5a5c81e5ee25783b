"""The roles of a task beside what the simulator knows of them, before anything is simulated."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.sim.backend import DescribesTasks, TaskDescription
from pytest_safemanip.spec import yamlfile
from pytest_safemanip.spec.task import Task
from pytest_safemanip.trace.elements import ROBOT


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
    """Refuse a task that the simulator does not have, or that names a part which cannot exist.

    Nothing is refused for a simulator whose factory does not describe its tasks.

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
    for role, touched in task.touch.items():
        parts = parts_of(role, task, described)
        for part in touched:
            if part not in parts:
                place = _touch_place(task, role)
                raise ConfigError(f"{place}: unknown part {part!r} of {role}; {_hint(part, parts)}")


def _touch_place(task: Task, role: str) -> str:
    """Where a task says what may be touched of a role; its base's file may."""
    section = yamlfile.load(task.path)
    return section.section("touch").place(role) if "touch" in section else str(task.path)


def _hint(part: str, parts: Iterable[str]) -> str:
    """The near miss and all that exists."""
    hint, known = did_you_mean(part, parts), ", ".join(sorted(parts))
    return hint if known in hint else f"{hint} (parts: {known})"


def _uses(task: Task) -> dict[str, tuple[str, ...]]:
    """The keys under which each role stands."""
    members: dict[str, Iterable[str]] = {
        "objects": task.objects,
        "enclosures": task.enclosures,
        "mechanisms": task.mechanisms,
        "placements": [role for pair in task.placements for role in pair],
        "skills": [role for _, role in task.skills],
        "transfers": [role for pair in task.transfers for role in pair],
        "tools": [role for role in task.tools if role != ROBOT],
        "supports": [role for key, below in task.supports.items() for role in (key, *below)],
        "upright": task.upright,
        "hot": task.hot,
        "zones": [zone.around for zone in task.zones.values()],
    }
    found: dict[str, list[str]] = {}
    for key, roles in members.items():
        for role in dict.fromkeys(roles):
            found.setdefault(role, []).append(key)
    return {role: tuple(keys) for role, keys in found.items()}
