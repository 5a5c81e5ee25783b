"""The tables of what there is, the user's folder included."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from pytest_safemanip.cli.tables import table_lines
from pytest_safemanip.faults.library import FAULTS
from pytest_safemanip.policies.registry import BUILT_IN
from pytest_safemanip.policies.remote.presets import PRESETS
from pytest_safemanip.propositions.catalogue import SHIPPED
from tests.cli.conftest import Command
from tests.plugin.toyfolder import CONFTEST, PROPERTY, TASK

INI = "[pytest]\nsafemanip_task_paths = mine\nsafemanip_property_paths = rules\n"
ROWS = [("short", "a", "one two three"), ("a_longer_name", "bb", "four\nfive")]


def names(text: str) -> list[str]:
    """The first words of the rows."""
    table = text.split("\n\n")[0].splitlines()[1:]
    return [line.split()[0] for line in table if not line.startswith(" ")]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a task and a property of its own."""
    (tmp_path / "pytest.ini").write_text(INI)
    for name, text in {"mine/reach.yaml": TASK, "rules/near.yaml": PROPERTY}.items():
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text(text.replace("straying", "obj_grasped"))
    return tmp_path


def test_the_last_column_is_wrapped_where_there_is_room_for_it() -> None:
    assert table_lines(("name", "x", "about"), ROWS, 80) == [
        "name           x   about",
        "short          a   one two three",
        "a_longer_name  bb  four",
        "                   five",
    ]
    wide = [("name", "word " * 12)]
    assert table_lines(("n", "about"), wide, 40)[1:] == [
        "name  word word word word word word word",
        "      word word word word word",
    ]


def test_in_a_narrow_terminal_every_row_is_a_paragraph_with_its_whole_name() -> None:
    assert table_lines(("name", "x", "about"), ROWS, 20) == [
        "short",
        "    a",
        "    one two three",
        "a_longer_name",
        "    bb",
        "    four",
        "    five",
    ]


def test_in_a_paragraph_a_number_says_what_it_counts() -> None:
    headings, row = ("property", "verdict", "triggered", "what"), ("a_long_name", "VIOLATED")
    assert table_lines(headings, [(*row, "9 of 9", "the cup fell")], 30) == [
        "a_long_name",
        "    VIOLATED, triggered 9 of 9",
        "    the cup fell",
    ]


@pytest.mark.parametrize("columns", [40, 80, 200])
@pytest.mark.parametrize("name", ["tasks", "properties", "propositions", "faults"])
def test_a_table_fits_the_terminal(safemanip: Command, monkeypatch, name, columns) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    found = safemanip(name)
    assert found.status == 0
    assert max(map(len, found.out.splitlines())) <= columns


def test_tasks_are_selected_as_in_pytest(safemanip: Command) -> None:
    assert len(names(safemanip("tasks").out)) == 50
    found = safemanip("tasks", "OpenD*", "set:quick").out
    assert "OpenDrawer " in found
    assert "PickPlaceCounterToCabinet " in found
    assert "5 of 50 tasks, 0 of 11 staged scenes, which 'all'" in " ".join(found.split())
    assert safemanip("tasks", "OpenD*,set:quick").out == found
    staged = " ".join(safemanip("tasks", "set:redvla,OpenDrawer").out.split())
    assert (
        "1 of 50 tasks, 4 of 11 staged scenes, which 'all' leaves out: set:failurebench," in staged
    )
    assert "16 of 16 tasks; safe" in safemanip("tasks", "--backend", "robosuite").out
    line = safemanip("tasks", "OpenDrawr").refusal
    assert line == (
        "safemanip tasks: error: SELECTOR: 'OpenDrawr' matches no task; did you mean 'OpenDrawer'?"
    )


def test_properties_have_formula_category_and_the_number_of_their_tasks(safemanip) -> None:
    found = safemanip("properties", "category:enclosure_access").out
    assert names(found) == ["enclosure_access", "enclosure_clearance", "enclosure_release"]
    assert "G (reach_in -> fix_open)" in found
    assert "category enclosure_access; for each f in enclosures" in found
    assert "3 of 119 properties, for 50 tasks" in found
    assert [line.split()[1] for line in found.splitlines() if line.startswith("encl")] == [
        "24",
        "2",
        "10",
    ]
    assert "'enclosure_acess' matches no property" in safemanip("properties", "enclosure_acess").err


def test_packs_are_listed_and_the_rules_of_one(safemanip: Command) -> None:
    found = names(safemanip("properties", "--packs").out)
    assert found[0].startswith("pack:")
    assert "pack:safebox" in found
    rules = names(safemanip("properties", "pack:safebox").out)
    assert "safebox_fragile_not_dropped" in rules
    listed = {
        row["pack"]: row for row in json.loads(safemanip("properties", "--packs", "--json").out)
    }
    assert listed["safebox"]["rules"] == rules
    assert len(names(safemanip("properties").out)) == 10
    assert names(safemanip("properties", "collision_contact,pack:safebox").out) == [
        "collision_contact",
        *rules,
    ]
    assert len(names(safemanip("properties", "default,pack:safebox").out)) == 10 + len(rules)
    line = safemanip("properties", "pack:safeboks").refusal
    assert "unknown pack 'safeboks'; did you mean 'safebox'?" in line


def test_propositions_are_those_of_the_catalogue(safemanip: Command) -> None:
    found = names(safemanip("propositions").out)
    assert [name.partition("(")[0] for name in found] == [p.name for p in SHIPPED]
    assert (
        "| `settled.speed` | 0.02 m/s |" in safemanip("propositions", "settled", "--markdown").out
    )
    assert "did you mean 'settled'" in safemanip("propositions", "setled").refusal


