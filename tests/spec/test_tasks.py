from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.propositions.binding import Zone
from pytest_safemanip.spec.objects import load_attributes
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.spec.task import OBJECTS_FILE
from pytest_safemanip.spec.tasks import load_task, load_tasks
from pytest_safemanip.trace.elements import Entity
from tests import toy

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = load_tasks([ROOT / "tasks"])
PROPERTIES = load_properties([ROOT / "properties"])

TEXT = """\
task: PutAway
sets: [quick, own]
suite: storing
horizon: short
objects: [obj, other]
enclosures: [cab]
exclusive_enclosures: [cab]
mechanisms: [cab]
placements: [obj in cab]
skills: [pick obj, open cab]
transfers: [other into obj]
tools: [robot, other]
open_at:
  cab: 0.5
touch:
  obj: [body]
  cab: [door, handle]
supports:
  obj: [counter, cab]
upright: [obj]
zones:
  ahead: {around: cab, margin: 0.1, above: 0.5}
  close: {around: other}
optional: [other]
not_grounded:
  object_containment: water is not simulated
properties: [release_stability]
compact:
  kitchen: full
  object_groups:
    obj: [mug, cup]
liquids:
  water: obj
"""
CATEGORIES = {"mug": frozenset({"container"}), "apple": frozenset({"ready_to_eat"})}
SCENE = dataclasses.replace(
    toy.SCENE,
    roles={"obj": "mug", "other": "apple", "cab": "cabinet", "counter": "counter"},
)


@pytest.fixture
def written(tmp_path):
    def written(old="", new="", name="task.yaml"):
        assert old in TEXT
        path = tmp_path / name
        path.write_text(TEXT.replace(old, new) if old else TEXT)
        return path

    return written


def test_a_task_is_read_as_written(written):
    task = load_task(written())
    assert (task.name, task.suite, task.horizon) == ("PutAway", "storing", "short")
    assert (task.sets, task.properties) == (("quick", "own"), ("release_stability",))
    assert task.placements == (("obj", "cab"),)
    assert task.skills == (("pick", "obj"), ("open", "cab"))
    assert task.open_at == {"cab": 0.5}
    assert task.kitchen == "full"
    assert task.object_groups == {"obj": ("mug", "cup")}
    assert task.not_grounded == {"object_containment": "water is not simulated"}


def test_what_an_episode_lacks_is_left_out_of_its_binding(written):
    path = written()
    roles = {name: role for name, role in SCENE.roles.items() if name != "other"}
    found = load_task(path).bind(dataclasses.replace(SCENE, roles=roles), CATEGORIES)
    assert found.objects == ("mug",)
    assert found.transfers == ()
    assert found.tools == ("robot",)
    path.write_text(path.read_text().replace("optional: [other]\n", ""))
    with pytest.raises(TraceError, match="the scene has no role 'other'"):
        load_task(path).bind(dataclasses.replace(SCENE, roles=roles), CATEGORIES)


@pytest.mark.parametrize(("optional", "left"), [("[cab]", True), ("[other]", False)])
def test_shelves_without_doors_are_no_mechanism_where_a_task_may_have_them(written, optional, left):
    task = load_task(written("optional: [other]", f"optional: {optional}"))
    assert task.bind(SCENE, CATEGORIES).mechanisms == ("cabinet",)
    shelves = task.bind(dataclasses.replace(SCENE, joints=()), CATEGORIES)
    assert shelves.enclosures == ("cabinet",)
    assert shelves.mechanisms == (() if left else ("cabinet",))
    assert shelves.skills == (("pick", "mug"), *(() if left else (("open", "cabinet"),)))
    assert shelves.emptied == ({"mechanisms"} if left else set())


def test_the_binding_names_the_entities_that_play_the_roles(written):
    binding = load_task(written()).bind(SCENE, CATEGORIES)
    assert binding.objects == ("mug", "apple")
    assert binding.enclosures == binding.mechanisms == ("cabinet",)
    assert binding.placements == (("mug", "cabinet"),)
    assert binding.skills == (("pick", "mug"), ("open", "cabinet"))
    assert binding.transfers == (("apple", "mug"),)
    assert binding.tools == ("robot", "apple")
    assert binding.open_at == {"cabinet": 0.5}
    assert binding.touch == {("mug", "body"), ("cabinet", "door"), ("cabinet", "handle")}
    assert binding.supports == {"mug": {"counter", "cabinet"}}
    assert binding.upright == {"mug"}
    assert binding.attributes == CATEGORIES
    assert binding.zones == {"ahead": Zone("cabinet", 0.1, 0.5), "close": Zone("apple")}


