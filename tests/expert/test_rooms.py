from __future__ import annotations

import ast
from pathlib import Path

import pytest

import pytest_safemanip
from pytest_safemanip.expert.digest import PACKAGE, ROOT

ROOMS = ("truth", "robot", "world", "motions", "tasks", "faults")
"""Each imports those before it only; what else is in the folder imports any."""
CORE = (
    "errors",
    "provenance",
    "trace",
    "sim.clearance",
    "sim.rehearsal",
    "sim.staging",
    "policies.base",
)
"""What the expert knows of the rest, as any policy may."""
MODULES = sorted(path.relative_to(ROOT) for path in ROOT.rglob("*.py"))


def imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            yield node.module or ""
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def is_below(name, packages):
    return any(f"{name}.".startswith(f"{package}.") for package in packages)


@pytest.mark.parametrize("module", MODULES, ids=str)
def test_a_room_imports_the_rooms_before_it_and_what_any_policy_may(module):
    room = module.parts[0].removesuffix(".py")
    rooms = ROOMS[: ROOMS.index(room) + 1] if room in ROOMS else ("",)
    below = [f"{PACKAGE}.{name}".rstrip(".") for name in rooms]
    core = [f"pytest_safemanip.{name}" for name in CORE]
    for name in imports(ROOT / module):
        assert is_below(name, [*below, *core]) or not is_below(name, ["pytest_safemanip"])
        assert not is_below(name, ["robocasa", "robosuite", "mujoco"])


def test_nothing_else_imports_the_expert_but_the_command_that_lists_its_faults():
    package = Path(pytest_safemanip.__file__).parent
    lists = package / "cli" / "faults.py"
    others = {path for path in package.rglob("*.py") if not path.is_relative_to(ROOT)} - {lists}
    assert [path for path in others for name in imports(path) if is_below(name, [PACKAGE])] == []


def test_a_folder_has_at_most_twenty_modules():
    for folder in {path.parent for path in MODULES}:
        assert len(list((ROOT / folder).glob("*.py"))) <= 20
