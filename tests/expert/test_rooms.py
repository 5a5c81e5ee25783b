from __future__ import annotations

import ast
from pathlib import Path

import pytest

import pytest_safemanip
from pytest_safemanip.expert.digest import PACKAGE

ROOT = Path(pytest_safemanip.__file__).parent / "expert"
FAULTS = ROOT.parent / "faults"
ROOMS = ("truth", "robot", "world", "motions", "tasks")
"""Each imports those before it only; what else is in the folder imports any."""
OWN = "pytest_safemanip.faults"
CORE = (
    "errors",
    "provenance",
    "trace",
    "sim.clearance",
    "sim.rehearsal",
    "sim.staging",
    "spec.yamlfile",
    "policies.base",
)
"""What the expert knows of the rest, as any policy may."""
MODULES = sorted(path.relative_to(ROOT) for path in ROOT.rglob("*.py"))
OF_FAULTS = sorted(path.relative_to(FAULTS) for path in FAULTS.rglob("*.py"))


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


@pytest.mark.parametrize("module", OF_FAULTS, ids=str)
def test_faults_stand_on_the_expert_and_on_what_any_policy_may(module):
    known = [PACKAGE, OWN, *(f"pytest_safemanip.{name}" for name in CORE)]
    for name in imports(FAULTS / module):
        assert is_below(name, known) or not is_below(name, ["pytest_safemanip"])
        assert not is_below(name, ["robocasa", "robosuite", "mujoco"])


def test_nothing_else_imports_the_expert_or_its_faults_but_the_command_that_lists_them():
    lists = ROOT.parent / "cli" / "faults.py"
    own = (ROOT, FAULTS)
    others = [p for p in ROOT.parent.rglob("*.py") if not any(map(p.is_relative_to, own))]
    found = [path for path in others for name in imports(path) if is_below(name, [PACKAGE, OWN])]
    assert {*found} == {lists}


def test_a_folder_has_at_most_twenty_modules():
    for folder in {path.parent for path in (*ROOT.rglob("*.py"), *FAULTS.rglob("*.py"))}:
        assert len(list(folder.glob("*.py"))) <= 20
