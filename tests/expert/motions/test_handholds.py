from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_safemanip.expert.motions.handholds import PAN_WALLS, body, grasp_poses, handholds
from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.robot.hand import GAP, PALM
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import Body
from tests import toy

STICK, TIN = (0.08, 0.015, 0.02), (0.03, 0.03, 0.05)
WIDE, PAN, PLATE = (0.1, 0.1, 0.04), (0.1, 0.16, 0.03), (0.1, 0.1, 0.01)


def thing(half, aside=0.0):
    """A thing on the counter, its box so far aside of its frame: it has a handle there."""
    own = Body("mug", half, (0.0, aside, 0.0), (0.0, 0.0, 0.0), 0.3)
    scene = dataclasses.replace(toy.SCENE, bodies=(own, toy.SCENE.bodies[1]))
    poses = (0.0, 0.0, 0.9 + half[2], *toy.UPRIGHT), (3.0, 0.0, 0.94, *toy.UPRIGHT)
    arm = Arm(scene, toy.at_rest(object_pose=poses))
    return arm, Thing(arm, "obj")


@pytest.mark.parametrize(
    ("half", "aside", "name"),
    [(STICK, 0.0, "body"), (TIN, 0.0, "body"), (PAN, 0.06, "handle")],
)
def test_the_hand_takes_what_fits_between_its_fingers(half, aside, name):
    (hold,) = handholds(thing(half, aside)[1])
    assert hold.name == name
    assert 2.0 * np.linalg.norm(hold.axes[:, 0]) < GAP


def test_a_handle_is_pinched_askew_too_with_the_fingers_open_wider():
    arm, own = thing(PAN, 0.06)
    poses = list(grasp_poses(arm, own, handholds(own)[0], own.bottom))
    angles = [abs(math.degrees(math.atan2(p.hand[1, 0], p.hand[0, 0]))) for p in poses]
    askew = np.array([round(min(angle, 180.0 - angle)) for angle in angles])
    assert set(askew) == {0, 20}
    opening = np.array([pose.opening for pose in poses])
    assert opening[askew == 20].min() > opening[askew == 0].min()


def test_what_is_too_wide_low_and_has_no_handle_is_refused():
    with pytest.raises(SkillFailed, match="mug is too wide for the gripper"):
        handholds(thing(PLATE)[1])


def test_a_wide_vessel_without_a_handle_is_taken_by_its_rim_one_finger_inside():
    arm, own = thing(WIDE)
    holds = handholds(own)
    assert len(holds) == 4
    for hold in holds:
        found = list(grasp_poses(arm, own, hold, own.bottom))
        assert found
        for pose in found:
            reach = np.abs((pose.point - own.centre)[:2]).max()
            assert reach == pytest.approx(0.1, abs=0.04)
            assert abs(pose.hand[:2, 0] @ (pose.point - own.centre)[:2]) > 0.5 * reach


@pytest.mark.parametrize("part", PAN_WALLS)
def test_a_pan_is_drawn_by_its_wall_beside_the_handle_one_finger_inside(part):
    arm, own = thing((0.1, 0.16, 0.03), 0.06)
    (hold,) = handholds(own, part)
    middle, radius = own.middle[:2], own.sides()[0][1] / 2.0
    out = (hold.middle[:2] - middle) / radius
    assert np.linalg.norm(out) == pytest.approx(1.0, abs=0.1)
    assert out @ (own.centre[:2] - middle) < 0.75 * 0.06
    found = list(grasp_poses(arm, own, hold, own.bottom))
    assert found
    for pose in found:
        off = (pose.point[:2] - middle) @ out
        assert off == pytest.approx(radius, abs=0.042)
        assert pose.point[2] < own.highest + 0.01


def test_what_has_no_such_part_is_refused():
    with pytest.raises(SkillFailed, match="mug has no handle"):
        handholds(thing(WIDE)[1], next(iter(PAN_WALLS)))
    with pytest.raises(SkillFailed, match="mug has no handle"):
        handholds(thing(WIDE)[1], "handle")


def test_a_part_can_be_of_ones_own_finding():
    found = handholds(thing(STICK)[1], lambda own: dataclasses.replace(body(own), places=(0.05,)))
    assert [hold.places for hold in found] == [(0.05,)]


@pytest.mark.parametrize(("half", "turned"), [(STICK, False), (TIN, True)])
def test_only_what_is_round_is_taken_from_all_around(half, turned):
    arm, own = thing(half)
    (hold,) = handholds(own)
    lines = {
        tuple(np.round(pose.hand[:, 0], 3)) for pose in grasp_poses(arm, own, hold, own.bottom)
    }
    assert hold.around == turned
    assert (len(lines) > 6) == turned


@pytest.mark.parametrize("half", [STICK, TIN])
def test_fingers_reach_beside_it_and_the_palm_stays_off(half):
    arm, own = thing(half)
    (hold,) = handholds(own)
    found = list(grasp_poses(arm, own, hold, own.bottom))
    assert found
    for pose in found:
        seen = (own.centre - pose.point) @ pose.hand
        assert np.linalg.norm(seen) < math.hypot(*half)
        near = (pose.load - pose.point) @ pose.hand
        under = (np.abs(near[:, 0]) < 0.1) & (np.abs(near[:, 1]) < 0.03)
        assert near[under, 2].min() > -PALM


def test_a_hand_comes_steeply_down_on_a_lug_beside_a_round_wall():
    arm, own = thing((0.12, 0.16, 0.045))
    (hold,) = handholds(own, "lug")
    found = list(grasp_poses(arm, own, hold, own.bottom))
    assert min(pose.hand[2, 2] for pose in found) < -0.8
    beyond = found[0].load[np.abs(found[0].load[:, 1]) > 0.125]
    assert np.abs(beyond[:, 0]).max() < 0.02


def test_the_underside_of_a_vessel_as_high_as_wide_is_flat_and_that_of_a_ball_is_not():
    for half, flat in ((0.08, True), (0.03, False)):
        points = body(thing((half,) * 3)[1]).rounded()
        low = points[points[:, 2] < points[:, 2].min() + 0.005]
        reach = np.hypot(*(low - low.mean(axis=0))[:, :2].T).max()
        assert (reach > 0.95 * half) == flat
        assert (reach < half / 2.0) != flat
