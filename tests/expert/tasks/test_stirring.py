from __future__ import annotations

import dataclasses
import math

import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.hand import Grasp
from pytest_safemanip.expert.tasks.stirring import end, inside
from pytest_safemanip.expert.world.hand_room import beside_things
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import Body
from tests import toy

MIDDLE = (0.5, 0.0, 1.0)


def arm_with(mug, apple, half=(0.02, 0.02, 0.02), com=(0.0, 0.0, 0.0)):
    """Two things at these places, the first one with this box and centre of mass."""
    bodies = (
        Body("mug", half, (0.0, 0.0, 0.0), com, 0.1),
        Body("apple", (0.02, 0.02, 0.02), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.1),
    )
    poses = ((*mug, *toy.UPRIGHT), (*apple, *toy.UPRIGHT))
    return Arm(dataclasses.replace(toy.SCENE, bodies=bodies), toy.at_rest(object_pose=poses))


@pytest.mark.parametrize(("roll", "free"), [(0.0, False), (90.0, True)])
def test_fingers_are_turned_away_from_what_stands_beside(roll, free):
    across = arm_with(MIDDLE, MIDDLE).hand()[:, 0]
    arm = arm_with(MIDDLE, tuple(MIDDLE + 0.055 * across))
    grasp = Grasp(Thing(arm, "mug").centre, arm.hand(0.0, roll), 0.9)
    assert (beside_things(arm, Thing(arm, "mug"), grasp) > 0.0) == free


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_end_of_a_tool_is_where_its_weight_is(side):
    arm = arm_with(MIDDLE, (3.0, 3.0, 1.0), (0.125, 0.035, 0.016), (0.03 * side, 0.0, 0.0))
    assert end(Thing(arm, "mug")) == pytest.approx((0.5 + 0.125 * side, 0.0, 1.0))


@pytest.mark.parametrize(("off", "found"), [(0.05, 1), (0.12, 0)])
def test_what_is_in_a_pot_has_its_middle_over_it(off, found):
    arm = arm_with(
        MIDDLE, (0.5 + off * math.sqrt(0.5), off * math.sqrt(0.5), 1.0), (0.1, 0.1, 0.03)
    )
    pot = Thing(arm, "mug")
    assert len(inside(arm, pot, pot)) == found
