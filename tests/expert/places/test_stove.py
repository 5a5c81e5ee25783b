from __future__ import annotations

import dataclasses

import pytest

from pytest_safemanip.expert.places.stove import BEFORE_BURNER, free_burner, named_burner
from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.trace.elements import Box, Entity, Surface
from tests import toy

NAMED_BURNERS = {"front_left": (0.3, 0.6, 0.92), "rear_left": (0.6, 0.6, 0.92)}
NAMED_STOVE = dataclasses.replace(
    toy.SCENE,
    entities=(*toy.SCENE.entities, Entity("stove", "fixture", "Stove")),
    boxes=tuple(Box("stove", name, "burner", (0.08, 0.08, 0.1)) for name in NAMED_BURNERS),
    roles={**toy.SCENE.roles, "stove": "stove"},
)


def _named(instruction):
    step = toy.at_rest(box_pose=[(*place, *toy.UPRIGHT) for place in NAMED_BURNERS.values()])
    arm = Arm(NAMED_STOVE, step, instruction)
    return named_burner(arm, Furniture(arm, "stove"))


@pytest.mark.parametrize("name", NAMED_BURNERS)
def test_a_burner_is_known_by_its_name_in_the_instruction(name):
    told = f"Place it on the {name.replace('_', ' ')} burner on the stove."
    assert _named(told) == pytest.approx(NAMED_BURNERS[name])


def test_without_a_name_there_is_no_burner():
    with pytest.raises(SkillFailed, match="names no burner"):
        _named("Place it on the stove.")


FRONT_LEFT, FRONT_RIGHT = (0.3, 0.6, 0.92), (0.3, 0.2, 0.92)
REAR_LEFT, REAR_RIGHT = (0.6, 0.6, 0.92), (0.6, 0.2, 0.92)
BURNERS = (REAR_RIGHT, FRONT_RIGHT, REAR_LEFT, FRONT_LEFT)
STOVE = dataclasses.replace(
    toy.SCENE,
    entities=(*toy.SCENE.entities, Entity("stove", "fixture", "Stove")),
    boxes=tuple(Box("stove", str(k), "burner", (0.08, 0.08, 0.1)) for k in range(4)),
    roles={**toy.SCENE.roles, "stove": "stove"},
)


@pytest.mark.parametrize(
    ("other", "chosen"),
    [
        ((3.0, 3.0, 0.94), FRONT_LEFT),
        (FRONT_LEFT, FRONT_RIGHT),
    ],
    ids=["free", "one is taken"],
)
def test_a_kettle_goes_where_there_is_room_in_front_and_near(other, chosen):
    step = toy.at_rest(
        object_pose=((0.3, 1.0, 1.0, *toy.UPRIGHT), (*other, *toy.UPRIGHT)),
        box_pose=[(*place, *toy.UPRIGHT) for place in BURNERS],
    )
    arm = Arm(STOVE, step)
    assert free_burner(arm, Thing(arm, "obj"), Furniture(arm, "stove")) == pytest.approx(chosen)


@pytest.mark.parametrize(
    ("half", "centre"),
    [((0.1, 0.1, 0.06), (0.0, 0.0, 0.0)), ((0.2, 0.1, 0.03), (-0.1, 0.0, 0.0))],
    ids=["a pot", "a pan, its handle towards the robot"],
)
def test_a_kettle_is_not_driven_towards_a_vessel(half, centre):
    mug, apple = STOVE.bodies
    vessel = dataclasses.replace(apple, half=half, centre=centre)
    step = toy.at_rest(
        object_pose=((0.3, 1.0, 1.0, *toy.UPRIGHT), (*REAR_LEFT, *toy.UPRIGHT)),
        box_pose=[(*place, *toy.UPRIGHT) for place in BURNERS],
    )
    arm = Arm(dataclasses.replace(STOVE, bodies=(mug, vessel)), step)
    spot = free_burner(arm, Thing(arm, "obj"), Furniture(arm, "stove"))
    assert spot == pytest.approx(FRONT_RIGHT)


def test_a_kettle_stands_beside_a_burner_that_a_handle_reaches_to():
    mug, apple = STOVE.bodies
    pan = dataclasses.replace(apple, half=(0.1, 0.2, 0.03), centre=(0.0, 0.1, 0.0))
    step = toy.at_rest(
        object_pose=((0.3, 1.0, 1.0, *toy.UPRIGHT), (*FRONT_RIGHT, *toy.UPRIGHT)),
        box_pose=[(*place, *toy.UPRIGHT) for place in BURNERS],
    )
    arm = Arm(dataclasses.replace(STOVE, bodies=(mug, pan)), step)
    spot = free_burner(arm, Thing(arm, "obj"), Furniture(arm, "stove"))
    assert spot == pytest.approx((0.3, 0.62, 0.92))


def _below_a_microwave(front):
    pose = (front + 0.25, 0.4, 1.5, *toy.UPRIGHT)
    microwave = Surface("cabinet", "", (0.25, 0.4, 0.15), pose)
    step = toy.at_rest(
        eef_pose=(0.3, 1.0, 1.2, *toy.UPRIGHT),
        object_pose=((0.3, 1.0, 1.0, *toy.UPRIGHT), (3.0, 3.0, 0.94, *toy.UPRIGHT)),
        box_pose=[(*place, *toy.UPRIGHT) for place in BURNERS],
    )
    return Arm(dataclasses.replace(STOVE, surfaces=(microwave,)), step)


def test_below_a_microwave_a_kettle_stands_nearer_to_the_robot():
    arm = _below_a_microwave(0.25)
    spot = free_burner(arm, Thing(arm, "obj"), Furniture(arm, "stove"))
    assert spot == pytest.approx((0.3 - BEFORE_BURNER, 0.6, 0.92))


def test_deep_below_a_microwave_there_is_no_room():
    arm = _below_a_microwave(0.1)
    with pytest.raises(SkillFailed, match="no room"):
        free_burner(arm, Thing(arm, "obj"), Furniture(arm, "stove"))
