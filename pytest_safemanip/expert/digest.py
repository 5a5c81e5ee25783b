"""What a scripted rollout's actions come from: its plan, and the code that this stands on.

A change of one task's skill, or of one fault, does not count for the other rollouts.
"""

from __future__ import annotations

import ast
import functools
import hashlib
from collections.abc import Collection, Iterable
from pathlib import Path

from pytest_safemanip.expert.tasks.plans import Entry, calls_of
from pytest_safemanip.expert.tasks.skills import SKILLS

PACKAGE = __name__.rpartition(".")[0]
TOP = PACKAGE.partition(".")[0]
ROOT = Path(__file__).resolve().parents[1]
RUNNING = tuple(f"{PACKAGE}.{name}" for name in ("policy", "tasks.plans", "tasks.calls"))
"""These run any plan. They import all skills: what they import does not count."""
ALWAYS = (f"{PACKAGE}.robot.arm", f"{PACKAGE}.tasks.search")
"""With what they import, likewise part of any rollout."""


def plan_digest(entries: tuple[Entry, ...], root: Path = ROOT) -> str:
    """SHA-256 of what decides the expert's actions in a task.

    Args:
        entries: its plan of the task.
        root: the folder of the whole package, or of a copy of it.
    """
    skills = {call.skill: SKILLS[call.skill] for call in calls_of(entries)}
    names = [f"{name}: {do.__module__}.{do.__qualname__}" for name, do in skills.items()]
    plan = repr((entries, names))
    return code_digest(plan, {do.__module__ for do in skills.values()}, root)


def code_digest(plan: str, modules: Iterable[str], root: Path = ROOT) -> str:
    """SHA-256 of what decides the actions of a plan.

    Args:
        plan: what it says.
        modules: what its functions are in: here, or in a room of this package that stands on this
            one. With what they import of these rooms they count.
        root: the folder of the whole package, or of a copy of it.
    """
    rooms = {PACKAGE, *(".".join(name.split(".")[:2]) for name in modules)}
    digest = hashlib.sha256(plan.encode())
    closure = _closure(root, {*ALWAYS, *modules}, rooms)
    for path in sorted({*_files(root, RUNNING, rooms), *closure}):
        digest.update(f"{path.relative_to(root).as_posix()} {_content(path)[0]}\n".encode())
    return digest.hexdigest()


def _closure(root: Path, modules: Iterable[str], rooms: Collection[str]) -> set[Path]:
    """The files of some modules and of all that they import of some rooms."""
    todo, found = _files(root, modules, rooms), set[Path]()
    while todo:
        path = todo.pop()
        if path not in found:
            found.add(path)
            todo += _files(root, _content(path)[1], rooms)
    return found


def _files(root: Path, names: Iterable[str], rooms: Collection[str]) -> list[Path]:
    """The files of those names that are modules of some rooms."""
    parts = [name.split(".") for name in names]
    own = [part[1:] for part in parts if ".".join(part[:2]) in rooms]
    paths = [root.joinpath(*part).with_suffix(".py") for part in own]
    return [path for path in paths if path.is_file()]


def _content(path: Path) -> tuple[str, tuple[str, ...]]:
    """SHA-256 of a file, and the names of this package that it imports."""
    return _read(path, path.stat().st_mtime_ns)


@functools.cache
def _read(path: Path, changed: int) -> tuple[str, tuple[str, ...]]:
    content, names = path.read_bytes(), list[str]()
    for node in ast.walk(ast.parse(content)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(TOP):
            names += [f"{node.module}", *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Import):
            names += [alias.name for alias in node.names if alias.name.startswith(TOP)]
    return hashlib.sha256(content).hexdigest(), tuple(names)