def test_the_binding_knows_what_the_scene_has_beside_the_roles(written):
    known = {**CATEGORIES, "Counter": frozenset({"metal"})}
    scene = dataclasses.replace(
        SCENE,
        entities=(*SCENE.entities, Entity("vase", "object", "mug")),
        bodies=(*SCENE.bodies, dataclasses.replace(SCENE.bodies[0], entity="vase")),
    )
    binding = load_task(written()).bind(scene, known)
    assert binding.things == ("mug", "apple", "vase")
    assert binding.obstacles == ("vase",)  # the mug and the apple are of the task
    assert binding.fixtures == ("counter", "cabinet")
    assert binding.kinds["vase"] == "mug"
    assert binding.kinds["cabinet"] == "HingeCabinet"
    assert binding.attributes_of("counter") == {"metal"}
    assert binding.attributes_of("robot") == frozenset()
    with pytest.raises(TraceError, match="kind of fixture 'HingeCabinet' has no row"):
        binding.attributes_of("cabinet")


@pytest.mark.parametrize(
    ("relation", "number"),
    [
        (None, 1),
        ("objects", 2),
        ("enclosures", 1),
        ("exclusive_enclosures", 1),
        ("placements", 1),
        ("skills", 2),
        ("transfers", 1),
        ("tools", 2),
        ("zones", 2),
    ],
)
def test_a_task_knows_how_many_instances_a_property_has_in_it(written, relation, number):
    task = load_task(written())
    assert task.instances(relation) == number
    if relation:
        assert len(task.bind(SCENE, CATEGORIES).relation(relation)) == number


def test_a_role_that_nobody_plays_is_named_with_file_and_near_miss(written):
    path = written("upright: [obj]", "upright: [obk]")
    with pytest.raises(TraceError) as caught:
        load_task(path).bind(SCENE, CATEGORIES)
    assert str(caught.value) == f"{path}: the scene has no role 'obk'; did you mean 'obj'?"


def test_a_category_without_attributes_is_an_error(written):
    with pytest.raises(TraceError, match=r"category 'apple' has no row in objects\.yaml"):
        load_task(written()).bind(SCENE, {"mug": frozenset()})


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("task: PutAway", "task: Put-Away", 1, "'task': expected letters, digits and '_'"),
        ("task: PutAway", "task: ''", 1, "'task': expected text"),
        ("suite: storing\n", "", 1, "key 'suite' is missing"),
        ("horizon: short", "horizons: short", 4, "'horizons'; did you mean 'horizon'?"),
        ("horizon: short", "horizon: shrot", 4, "unknown horizon 'shrot'; did you mean 'short'?"),
        ("horizon: short", "horizon: eternal", 4, "known: atomic, long, medium, short"),
        ("sets: [quick, own]", "sets: quick", 2, "'sets': expected a list, found 'quick'"),
        ("exclusive_enclosures: [cab]", "exclusive_enclosures: [obj]", 7, "'obj' is not among"),
        ("obj in cab", "obj on cab", 9, "expected 'OBJECT in ENCLOSURE', found 'obj on cab'"),
        ("obj in cab", "obk in cab", 9, "'obk in cab': 'obk' is none of the task's objects"),
        ("obj in cab", "obj in box", 9, "'obj in box': 'box' is not under 'enclosures'; "),
        ("pick obj", "pik obj", 10, "found 'pik obj'; did you mean 'pick'?"),
        ("pick obj", "pick", 10, "expected 'SKILL ROLE', found 'pick'"),
        ("other into obj", "other in obj", 11, "expected 'OBJECT into RECEIVER'"),
        ("[robot, other]", "[hand]", 12, "'hand' is not among the objects, nor 'robot'"),
        ("cab: 0.5", "cab: -0.5", 14, "'open_at.cab': expected a positive number, at most 1"),
        ("cab: 0.5", "cab: 1.5", 14, "expected a positive number, at most 1, found '1.5'"),
        ("cab: 0.5", "cab: wide", 14, "expected a positive number, at most 1, found 'wide'"),
        ("obj: [body]", "obj: body", 16, "'touch.obj': expected a list"),
        ("{around: other}", "{}", 23, "key 'zones.close.around' is missing"),
        (
            "margin: 0.1",
            "margin: -1",
            22,
            "'zones.ahead.margin': expected a number from 0 to 10, found",
        ),
        (
            "above: 0.5",
            "above: 11",
            22,
            "'zones.ahead.above': expected a number from 0 to 10, found",
        ),
        ("sets: [quick, own]", "sets: [quick, quick]", 2, "'sets': 'quick' is given twice"),
        ("upright: [obj]", "upright: [obj, obj]", 20, "'upright': 'obj' is given twice"),
        ("other into obj", "other into other", 11, "expected 'OBJECT into RECEIVER'"),
        ("  close:", "  cab:", 23, "'zones.cab': 'cab' is the name of something else"),
        ("  close:", "  robot:", 23, "'zones.robot': 'robot' is the name of something else"),
        ("  close:", "  water:", 33, "'liquids.water': 'water' is the name of something else"),
        ("  water: obj", "  cab: obj", 33, "'liquids.cab': 'cab' is the name of something else"),
        ("  water: obj", "  water: obj\n  oil: obj", 34, "'obj' is full of another liquid already"),
        ("above: 0.5", "over: 0.5", 22, "'zones.ahead.over'; did you mean"),
        ("  close:", "  too close:", 23, "expected letters, digits and '_' in the name of a zone"),
        (
            "  water: obj",
            "  water: cab",
            33,
            "'cab' is none of the task's objects; put it into 'obj",
        ),
        ("  water: obj", "  obj: other", 33, "expected 'LIQUID: OBJECT', found obj: other"),
        ("  water: obj", "  hot water: obj", 33, "in the name of a liquid, found 'hot water'"),
        ("  object_groups:", "  groups:", 30, "'compact.groups'; did you mean"),
        ("upright: [obj]", "hot_source: [obj]", 20, "key 'hot_source'; did you mean 'hot'?"),
    ],
)
def test_a_mistake_is_named_with_file_line_and_remedy(written, old, new, line, message):
    path = written(old, new)
    with pytest.raises(ConfigError) as caught:
        load_task(path)
    assert str(caught.value).startswith(f"{path}:{line}: ")
    assert message in str(caught.value)


