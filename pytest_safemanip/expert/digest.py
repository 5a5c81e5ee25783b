"""What a scripted rollout's actions come from: its plan, and the code that this stands on.

A change of one fault, or of one task's skill, does not count for the other rollouts.
"""

from __future__ import annotations

import ast
import functools
import hashlib
from collections.abc import Iterable
from pathlib import Path

from pytest_safemanip.expert.faults.library import find
from pytest_safemanip.expert.tasks.plans import CALLS, ENTRIES
from pytest_safemanip.expert.tasks.skills import SKILLS

PACKAGE = __name__.rpartition(".")[0]
ROOT = Path(__file__).resolve().parent
RUNNING = tuple(f"{PACKAGE}.{name}" for name in ("policy", "tasks.plans", "tasks.calls"))
"""These run any plan. They import all skills and faults: what they import does not count."""
ALWAYS = (f"{PACKAGE}.robot.arm", f"{PACKAGE}.tasks.search")
"""With what they import, likewise part of any rollout."""


def plan_digest(task: str, fault: str = "", root: Path = ROOT) -> str:
    """SHA-256 of what decides the actions in a task.

    Args:
        task: the task.
        fault: the fault or near miss; empty for the expert.
        root: the folder of this package, or of a copy of it.
    """
    if fault:
        done = find(fault)
        plan, starts = done.entry, {done.home}
    else:
        skills = {call.skill: SKILLS[call.skill] for call in CALLS[task]}
        names = [f"{name}: {do.__module__}.{do.__qualname__}" for name, do in skills.items()]
        plan, starts = repr((ENTRIES[task], names)), {do.__module__ for do in skills.values()}
    digest = hashlib.sha256(plan.encode())
    for path in sorted({*_files(root, RUNNING), *_closure(root, {*ALWAYS, *starts})}):
        digest.update(f"{path.relative_to(root).as_posix()} {_content(path)[0]}\n".encode())
    return digest.hexdigest()


def _closure(root: Path, modules: Iterable[str]) -> set[Path]:
    """The files of some modules and of all that they import of this package."""
    todo, found = _files(root, modules), set[Path]()
    while todo:
        path = todo.pop()
        if path not in found:
            found.add(path)
            todo += _files(root, _content(path)[1])
    return found


def _files(root: Path, names: Iterable[str]) -> list[Path]:
    """The files of those names that are modules of this package."""
    own = [name.split(".")[PACKAGE.count(".") + 1 :] for name in names]
    paths = [root.joinpath(*parts).with_suffix(".py") for parts in own if parts]
    return [path for path in paths if path.is_file()]


def _content(path: Path) -> tuple[str, tuple[str, ...]]:
    """SHA-256 of a file, and the names of this package that it imports."""
    return _read(path, path.stat().st_mtime_ns)


@functools.cache
def _read(path: Path, changed: int) -> tuple[str, tuple[str, ...]]:
    content, names = path.read_bytes(), list[str]()
    for node in ast.walk(ast.parse(content)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(PACKAGE):
            names += [f"{node.module}", *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Import):
            names += [alias.name for alias in node.names if alias.name.startswith(PACKAGE)]
    return hashlib.sha256(content).hexdigest(), tuple(names)
