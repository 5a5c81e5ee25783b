"""Imports between the rooms of the package point one way, and rooms stay small."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

import pytest_safemanip
from tests.docs.reference import room_imports

PACKAGE = Path(pytest_safemanip.__file__).parent
MAX_MODULES = 20
ROOMS: Mapping[str, str] = {
    "errors.py": "",
    "markup.py": "errors.py",
    "strategies.py": "",
    "provenance.py": "",
    "hookspecs.py": "",
    "resources.py": "errors.py",
    "decoding": "errors.py",
    "ltlf": "errors.py strategies.py",
    "trace": "decoding errors.py strategies.py",
    "propositions": "errors.py trace",
    "spec": "decoding errors.py ltlf propositions trace",
    "cost.py": "",
    "severity.py": "ltlf propositions spec trace",
    "judge.py": "cost.py errors.py ltlf markup.py propositions severity.py spec trace",
    "sentences": "errors.py ltlf propositions spec",
    "live": "errors.py ltlf propositions resources.py spec trace",
    "sim": "decoding errors.py provenance.py trace",
    "policies": "decoding errors.py provenance.py sim trace",
    "rollouts": "errors.py policies sim trace",
    "search": "errors.py policies rollouts sim spec",
    "metrics": "cost.py decoding errors.py markup.py search spec trace",
    "lerobot": "errors.py sim trace",
    "importers": "decoding errors.py lerobot provenance.py resources.py rollouts sim spec trace",
    "expert": "errors.py policies sim spec trace",
    "faults": "errors.py expert provenance.py sim trace",
    "fuzz": "errors.py ltlf propositions resources.py spec trace",
    "run": "errors.py fuzz judge.py live ltlf metrics policies propositions provenance.py "
    "resources.py rollouts search sim spec trace",
    "gym": "cost.py errors.py live ltlf propositions run sim spec",
    "report": "cost.py errors.py judge.py ltlf metrics propositions provenance.py resources.py "
    "run search severity.py sim spec trace",
    "video": "errors.py judge.py metrics provenance.py report run sim spec trace",
    "plots": "errors.py judge.py metrics report spec",
    "api.py": "errors.py judge.py live ltlf markup.py metrics plots propositions report run spec "
    "trace",
    "plugin": "errors.py fuzz hookspecs.py metrics policies provenance.py report rollouts run "
    "search sim spec trace video",
    "cli": "errors.py expert faults importers judge.py lerobot ltlf metrics plugin policies "
    "propositions provenance.py report resources.py rollouts run search sentences sim spec trace "
    "video",
}
"""What each room may import; a room imports those above it only."""


def test_every_arrow_is_in_the_table_and_the_table_has_no_other() -> None:
    found = {room: set(own) for room, (own, _) in room_imports().items()}
    assert found == {room: set(allowed.split()) for room, allowed in ROOMS.items()}


def test_rooms_import_those_above_them_only() -> None:
    order = list(ROOMS)
    upwards = [
        f"{room} -> {other}"
        for room, allowed in ROOMS.items()
        for other in allowed.split()
        if order.index(other) >= order.index(room)
    ]
    assert upwards == []


@pytest.mark.parametrize("room", ["run", "report", "metrics", "rollouts", "propositions"])
def test_pytest_stays_in_the_plugin_and_the_command(room: str) -> None:
    _, others = room_imports()[room]
    assert not {"pytest", "_pytest", "xdist"} & set(others)


def test_a_folder_has_no_more_modules_than_one_can_survey() -> None:
    root = PACKAGE.parent
    rooms = (PACKAGE, root / "tests", root / "benchmarks")
    folders = {path.parent for room in rooms for path in room.rglob("*.py")}
    crowded = {
        str(folder.relative_to(root)): count
        for folder in folders
        if (count := len(list(folder.glob("*.py")))) > MAX_MODULES
    }
    assert crowded == {}
