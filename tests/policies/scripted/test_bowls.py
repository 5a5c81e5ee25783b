"""Which thing in a wide bowl fingers have room for, and where along it."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_safemanip.policies.scripted.arm import Arm, SkillFailed
from pytest_safemanip.policies.scripted.bowls import best_reach
from pytest_safemanip.policies.scripted.grasping import PALM
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.trace.elements import Body, Entity
from tests import toy

NONE = (0.0, 0.0, 0.0)
FACING_LEFT = (0.3, 0.0, 1.2, math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
"""The fingers travel sideways, the robot faces forward (x)."""
SAUSAGE, BUN, BOWL = (0.052, 0.015, 0.015), (0.057, 0.022, 0.021), (0.124, 0.124, 0.0325)
FLOOR, BOTTOM = 0.936, 0.92
SLOPING = (math.cos(math.radians(10.0)), 0.0, -math.sin(math.radians(10.0)), 0.0)


def _bowl(sausage, bun, turn=toy.UPRIGHT):
    """An arm before a bowl with a sausage and a bun, both along x, at so much from its middle."""
    bodies = [Body(*each, NONE, NONE, 0.1) for each in (("mug", SAUSAGE), ("apple", BUN))]
    scene = dataclasses.replace(
        toy.SCENE,
        entities=(*toy.SCENE.entities, Entity("bowl", "object", "bowl")),
        bodies=(*bodies, Body("bowl", BOWL, NONE, NONE, 0.3)),
        roles={**toy.SCENE.roles, "sausage": "mug", "bun": "apple", "bowl": "bowl"},
    )
    poses = (
        (0.6 + sausage[0], sausage[1], FLOOR + SAUSAGE[2], *toy.UPRIGHT),
        (0.6 + bun[0], bun[1], FLOOR + BUN[2] + (bun[2] if len(bun) > 2 else 0.0), *turn),
        (0.6, 0.0, BOTTOM + BOWL[2], *toy.UPRIGHT),
    )
    step = toy.at_rest(object_pose=poses, object_twist=np.zeros((3, 6)), eef_pose=FACING_LEFT)
    arm = Arm(scene, step)
    return arm, Thing(arm, "bowl")


def test_with_room_on_both_sides_it_is_pinched_at_its_middle_the_palm_over_the_rim():
    arm, bowl = _bowl((0.0, 0.0), (0.0, 0.08))
    way = best_reach(arm, bowl, ["sausage"])
    np.testing.assert_allclose(way.grasp.point[:2], (0.6, 0.0), atol=1e-6)
    assert abs(way.grasp.hand[1, 0]) == pytest.approx(1.0)
    assert way.grasp.point[2] + PALM > bowl.highest


def test_beside_half_of_another_it_is_pinched_at_its_other_half():
    arm, bowl = _bowl((0.0, 0.0), (0.06, 0.040))
    way = best_reach(arm, bowl, ["sausage"])
    assert way.grasp.point[0] < 0.59
    assert way.room > 0.0


def test_close_to_the_wall_there_is_no_room():
    arm, bowl = _bowl((0.0, 0.095), (0.0, -0.05))
    assert best_reach(arm, bowl, ["sausage"]).room < 0.0
    assert best_reach(arm, bowl, ["sausage", "bun"]).role == "bun"


def test_what_lies_on_another_comes_first():
    arm, bowl = _bowl((0.0, 0.0), (0.03, 0.02, 0.02), SLOPING)
    assert best_reach(arm, bowl, ["sausage", "bun"]).role == "bun"


def test_what_there_is_no_way_to_is_left():
    arm, bowl = _bowl((0.0, 0.0), (0.0, 0.08))
    assert best_reach(arm, bowl, ["sausage", "bun"], {"sausage"}).role == "bun"
    with pytest.raises(SkillFailed, match="no room"):
        best_reach(arm, bowl, ["sausage"], {"sausage"})
