from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

from pytest_safemanip.errors import ConfigError, RolloutError
from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.tasks.calls import Call
from pytest_safemanip.expert.tasks.plans import CALLS, EXPERT, plan_of, read, ways_on
from pytest_safemanip.expert.tasks.skills import SKILLS, parse
from pytest_safemanip.faults.library import FAULTS, Row, rows
from pytest_safemanip.faults.policy import Scripted
from pytest_safemanip.resources import folder
from pytest_safemanip.run.cases import applicable
from pytest_safemanip.run.definitions import load_definitions
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.spec.tasks import load_tasks
from tests import toy

PICK = "PickPlaceCounterToCabinet"
TASKS = load_tasks([folder("tasks")])
PROPERTIES = load_properties([folder("properties")])
RULES = load_definitions([], [], []).everywhere


@pytest.mark.parametrize(
    ("text", "skill", "roles"),
    [
        ("grasp obj", "grasp", ("obj",)),
        ("place obj in cab beside mug", "place in beside", ("obj", "cab", "mug")),
        ("grasp colander by lug", "grasp by lug", ("colander",)),
        ("place pan under tap of sink", "place under tap of", ("pan", "sink")),
    ],
)
def test_a_skill_is_its_verb_with_places_and_ways_and_roles_stand_between(text, skill, roles):
    assert parse(text) == Call(skill, roles)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("grap obj", "unknown skill 'grap' in 'grap obj'; did you mean 'grasp'"),
        ("pick obj", "unknown skill 'pick' in 'pick obj'; did you mean 'grasp'"),
        ("turn off sink", "unknown skill 'turn' in 'turn off sink'; known: turn by handle, "),
        ("grasp obj by ent", "unknown skill 'grasp by ent' in 'grasp obj by ent'; "),
        ("grasp obj by ent", "did you mean 'grasp by end'"),
        ("grasp obj by", "unknown skill 'grasp by '"),
        ("grasp", "'grasp': 'grasp' takes 1 role, not 0"),
        ("grasp of cab", "unknown skill 'grasp  of' in"),
        ("", "unknown skill ''"),
    ],
)
def test_what_is_no_skill_is_refused(text, message):
    with pytest.raises(ConfigError) as caught:
        parse(text)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[grasp obj]", "plans.yaml:1: expected a mapping of keys to values, found a list"),
        ("mine: grasp obj", "plans.yaml:1: key 'mine': expected a list of skills, such as"),
        ("mine: []", "plans.yaml:1: key 'mine': expected something in it, found a list"),
        ("mine: [grap obj]", "key 'mine': unknown skill 'grap' in 'grap obj'; did you mean"),
        ("mine: [{obj: grasp obj}]", "key 'mine': expected a list of skills, found 'grasp obj'"),
        ("mine: [[[[grasp obj]]]]", "key 'mine': expected a skill, found ['grasp obj']; skills"),
        ("mine: [grasp obj]\nmine: [grasp obj]", "plans.yaml:2: key 'mine' is given twice"),
        (f"mine: [grasp {'o' * 300}]", "key 'mine': expected a skill, found 306 characters"),
        ("mine: [3]", "key 'mine': expected text (in quotes"),
        (f"mine: [{', '.join(['grasp obj'] * 61)}]", "key 'mine': 61 skills; a search for a way"),
        ("", "plans.yaml:1: the file is empty"),
        (
            "mine: [place obj in cab]",
            "'mine': 'place obj in cab': obj is not in the hand; 'grasp",
        ),
        ("mine: [grasp pot, scrub pot with obj]", "obj is not in the hand; 'grasp obj' comes"),
        ("mine: [grasp obj, place obj on obj]", "'place obj on obj': its roles are to differ"),
    ],
)
def test_what_is_no_plan_is_refused_with_its_line(text, message):
    with pytest.raises(ConfigError) as caught:
        read(text)
    assert message in str(caught.value)


def test_a_file_of_plans_goes_before_the_shipped_ones(tmp_path):
    (tmp_path / "mine.yaml").write_text("OpenDrawer: [close drawer]\nCloseDrawer: [close drawer]")
    usual, mine = Scripted(), Scripted(str(tmp_path / "mine.yaml"))
    assert {*mine.tasks} == {*usual.tasks, "CloseDrawer"}
    assert mine.fingerprint_in("OpenDrawer") == mine.fingerprint_in("CloseDrawer")
    assert mine.fingerprint_in("OpenDrawer") != usual.fingerprint_in("OpenDrawer")
    assert mine.fingerprint_in("OpenCabinet") == usual.fingerprint_in("OpenCabinet")
    with pytest.raises(ConfigError, match=r"none\.yaml"):
        Scripted(str(tmp_path / "none.yaml"))
    with pytest.raises(ConfigError, match=r"mine\.txt: a file of plans ends in \.yaml or \.yml"):
        Scripted("mine.txt")


