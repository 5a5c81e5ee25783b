from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import mujoco
import numpy as np
import pytest

from pytest_safemanip.expert.robot.kinematics import (
    HIGH,
    HOME,
    LOW,
    bodies,
    follow,
    links,
    solve,
    strain,
)

POSTURES = HOME + np.array(
    ((0.0,) * 7, (0.4, 0.3, 0.0, 0.4, 0.0, 0.2, 0.3), (-0.6, 0.2, 0.3, 0.5, -0.3, 0.4, -0.5))
)


def poses(joints):
    origins, frames = links(joints)
    return origins[:, -1], frames[:, -1]


def test_what_is_solved_brings_the_hand_there():
    points, hands = poses(POSTURES)
    joints, there = solve(points, hands)
    assert there.all()
    reached, turned = poses(joints)
    assert reached == pytest.approx(points, abs=0.004)
    assert turned == pytest.approx(hands, abs=0.03)
    assert ((joints >= LOW) & (joints <= HIGH)).all()


def test_the_null_space_is_at_rest_where_operational_space_control_leaves_it():
    """Where robosuite's torques in the null space vanish, by the mass matrix of its own model."""
    # Not imported, for the plugin patches it first.
    package = Path(find_spec("robosuite").origin).parent
    place = package / "models/assets/robots/panda/robot.xml"
    model = mujoco.MjModel.from_xml_path(str(place))
    data = mujoco.MjData(model)
    jac, mass = np.empty((6, model.nv)), np.empty((model.nv, model.nv))
    joints, _ = solve(*poses(POSTURES), rounds=40)
    for found in joints:
        data.qpos[:7] = found
        mujoco.mj_forward(model, data)
        mujoco.mj_jacBody(model, data, jac[:3], jac[3:], model.body("link7").id)
        mujoco.mj_fullM(model, mass, data.qM)
        free = np.linalg.svd(jac[:, :7])[2][-1]
        drawn = free @ mass[:7, :7] @ (HOME - found) / (free @ mass[:7, :7] @ free)
        assert abs(drawn) < 0.01


def test_what_is_out_of_reach_is_not_reached():
    points, hands = poses(POSTURES[:1])
    _, there = solve(points + np.array((0.8, 0.0, 0.0)), hands)
    assert not there.any()


def test_an_arm_follows_a_way_and_is_reported_where_it_cannot():
    points, hands = poses(POSTURES[:1])
    way = points[:, None] + np.linspace(0.0, 0.1, 5)[None, :, None] * np.array((1.0, 0.0, 0.0))
    along = np.tile(hands[:, None], (1, 5, 1, 1))
    joints, there = follow(POSTURES[:1], way, along)
    assert there.all()
    assert poses(joints[0])[0] == pytest.approx(way[0], abs=0.01)
    assert not follow(POSTURES[:1], way + np.array((0.9, 0.0, 0.0)), along)[1].any()


def test_links_are_within_reach_of_the_shoulder_and_the_hand_ends_the_chain():
    middles, radii = bodies(POSTURES)
    assert middles.shape == (3, len(radii), 3)
    assert np.linalg.norm(middles - (0.0, 0.0, 0.7), axis=2).max() < 1.2


def test_a_joint_at_its_limit_is_strained():
    assert strain(np.stack((LOW, (LOW + HIGH) / 2.0))) == pytest.approx((1.0, 0.0))