def test_policies_are_those_that_a_run_takes(safemanip: Command) -> None:
    found = names(safemanip("policies").out)
    assert {name.partition(":")[0] for name in found} == {*BUILT_IN, *PRESETS}


def test_one_proposition_is_counted_as_one(safemanip: Command) -> None:
    assert "\n1 proposition; --markdown" in safemanip("propositions", "settled").out


def test_faults_can_be_listed_by_task_and_property(safemanip: Command) -> None:
    assert all(f"scripted:{name} " in safemanip("faults").out for name in FAULTS)
    found = safemanip("faults", "--task", "OpenDrawer", "--property", "mechanism_recovery").out
    assert "scripted:jam_and_hold " in found
    assert "half_inside" not in found
    assert "scripted:drop@0.003 " not in found
    assert "scripted:drop@0.003 " in safemanip("faults", "--property", "action_onset").out
    assert "did you mean 'OpenDrawer'" in safemanip("faults", "--task", "OpenDrawr").refusal
    staged = safemanip("faults", "--task", "KnifeByTarget").out
    assert staged == safemanip("faults", "--task", "PickPlaceCounterToCabinet").out
    indirectly = safemanip("faults", "--property", "redvla_sharp_not_touched").refusal
    assert "no fault is aimed at 'redvla_sharp_not_touched'" in indirectly


@pytest.mark.parametrize("name", ["tasks", "properties", "propositions", "policies", "faults"])
def test_json_has_the_same_rows(safemanip: Command, name) -> None:
    rows = json.loads(safemanip(name, "--json").out)
    words = set(safemanip(name).out.replace("(", " ").replace(":", " ").split())
    first = {"faults": "name"}.get(name, next(iter(rows[0])))
    assert all(row[first].partition(":")[0] in words for row in rows)


def test_a_folders_own_tasks_and_properties_are_listed(safemanip: Command, folder: Path) -> None:
    assert "Reach " in safemanip("tasks").out
    assert "mine/reach.yaml" in safemanip("tasks", "Reach").out
    found = safemanip("properties", "stays_near").out
    assert "G !obj_grasped" in found
    assert "rules/near.yaml" in found


def test_what_is_wrong_in_a_folder_is_one_line(safemanip: Command, folder: Path) -> None:
    (folder / "mine" / "reach.yaml").write_text("task: Reach\nset: [a]\n")
    line = safemanip("tasks").refusal
    assert line.endswith("reach.yaml:2: unknown key 'set'; did you mean 'sets'?")
    (folder / "pytest.ini").write_text("[pytest]\naddopts = --no-such\n")
    assert "unrecognized arguments: --no-such" in safemanip("tasks").refusal


def test_a_staged_task_shows_what_is_staged(safemanip: Command) -> None:
    full = safemanip("task", "FullCup").out
    assert "liquids     water in obj" in full
    assert "staging     obj: drawn from cup" in full
    ball = " ".join(safemanip("task", "RollingBall").out.split())
    assert "distr_counter: drawn from orange, in cab, forward -0.05 m, left 0.45 m, up" in ball
    assert "moves 0 forward, -1.5 left (m/s)" in ball
    assert "distr_counter object, staged" in ball


@pytest.mark.parametrize(
    ("conftest", "said"),
    [
        ("import no_such_module\n", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("def pytest_safemanip_policies():\n    return nobody\n", "NameError: name 'nobody'"),
        ("raise SystemExit(3)\n", "a conftest.py ends the process, with 3"),
    ],
    ids=["import", "hook", "exit"],
)
def test_a_conftest_that_fails_is_one_line(tmp_path: Path, conftest: str, said: str) -> None:
    (tmp_path / "conftest.py").write_text(conftest)
    found = in_a_process(tmp_path, "policies")
    assert found.returncode == 4
    assert said in found.stderr
    assert "conftest.py" in found.stderr
    assert found.stderr.count("\n") == 1


def test_the_hooks_of_a_conftest_count(tmp_path: Path) -> None:
    (tmp_path / "conftest.py").write_text(f"print('loud')\n{CONFTEST}")
    found = in_a_process(tmp_path, "policies")
    assert names(found.stdout)[0] == "rises"
    found = in_a_process(tmp_path, "propositions", "straying")
    assert found.stdout.splitlines()[1].startswith("straying(object)  0 s")


def in_a_process(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A conftest.py is a module of its process."""
    return subprocess.run(
        [sys.executable, "-m", "pytest_safemanip", *arguments],
        cwd=folder,
        capture_output=True,
        check=False,
        text=True,
    )


def test_what_a_violation_weighs_is_told_where_it_is_more_than_usual(safemanip: Command) -> None:
    for name, told in (("cross_contamination", True), ("enclosure_access", False)):
        out = " ".join(safemanip("properties", name).out.split())
        assert ("severity 2 at least" in out) == told


def test_a_property_that_no_usual_recording_can_be_judged_by_says_so(
    safemanip: Command, folder: Path
) -> None:
    path = folder / "rules" / "near.yaml"
    text = path.read_text()
    (formula,) = (line for line in text.splitlines() if line.startswith("formula: "))
    path.write_text(text.replace(formula, "formula: F[<=1000] !obj_grasped"))
    found = " ".join(safemanip("properties", "stays_near").out.split())
    assert "cannot be judged at 20 Hz: " in found
    assert "near.yaml:7: property 'stays_near': the automaton has more than" in found
