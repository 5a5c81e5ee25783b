from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.expert.motions.attitudes import TURNS, tipped
from pytest_safemanip.expert.motions.placing import JUTS, OUT, Placing, Spot, held
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.rotations import about_y, about_z
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.policies.base import Permissions
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


@pytest.mark.parametrize(("supports", "strange"), [(("counter",), False), (("cab",), True)])
def test_what_may_not_rest_on_a_counter_does_not_reach_over_it(supports, strange):
    arm = Arm(toy.SCENE, toy.at_rest())
    arm.permissions = Permissions({}, {"obj": supports})
    thing = Thing(arm, "obj")
    spot = Spot(np.append(thing.middle[:2], thing.bottom))
    placing = Placing(arm, thing, [spot])
    (poses,) = placing.poses(held(arm))
    costs = [pose.cost for pose in poses]
    assert (min(costs) >= JUTS) == strange


@pytest.mark.parametrize(
    ("short", "shuts", "offered"),
    [(0.9 * OUT, True, True), (1.1 * OUT, True, False), (1.1 * OUT, False, True)],
)
def test_what_is_put_in_what_shuts_is_in_as_a_whole(short, shuts, offered):
    arm = Arm(toy.SCENE, toy.at_rest())
    thing = Thing(arm, "obj")
    point = np.append(thing.middle[:2], thing.bottom)
    half = np.array((thing.half[0] - short, 0.3, 0.3))
    space = np.array((*point[:2], point[2] + 0.3, *toy.UPRIGHT)), half
    placing = Placing(arm, thing, [Spot(point, space=space, shuts=shuts)])
    (poses,) = placing.poses(held(arm))
    straight = [pose for pose in poses if pose.family[0] == 0]
    assert bool(straight) == offered