def test_tasks_of_all_folders_are_read_once_and_the_objects_are_no_task(written, tmp_path):
    written()
    (tmp_path / OBJECTS_FILE).write_text("categories: {}\n")
    assert list(load_tasks([tmp_path])) == ["PutAway"]
    assert list(load_tasks([ROOT / "tasks", tmp_path])) == [*SHIPPED, "PutAway"]


def test_two_tasks_of_one_name_are_refused_with_both_files(written, tmp_path):
    one, other = written(name="a.yaml"), written(name="b.yaml")
    with pytest.raises(ConfigError) as caught:
        load_tasks([tmp_path])
    assert str(caught.value) == f"task 'PutAway' is in {one} and {other}"


def test_a_folder_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(ConfigError, match="missing: no such folder of tasks"):
        load_tasks([tmp_path / "missing"])


@pytest.mark.parametrize("task", SHIPPED.values(), ids=lambda t: t.name)
def test_a_shipped_task_names_only_what_exists(task):
    assert task.path.stem == task.name
    for name in task.properties:
        assert PROPERTIES[name].may_apply(task)
    assert {role for pair in task.placements for role in pair} <= {
        *task.objects,
        *task.enclosures,
    }
    attributes = load_attributes(ROOT / "tasks" / OBJECTS_FILE)
    for names in task.object_groups.values():
        assert set(names) <= set(attributes)
    assert set(task.not_grounded) <= set(PROPERTIES)


def test_all_target_tasks_of_robocasa_are_shipped():
    sets = [name for task in SHIPPED.values() for name in task.sets if name != "quick"]
    found = {name: sets.count(name) for name in sets}
    assert found == {"atomic_seen": 18, "composite_seen": 16, "composite_unseen": 16}


def test_what_the_hand_has_to_move_it_may_touch():
    # "Put the onion and broccoli in the pot. Retrieve the spatula and lightly stir": all three.
    task = SHIPPED["StirVegetables"]
    moved = {"veg1", "veg2", "spatula"}
    assert moved <= set(task.objects)
    assert moved <= set(task.touch)
    assert all("pot" in task.supports[name] for name in moved)


@pytest.mark.parametrize("name", ["OpenDrawer", "PickPlaceCounterToCabinet"])
def test_a_shipped_task_binds_to_the_scene_of_its_episode(rollouts, name):
    scene = rollouts.get(name).recording.scene
    attributes = load_attributes(ROOT / "tasks" / OBJECTS_FILE)
    binding = SHIPPED[name].bind(scene, attributes)
    parts = {(part.entity, part.name) for part in scene.parts}
    assert binding.touch
    for entity in binding.mechanisms:
        assert any(scene.joints[j].gives_access for j in scene.joints_of(entity))
    for entity in binding.enclosures:
        assert scene.boxes_of(entity, "interior")
    for role, allowed in SHIPPED[name].touch.items():
        # Not every handle has a part of its own, but something of it may be touched.
        assert any((scene.roles[role], part) in parts for part in allowed)


def test_what_goes_into_a_glass_may_lie_on_what_else_is_in_it():
    task = SHIPPED["MakeIceLemonade"]
    contents = {"lemon_wedge", "ice_cube1", "ice_cube2"}
    assert all(contents - {role} <= set(task.supports[role]) for role in contents)
