from __future__ import annotations

import math

import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.standing import LOAD_ROOM, before_others
from pytest_safemanip.expert.world.things import Thing
from tests import toy

HELD = (0.5, -1.0, 1.0, *toy.UPRIGHT)
"""Its far side is 55 cm ahead of the base, its underside 95 cm up."""


@pytest.mark.parametrize(
    ("other", "limit"),
    [
        ((0.4, -0.7, 0.94), 0.36 - LOAD_ROOM - 0.55),
        ((0.4, -0.2, 0.94), math.inf),
        ((0.4, -0.7, 0.88), math.inf),
        ((-0.4, -0.7, 0.94), math.inf),
    ],
    ids=["on the way", "beyond it", "below", "behind the base"],
)
def test_a_load_passes_before_what_stands_on_its_way(other, limit):
    arm = Arm(toy.SCENE, toy.at_rest(object_pose=(HELD, (*other, *toy.UPRIGHT))))
    assert before_others(arm, Thing(arm, "mug"), -0.5) == pytest.approx(limit, abs=1e-6)
