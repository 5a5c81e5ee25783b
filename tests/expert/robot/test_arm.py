from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.base import BASE_DEAD_BAND, CAREFUL, SWING
from tests import toy


@pytest.mark.parametrize(("speed", "sudden"), [(CAREFUL, False), (0.7, True)])
def test_the_base_starts_gently_at_a_careful_speed(speed, sudden):
    arm = Arm(toy.SCENE, toy.at_rest())
    count = round(SWING / toy.SCENE.control_period)
    motion = arm.drive(arm.base + arm.forward, speed=speed)
    commands = [action[7] for action in itertools.islice(motion, count + 1)]
    assert commands[-1] == pytest.approx(speed)
    if sudden:
        assert commands[0] == pytest.approx(speed)
    else:
        assert commands == sorted(commands)
        assert BASE_DEAD_BAND < commands[0] < commands[count // 2] < speed


def test_the_base_turns_more_slowly_near_its_goal_and_the_hand_turns_with_it():
    arm = Arm(toy.SCENE, toy.at_rest())
    ahead, hand, pose = arm.forward, arm.hand(), arm.step.base_pose[:3]
    commands, left = [], 90.0
    for action in arm.turn(90.0):
        commands.append(action[9])
        left = max(0.0, left - 3.0 * action[9])
        half = np.radians(90.0 - left) / 2.0
        turned = (*pose, np.cos(half), 0.0, 0.0, np.sin(half))
        arm.step = dataclasses.replace(arm.step, base_pose=np.array(turned))
    assert commands == sorted(commands, reverse=True)
    assert arm.forward @ ahead == pytest.approx(0.0, abs=0.02)
    assert np.cross(ahead, arm.forward) == pytest.approx(1.0, abs=0.02)
    assert arm.hand()[:, 0] @ hand[:, 0] == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize(("opening", "notches"), [(0.38, -6), (0.6, -4), (1.0, 0)])
def test_the_fingers_open_to_exact_notches(opening, notches):
    arm = Arm(toy.SCENE, toy.at_rest())
    told = []
    for action in arm.open_to(opening):
        told.append(-int(action[6]))
        openings = (((arm.notch + told[-1]) / 10.0, 0.0),)
        arm.see(toy.at_rest(commands=(action[6],), gripper=openings[0]))
    assert sum(told) == notches
    assert arm.notch == 10 + notches
