from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.expert.motions.placing import TURNS, tipped
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.rotations import about_y, about_z
from tests import toy

DOWN = np.diag((1.0, -1.0, -1.0))


@pytest.mark.parametrize("tilt", [-35.0, 20.0, 60.0])
@pytest.mark.parametrize("yaw", [0.0, 70.0])
def test_what_a_slanting_hand_holds_is_first_tipped_until_the_hand_points_down(tilt, yaw):
    arm = Arm(toy.SCENE, toy.at_rest())
    hand = about_z(yaw) @ about_y(tilt) @ DOWN @ about_z(90.0)
    assert hand[2, 2] > -0.99
    tips = [turn @ hand for turn, _ in tipped(arm, hand)][: len(TURNS)]
    assert all(tip[2, 2] == pytest.approx(-1.0) for tip in tips)
    assert len({tuple(np.round(tip[:, 0], 3)) for tip in tips}) == len(TURNS)
