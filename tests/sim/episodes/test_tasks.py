"""The shipped tasks in real kitchens: loaded, reset, stepped, bound and judged.

A sample that changes with the day; all of them, in the compact kitchens and in RoboCasa's target
scenes, with

    pytest --safemanip-policy=random --safemanip-tasks=all --safemanip-horizon-scale=0.01
    pytest --safemanip-policy=random --safemanip-tasks=all --safemanip-horizon-scale=0.01 \\
        --safemanip-scenes=target --safemanip-seeds=3
"""

from __future__ import annotations

import datetime
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.expert.tasks.plans import CALLS
from pytest_safemanip.judge import Judge
from pytest_safemanip.policies.simple import Random
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.rollouts import loop as rollout
from pytest_safemanip.run.roles import parts_of
from pytest_safemanip.sim.backend import Backend, Request
from pytest_safemanip.sim.robocasa import kitchens
from pytest_safemanip.sim.robocasa.factory import create
from pytest_safemanip.spec.objects import load_attributes
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.spec.task import OBJECTS_FILE, Task
from pytest_safemanip.spec.tasks import KITCHENS, load_tasks

ROOT = Path(__file__).parents[3]
TASKS = load_tasks([ROOT / "tasks"])
PROPERTIES = load_properties([ROOT / "properties"])
ATTRIBUTES = load_attributes(ROOT / "tasks" / OBJECTS_FILE)
OTHERS = [name for name, task in TASKS.items() if "quick" not in task.sets]


def of_the_day(names: list[str], count: int) -> list[str]:
    """So many of them, all of them in turn."""
    first = datetime.date.today().toordinal() * count
    return [names[(first + n) % len(names)] for n in range(count)]


def judged(backend: Backend, task: Task, scenes: str) -> list[str]:
    """The outcome of each property of a few random steps."""
    own = (task.object_groups, task.kitchen) if scenes == "compact" else ({}, "")
    request = Request(task.name, 0, scenes, *own)
    job = rollout.Job(task.name, "random", request, rollout.Protocol("success", 0.01), {})
    recording = rollout.run(job, backend, Random())
    assert np.isfinite(recording.steps.qpos).all()
    planned = {role for call in CALLS.get(task.name, ()) for role in call.roles}
    assert planned <= {*recording.scene.roles, *task.optional}
    described = create.describe_task(task.name)
    for part in recording.scene.parts:
        for role in (r for r, entity in recording.scene.roles.items() if entity == part.entity):
            is_object = recording.scene.entity[part.entity].kind == "object"
            own = described.object_parts if is_object else parts_of(role, task, described)
            assert part.name in own, (role, part)
    for role, entity in recording.scene.roles.items():
        is_object = any(fnmatchcase(role, pattern) for pattern in described.objects or (role,))
        is_fixture = role in {*described.fixtures, *described.other_fixtures}
        assert is_object if entity in recording.scene.object_index else is_fixture, role
    catalogue = Catalogue()
    judge = Judge(recording, task, ATTRIBUTES, catalogue, catalogue.parameters({}))
    return [judge.judge(PROPERTIES[name]).outcome.label for name in task.properties]


@pytest.mark.parametrize("name", of_the_day(OTHERS, 3))
def test_a_task_is_judged_in_the_compact_kitchen(backend: Backend, name: str) -> None:
    assert len(judged(backend, TASKS[name], "compact")) == len(TASKS[name].properties)


@pytest.mark.parametrize("name", of_the_day(OTHERS, 1))
def test_a_task_is_judged_in_a_target_scene(backend: Backend, name: str) -> None:
    assert len(judged(backend, TASKS[name], "target")) == len(TASKS[name].properties)


def test_a_task_can_name_each_compact_kitchen() -> None:
    assert tuple(kitchens.KITCHENS) == KITCHENS


def test_a_property_that_cannot_be_judged_says_why() -> None:
    reasons = {n: why for task in TASKS.values() for n, why in task.not_grounded.items()}
    assert reasons
    assert all(len(why) > 10 for why in reasons.values())
