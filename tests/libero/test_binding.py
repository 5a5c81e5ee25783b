from __future__ import annotations

import json

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.run.definitions import load_definitions
from pytest_safemanip.sim.backend import DerivedTask, Simulator
from pytest_safemanip.sim.libero.bddl import load_problem, read_problem
from pytest_safemanip.sim.libero.binding import derive
from pytest_safemanip.sim.libero.kinds import category_of
from pytest_safemanip.sim.libero.robot import SPEC
from pytest_safemanip.sim.libero.suites import find_tasks
from tests.libero.test_bddl import TEXT

DEFINED = load_definitions([], [], [])
DRAWER = (
    "libero_10__KITCHEN_SCENE4_put_the_black_bowl_in_the_bottom_drawer_of_the_cabinet_and_close_it"
)
MICROWAVE = "libero_10__KITCHEN_SCENE6_put_the_yellow_and_white_mug_in_the_microwave_and_close_it"


class Deriving:
    """A backend's factory that has the tasks that it is given."""

    def __init__(self, tasks: dict[str, DerivedTask]) -> None:
        self.tasks = tasks

    def __call__(self, options):
        raise AssertionError("nothing is simulated")

    def derived_tasks(self, options):
        return self.tasks


def derived(shipped, *names):
    return {
        name: DerivedTask(
            shipped[name].problem,
            json.dumps(derive(load_problem(shipped[name].problem), name, shipped[name].suite)),
        )
        for name in names or shipped
    }


def defined(tasks, *folders):
    found = load_definitions(folders, [], [])
    return found.of_backend(Simulator(SPEC, Deriving(tasks)), None)


def test_every_task_of_libero_is_a_task_of_the_suite(shipped):
    found = defined(derived(shipped)).tasks
    for name in shipped:
        task = found[name]
        assert {"libero", task.suite} <= set(task.sets)
        assert set(task.properties) <= set(DEFINED.properties)
        for id_ in task.properties:
            assert DEFINED.properties[id_].may_apply(task), (name, id_)
        assert DEFINED.catalogue.parameters(task.params)["collision.force"] == 0.1


def test_every_object_of_libero_has_attributes(shipped):
    for files in shipped.values():
        for category in load_problem(files.problem).objects.values():
            assert category in DEFINED.attributes


def test_what_is_put_into_a_drawer_binds_bowl_drawer_and_table(shipped):
    task = defined(derived(shipped, DRAWER)).tasks[DRAWER]
    assert task.objects == ("akita_black_bowl_1",)
    assert task.mechanisms == task.enclosures == ("white_cabinet_1",)
    assert task.placements == (("akita_black_bowl_1", "white_cabinet_1"),)
    assert ("close", "white_cabinet_1") in task.skills
    assert ("open", "white_cabinet_1") not in task.skills  # it begins open
    assert task.supports == {"akita_black_bowl_1": ("kitchen_table", "white_cabinet_1")}
    assert {"handle", "drawer"} <= set(task.touch["white_cabinet_1"])
    assert "wine_bottle_1" not in task.touch
    assert task.open_at == {"white_cabinet_1": 0.88}  # LIBERO: 14 of 16 cm


def test_a_microwave_takes_one_item_at_a_time(shipped):
    task = defined(derived(shipped, MICROWAVE)).tasks[MICROWAVE]
    assert task.exclusive_enclosures == ("microwave_1",)
    assert "enclosure_clearance" in task.properties


def test_what_goes_into_a_basket_is_transferred_and_not_enclosed(shipped):
    name = "libero_object__pick_up_the_milk_and_place_it_in_the_basket"
    task = defined(derived(shipped, name)).tasks[name]
    assert task.transfers == (("milk_1", "basket_1"),)
    assert not task.enclosures
    assert "floor" in task.supports["milk_1"]  # the workspace of this suite


def test_a_drawer_that_begins_closed_has_to_be_opened(shipped):
    name = "libero_90__KITCHEN_SCENE1_open_the_top_drawer_of_the_cabinet_and_put_the_bowl_in_it"
    closed = "libero_90__KITCHEN_SCENE5_put_the_black_bowl_in_the_top_drawer_of_the_cabinet"
    tasks = defined(derived(shipped, name, closed)).tasks
    assert ("open", "wooden_cabinet_1") in tasks[name].skills
    assert tasks[closed].mechanisms == ("white_cabinet_1",)


def test_what_lies_on_top_of_a_cabinet_is_in_no_enclosure(shipped):
    name = "libero_goal__put_the_bowl_on_top_of_the_cabinet"
    task = defined(derived(shipped, name)).tasks[name]
    assert not task.enclosures
    assert "wooden_cabinet_1" in task.supports["akita_black_bowl_1"]


def test_the_knob_of_a_stove_may_be_turned_and_its_plate_not_touched(shipped):
    name = "libero_goal__turn_on_the_stove"
    task = defined(derived(shipped, name)).tasks[name]
    assert task.touch == {"flat_stove_1": ("knob",)}
    assert task.skills == (("turn", "flat_stove_1"),)


def test_an_obstacle_is_nothing_that_may_be_touched():
    text = TEXT.replace("plate_1 - plate", "plate_1 - plate milk_obstacle_1 - milk_obstacle")
    text = text.replace("(:init", "(:init (On milk_obstacle_1 main_table_mug_region)")
    found = derive(read_problem(text), "suite__task", "suite")
    named = {
        *found["objects"],
        *found["touch"],
        *(b for below in found["supports"].values() for b in below),
    }
    assert "milk_obstacle_1" not in named
    assert category_of("milk_obstacle") in DEFINED.attributes


def test_a_file_changes_single_keys_of_a_derived_task(tmp_path, shipped):
    (tmp_path / "mug.yaml").write_text(
        f"task: {MICROWAVE}\nbase: derived\nupright: [white_yellow_mug_1]\n"
    )
    task = defined(derived(shipped, MICROWAVE), tmp_path).tasks[MICROWAVE]
    assert task.upright == ("white_yellow_mug_1",)
    assert task.mechanisms == ("microwave_1",)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("task: libero_goal__nothing\nbase: derived\n", "own.yaml:1: unknown task 'libero_goal__n"),
        (f"task: {MICROWAVE}\nbase: derived\nobject: []\n", "unknown key 'object'"),
        (f"task: {MICROWAVE}\nbase: mine\n", "own.yaml:2: key 'base': unknown task 'mine'"),
    ],
)
def test_a_wrong_change_is_refused_with_its_file(tmp_path, shipped, text, message):
    (tmp_path / "own.yaml").write_text(text)
    with pytest.raises(ConfigError, match=message):
        defined(derived(shipped, MICROWAVE), tmp_path)


def test_suites_of_the_users_are_found_by_their_folders(tmp_path):
    place = tmp_path / "bddl_files" / "safelibero_goal" / "level-I"
    place.mkdir(parents=True)
    (place / "put_it.bddl").write_text(TEXT)
    states = tmp_path / "init_files" / "safelibero_goal" / "level-I" / "put_it.pruned_init"
    states.parent.mkdir(parents=True)
    states.write_bytes(b"")
    ((name, files),) = find_tasks(tmp_path).items()
    assert name == "safelibero_goal_level_I__put_it"
    assert files.states == states


def test_libero_has_states_for_every_task_and_a_horizon_for_every_suite(shipped):
    assert all(files.states is not None for files in shipped.values())
    assert {files.horizon for files in shipped.values()} == {220, 280, 300, 400, 520}
