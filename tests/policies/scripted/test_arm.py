from __future__ import annotations

import itertools

import pytest

from pytest_safemanip.policies.scripted.arm import BASE_DEAD_BAND, CAREFUL, SWING, Arm
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
