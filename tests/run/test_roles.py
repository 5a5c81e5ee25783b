from __future__ import annotations

from pathlib import Path

import pytest

from pytest_safemanip.run.roles import task_roles
from pytest_safemanip.sim.backend import FixtureRole
from pytest_safemanip.sim.robocasa.factory import create
from pytest_safemanip.spec.tasks import load_task

TASKS = Path(__file__).parents[2] / "tasks"


@pytest.fixture
def table():
    def table(name):
        task = load_task(TASKS / f"{name}.yaml")
        return {role.name: role for role in task_roles(task, create.describe_task(name))}

    return table


def test_a_table_says_what_a_role_is_for_and_what_of_it_may_be_touched(table):
    drawer = table("OpenDrawer")["drawer"]
    assert drawer.uses == ("mechanisms", "skills")
    assert drawer.fixtures == ("top_drawer",)
    assert drawer.parts == ("body", "drawer", "handle")
    assert drawer.touch == ("handle", "drawer")


def test_objects_have_a_body_and_come_first(table):
    found = table("PickPlaceCounterToCabinet")
    obj = found["obj"]
    assert next(iter(found)) == "obj"
    assert obj.uses == ("objects", "placements", "skills", "supports")
    assert (obj.fixtures, obj.parts) == ((), ("body",))


def test_a_fixture_that_only_the_simulator_names_is_listed_too(table):
    stool = table("DeliverStraw")["stool"]
    assert (stool.uses, stool.fixtures, stool.touch) == ((), ("stool",), ())


def test_of_a_fixture_that_only_an_episode_tells_any_part_is_possible():
    described = create.describe_task("OpenDropDownDoor")
    assert described.fixtures["fxtr"] == FixtureRole((), described.any_part)
