from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.expert.motions.approaching import hand_passes, links_pass
from pytest_safemanip.expert.motions.poses import Pose, Reach
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.sim.clearance import Clearance, Touch
from tests import toy


class Foretold:
    """Answers that fingers would meet an entity, unless that is permitted, and what was asked."""

    def __init__(self, other):
        self.other, self.asked = other, []

    def __call__(self, paths):
        self.asked += paths
        meets = ("finger", self.other) not in paths[0].permits
        touch = Touch("finger_left", self.other, "body", (0.5, 0.0, 1.0), 0.02) if meets else None
        return [Clearance(2, touch, 0.0, 0.0, 0.04, np.zeros(7), np.zeros(7))]


def reach_of(arm):
    up, level = np.array((0.0, 0.0, 0.1)), np.zeros(2)
    pose = Pose(arm.position - up, arm.rotation, 0.7, 0.0, np.zeros((1, 3)))
    return Reach(pose, up, up, level, level, 0.0, arm.base, arm.torso, 0.04)


@pytest.mark.parametrize(("other", "passes"), [("mug", False), ("apple", True)])
def test_a_hand_goes_into_a_vessel_if_it_meets_nothing_of_that(other, passes):
    foretold = Foretold(other)
    arm = Arm(toy.SCENE, toy.at_rest(), "", foretold)
    assert hand_passes(arm, reach_of(arm), ["mug"]) is passes
    (path,) = foretold.asked
    assert (path.opening, path.begins, path.since) == (0.7, 2, 2)


def test_where_it_goes_into_no_vessel_nobody_is_asked():
    foretold = Foretold("mug")
    arm = Arm(toy.SCENE, toy.at_rest(), "", foretold)
    assert hand_passes(arm, reach_of(arm), [])
    assert not foretold.asked


def test_where_links_have_room_the_simulator_is_not_asked():
    foretold = Foretold("cab")
    arm = Arm(toy.SCENE, toy.at_rest(), "", foretold)
    assert links_pass(arm, reach_of(arm))
    assert not foretold.asked