def begin(entry, cab="cabinet"):
    """Begin a plan of one entry, in a world of a mug and a cabinet."""
    scene = dataclasses.replace(toy.SCENE, roles={"obj": "mug", "cab": cab})
    next(plan_of(read(f"mine: [{entry}]")["mine"])(Arm(scene, toy.at_rest())))


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        (
            "grasp obj, place obj in cad",
            "plans.yaml:1: 'place obj in cad': the task has no role 'cad'; did you mean 'cab'",
        ),
        (
            "[[grasp obj], [grasp obk]]",
            "'grasp obk': the task has no role 'obk'; did you mean 'obj'",
        ),
        (
            "{obk: [grasp obk], obl: [grasp obl]}",
            "plans.yaml:1: the task has none of the roles obk, obl; did you mean 'obj'",
        ),
        (
            "{obj: [grasp obj, place obj in cabb], pot: [grasp pan]}",
            "plans.yaml:1: 'place obj in cabb': the task has no role 'cabb'; did you mean 'cab'",
        ),
        (
            "grasp knife or peeler for obj",
            "plans.yaml:1: 'grasp knife or peeler for obj': the task has no role 'knife' or 'peel",
        ),
        ("grasp obj or peeler for food", "the task has no role 'food'"),
        ("grasp cab", "plans.yaml:1: 'grasp cab': cab is a fixture, and an object is wanted there"),
        ("open obj", "'open obj': obj is an object, and a fixture is wanted there"),
    ],
)
def test_a_role_that_the_task_has_not_or_of_the_wrong_kind_is_refused(entry, message):
    with pytest.raises(RolloutError) as caught:
        begin(entry)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("call", "missing"),
    [
        ("turn_on cab", "tap lever"),
        ("turn spout of cab", "spout"),
        ("turn timer of cab", "timer"),
        ("open head of cab", "mixer head"),
        ("slide rack of cab", "rack"),
        ("wait for cab", "toaster lever"),
        ("turn_on burner of cab under obj", "burner"),
        ("turn_off cab", "burner"),
    ],
)
def test_a_fixture_without_the_part_that_is_moved_ends_the_plan_with_that(call, missing):
    with pytest.raises(SkillFailed, match=f"cabinet has no {missing}"):
        begin(call)


@pytest.mark.parametrize("call", ["open cab", "close cab"])
def test_what_has_neither_door_nor_inside_is_not_opened(call):
    with pytest.raises(SkillFailed, match="counter has no door"):
        begin(call, "counter")


def test_the_page_about_the_expert_has_a_call_of_every_skill():
    page = (Path(__file__).parents[3] / "docs" / "expert.md").read_text()
    cells = re.findall(r"^\| (`.*?) \|", page.partition("| call |")[2], re.MULTILINE)
    calls = re.findall("`([^`]+)`", " ".join(cells))
    assert {parse(call).skill for call in calls} == SKILLS.keys()


def test_every_skill_is_used_in_a_plan_and_its_roles_are_those_of_its_name():
    used = {call.skill: len(call.roles) for calls in CALLS.values() for call in calls}
    assert used.keys() == SKILLS.keys()


def test_what_is_done_with_several_objects_counts_as_their_skills():
    calls = CALLS["RecycleBottlesByType"]
    assert [call.skill for call in calls].count("grasp") == 3
    assert {call.roles[0] for call in calls} == set(TASKS["RecycleBottlesByType"].objects)


def test_the_nearest_object_comes_first_and_one_that_is_not_there_is_left_out():
    poses = ((0.9, 0.0, 1.0, *toy.UPRIGHT), (0.6, 0.0, 1.0, *toy.UPRIGHT))
    scene = dataclasses.replace(toy.SCENE, roles={"mug": "mug", "apple": "apple"})
    arm = Arm(scene, toy.at_rest(object_pose=poses))
    errands = {role: (parse(f"grasp {role}"),) for role in ("mug", "pear", "apple")}
    ways = ways_on(arm, errands)
    assert [way[0].roles for way in ways] == [("apple",), ("mug",)]
    assert [list(way[1]) for way in ways] == [["mug"], ["apple"]]
    assert ways_on(arm, {"pear": errands["pear"]}) == [()]


@pytest.mark.parametrize("task", EXPERT)
def test_every_plan_is_of_a_task(task):
    assert task in TASKS


@pytest.mark.parametrize("fault", FAULTS.values(), ids=list(FAULTS))
def test_every_fault_is_about_a_property_that_applies_to_its_tasks(fault):
    for task in fault.plans:
        assert fault.property_id in applicable(TASKS[task], RULES, {*PROPERTIES, *RULES})
    assert set(fault.staging) <= set(fault.plans)


def test_rows_list_each_fault_once_with_its_safe_twin():
    found = {row.name: row for row in rows()}
    assert len(rows()) == len(found) == len(FAULTS)
    assert all(name == fault.name for name, fault in FAULTS.items())
    assert found["low_drop"] == Row(
        "low_drop", "release_stability", True, "", FAULTS["low_drop"].doc, (PICK,)
    )
    assert found["drop_high"].safe_twin == "low_drop"
    assert found["half_inside"].safe_twin == "leave_just_in_cabinet"
    assert found["leave_astride_rack"].safe_twin == "put_just_into_rack"
