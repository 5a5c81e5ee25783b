from __future__ import annotations

import dataclasses

import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.tasks.cutting import tool_for
from pytest_safemanip.trace.elements import Entity
from tests import toy


@pytest.mark.parametrize(("food", "tool"), [("carrot", "peeler"), ("garlic", "knife")])
def test_what_has_a_skin_is_peeled_and_the_rest_is_cut(food, tool):
    entities = [
        Entity(e.name, e.kind, food) if e.name == toy.SCENE.roles["obj"] else e
        for e in toy.SCENE.entities
    ]
    arm = Arm(dataclasses.replace(toy.SCENE, entities=tuple(entities)), toy.at_rest())
    assert tool_for(arm, "peeler", "knife", "obj") == tool
