from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.torso import STEPS, THERE, lift_torso
from tests import toy

TOP_SPEED = 0.4
"""Of the torso, m/s."""


def lifted(arm, by, stop=np.inf):
    """The commands to a torso that moves as it is told, up to a stop, m above where it is."""
    start, commands = arm.position[2], []
    for action in lift_torso(arm, by):
        commands.append(action[10])
        rise = arm.position[2] - start + TOP_SPEED * toy.DT * action[10]
        pose = arm.step.eef_pose.copy()
        pose[2] = start + min(rise, stop)
        arm.step = dataclasses.replace(arm.step, eef_poses=pose[None])
    return commands


@pytest.mark.parametrize("by", [0.23, -0.12])
def test_the_hand_rises_and_sinks_with_the_torso(by):
    arm = Arm(toy.SCENE, toy.at_rest())
    start = arm.position[2]
    commands = lifted(arm, by)
    assert arm.position[2] - start == pytest.approx(by, abs=THERE)
    assert np.sign(commands[0]) == np.sign(by)
    assert commands[-1] == 0.0


def test_at_its_stop_the_torso_is_not_told_on_and_on():
    arm = Arm(toy.SCENE, toy.at_rest())
    commands = lifted(arm, 0.5, stop=0.34)
    assert np.count_nonzero(commands) == STEPS


def test_where_the_torso_stays_nothing_is_done():
    assert lifted(Arm(toy.SCENE, toy.at_rest()), 0.0) == []
