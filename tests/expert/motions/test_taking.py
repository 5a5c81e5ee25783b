from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_safemanip.expert.motions.holds import Hold
from pytest_safemanip.expert.motions.taking import turns_along
from pytest_safemanip.expert.robot.arm import Arm
from tests import toy

(DOOR,) = toy.SCENE.joints
ARM = Arm(toy.SCENE, toy.at_rest())
POINT, HAND = np.asarray(ARM.position), np.asarray(ARM.rotation)
KNOB = dataclasses.replace(
    DOOR, axis=tuple(HAND[:, 2]), anchor=tuple(POINT), travel=math.tau, gives_access=False
)
HELD = Hold(POINT, HAND, 0.5, 0.0, POINT, np.zeros(3))


@pytest.mark.parametrize("by", [0.0, 0.1, -0.1])
def test_a_wrist_turns_a_little_either_way(by):
    assert turns_along(ARM, HELD, KNOB, by)


@pytest.mark.parametrize("by", [0.95, -0.95])
def test_no_wrist_turns_almost_all_the_way_round_from_its_middle(by):
    assert not turns_along(ARM, HELD, KNOB, by)
