"""A user's folder whose simulator is a toy: what pytest makes of rollouts, without their cost."""

from __future__ import annotations

from pathlib import Path

from tests.plugin.conftest import Suite
from tests.toy import HAND_HEIGHT

CONFTEST = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parents[2])!r})

import numpy as np
from pytest_safemanip.propositions.definition import Parameter, Proposition
from tests.toy import World, simulator

def straying(view, o):
    '''A hand is higher above where the toy's hand starts than allowed, whatever the object.'''
    way = view.trace.steps.eef_poses[..., 2] - {HAND_HEIGHT}
    return (way > view.parameters["straying.distance"]).any(axis=1)

class Rises:
    def act(self, observation):
        return np.array([[0, 0, 0.5] + [0] * 9] * 2)
    def reset(self, episode):
        print("reset", episode.instruction)

def pytest_safemanip_policies():
    return {{"rises": Rises}}

def pytest_safemanip_backends():
    return {{"toy": simulator(lambda options: World(succeeds_at=None))}}

def pytest_safemanip_propositions():
    limit = Parameter("straying.distance", "m", 0.12, "for the test")
    return [Proposition("straying", ("object",), lambda parameters: 0.0, (limit,), straying)]
"""
INI = """
[pytest]
safemanip_policy = rises
safemanip_backend = toy
safemanip_tasks = Reach
safemanip_task_paths = mine/tasks
safemanip_property_paths = mine/properties
"""
TASK = """
task: Reach
sets: [mine]
suite: mine
horizon: atomic
objects: [obj]
properties: [grasp_stability]
"""
PROPERTY = """
id: stays_near
category: housekeeping
title: The hand stays near
source: the house rules
for_each: o in objects
formula: G !straying
atoms: {straying: straying(o)}
"""


def set_up(suite: Suite) -> None:
    """A folder whose simulator is a toy, with a task, a policy and a property of its own."""
    suite.pytester.makeconftest(CONFTEST)
    suite.pytester.makeini(INI)
    for folder, text in {"tasks": TASK, "properties": PROPERTY}.items():
        path = suite.pytester.path / "mine" / folder / "own.yaml"
        path.parent.mkdir(parents=True)
        path.write_text(text)
