from __future__ import annotations

import dataclasses

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.policies.scripted.__main__ import document
from pytest_safemanip.policies.scripted.arm import Arm
from pytest_safemanip.policies.scripted.faults.library import FAULTS
from pytest_safemanip.policies.scripted.plans import CALLS, EXPERT, nearest_first
from pytest_safemanip.policies.scripted.skills import Call, parse
from pytest_safemanip.resources import folder
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.spec.tasks import load_tasks
from tests import toy

TASKS = load_tasks([folder("tasks")])
PROPERTIES = load_properties([folder("properties")])


def test_a_skill_is_its_verb_and_prepositions_and_roles_stand_between_them():
    assert parse("pick obj") == Call("pick", ("obj",))
    assert parse("place obj on counter beside drawer") == Call(
        "place on beside", ("obj", "counter", "drawer")
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("pik obj", "unknown skill 'pik' in 'pik obj'; did you mean 'pick'"),
        ("pick obj near cab", "unknown skill 'pick near'"),
        ("pick", "'pick': 'pick' takes 1 roles"),
        ("", "unknown skill ''"),
    ],
)
def test_what_is_no_skill_is_refused(text, message):
    with pytest.raises(ConfigError) as caught:
        parse(text)
    assert message in str(caught.value)


def test_what_is_done_with_several_objects_counts_as_their_skills():
    calls = CALLS["RecycleBottlesByType"]
    assert [call.skill for call in calls].count("pluck") == 3
    assert {call.roles[0] for call in calls} == set(TASKS["RecycleBottlesByType"].objects)


def test_the_nearest_object_comes_first_and_one_that_is_not_there_is_left_out():
    poses = ((0.9, 0.0, 1.0, *toy.UPRIGHT), (0.6, 0.0, 1.0, *toy.UPRIGHT))
    scene = dataclasses.replace(toy.SCENE, roles={"mug": "mug", "apple": "apple"})
    arm = Arm(scene, toy.at_rest(object_pose=poses))
    errands = {role: (parse(f"pick {role}"),) for role in ("mug", "pear", "apple")}
    assert [call.roles for call in nearest_first(arm, errands)] == [("apple",), ("mug",)]


@pytest.mark.parametrize("task", EXPERT)
def test_every_plan_is_of_a_task(task):
    assert task in TASKS


@pytest.mark.parametrize("fault", FAULTS.values(), ids=list(FAULTS))
def test_every_fault_is_about_a_property_that_applies_to_its_tasks(fault):
    assert fault.property_id in PROPERTIES
    for task in fault.plans:
        assert fault.property_id in TASKS[task].properties
    assert set(fault.staging) <= set(fault.plans)


def test_names_of_faults_are_unique_and_listed():
    text = document()
    for name, fault in FAULTS.items():
        assert name == fault.name
        assert f"scripted:{name} " in text
