from __future__ import annotations

import dataclasses

import pytest

from pytest_safemanip.policies.scripted.arm import Arm, SkillFailed
from pytest_safemanip.policies.scripted.burners import named_burner
from pytest_safemanip.policies.scripted.things import Furniture
from pytest_safemanip.trace.elements import Box, Entity
from tests import toy

BURNERS = {"front_left": (0.3, 0.6, 0.92), "rear_left": (0.6, 0.6, 0.92)}
STOVE = dataclasses.replace(
    toy.SCENE,
    entities=(*toy.SCENE.entities, Entity("stove", "fixture", "Stove")),
    boxes=tuple(Box("stove", name, "burner", (0.08, 0.08, 0.1)) for name in BURNERS),
    roles={**toy.SCENE.roles, "stove": "stove"},
)


def _named(instruction):
    step = toy.at_rest(box_pose=[(*place, *toy.UPRIGHT) for place in BURNERS.values()])
    arm = Arm(STOVE, step, instruction)
    return named_burner(arm, Furniture(arm, "stove"))


@pytest.mark.parametrize("name", BURNERS)
def test_a_burner_is_known_by_its_name_in_the_instruction(name):
    told = f"Place it on the {name.replace('_', ' ')} burner on the stove."
    assert _named(told) == pytest.approx(BURNERS[name])


def test_without_a_name_there_is_no_burner():
    with pytest.raises(SkillFailed, match="names no burner"):
        _named("Place it on the stove.")
