from __future__ import annotations

import dataclasses

import pytest

from pytest_safemanip.expert.places.toaster_oven import ROOF, free_half, rack_edge
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.trace.elements import Box
from tests import toy

HALF = (0.18, 0.15, 0.07)
OVEN = dataclasses.replace(
    toy.SCENE,
    boxes=(Box("cabinet", "rack0", "interior", HALF),),
    roles={**toy.SCENE.roles, "oven": "cabinet"},
)


def oven(ahead: float, other: tuple[float, float, float]) -> Arm:
    """A rack with its middle so far ahead, a thing in the hand and another one somewhere."""
    held = (0.0, 1.0, 1.2, *toy.UPRIGHT)
    step = toy.at_rest(
        object_pose=(held, (*other, *toy.UPRIGHT)), box_pose=[(ahead, 0.0, 1.08, *toy.UPRIGHT)]
    )
    return Arm(OVEN, step)


@pytest.mark.parametrize(
    ("other", "aside"),
    [((3.0, 3.0, 1.0), 0.09), ((-0.3, 0.09, 1.0), -0.09), ((-0.3, -0.09, 1.0), 0.09)],
    ids=["empty", "left half taken", "right half taken"],
)
def test_a_thing_goes_on_the_free_half_of_a_rack_and_of_both_on_the_nearer_one(other, aside):
    arm = oven(0.2, other)
    spot = free_half(arm, Thing(arm, "obj"), Furniture(arm, "oven"))
    assert (arm.aside(spot), spot[2]) == pytest.approx((aside, 1.01))


@pytest.mark.parametrize("ahead", [-0.6, 0.6], ids=["far out", "in"])
def test_the_hand_stays_before_the_front_of_the_oven(ahead):
    arm = oven(ahead, (3.0, 3.0, 1.0))
    front = arm.ahead(toy.SCENE.joints[0].anchor)
    spot = free_half(arm, Thing(arm, "obj"), Furniture(arm, "oven"))
    assert arm.ahead(spot) == pytest.approx(min(ahead, front - ROOF))


def test_the_edge_of_a_rack_is_its_upper_front_one():
    arm = oven(0.2, (3.0, 3.0, 1.0))
    edge = rack_edge(arm, Furniture(arm, "oven"))
    assert (arm.ahead(edge), edge[2]) == pytest.approx((0.05, 1.01))
