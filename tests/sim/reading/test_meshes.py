"""What the things of a recording look like: the simulator's meshes, simplified."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim import looks
from pytest_safemanip.sim.codec import decode_request
from pytest_safemanip.sim.robocasa.rendering import meshes
from pytest_safemanip.sim.robocasa.rendering.studio import check_scene
from tests import toy


def ball(rings):
    """A unit ball of many triangles."""
    angles = np.linspace(0.0, np.pi, rings)
    return meshes._lathe(np.sin(angles), -np.cos(angles), np.ones(3))


def test_a_simplified_mesh_keeps_its_shape():
    points, triangles = ball(200)
    ((fewer, drawn),) = looks.simplified([(points, triangles)], 800)
    assert 200 < len(drawn) <= 800 < len(triangles)
    assert np.linalg.norm(fewer[np.unique(drawn)], axis=1) == pytest.approx(1.0, abs=0.06)


def test_what_has_few_triangles_is_kept_beside_what_has_many():
    box = np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0)]), np.array([(0, 1, 2)])
    kept, many = looks.simplified([box, ball(200)], 800)
    assert (kept[0] == box[0]).all()
    assert len(kept[1]) + len(many[1]) <= 800


def test_there_is_a_limit_whatever_there_is():
    triangle = np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0)]), np.array([(0, 1, 2)])
    found = looks.simplified([triangle] * 30, 20)
    assert sum(len(triangles) for _, triangles in found) == 20


def test_meshes_are_where_the_recording_has_its_objects(rollouts):
    recording = rollouts.get("PickPlaceCounterToCabinet", "scripted:half_inside").recording
    request = decode_request(recording.episode.request)
    found = meshes.read_looks(request, recording, "primitive")
    assert {look.entity for look in found} <= recording.scene.entity.keys()
    assert 5_000 < sum(len(look.triangles) for look in found) <= meshes.MOST_TRIANGLES
    for index, body in enumerate(recording.scene.bodies):
        (own,) = [look for look in found if look.entity == body.entity]
        true = recording.steps.object_pose[:, index]
        assert np.allclose(own.poses[:, :3], true[:, :3], atol=1e-4)
        assert (np.abs(own.points - body.centre) <= np.array(body.half) + 1e-3).all()
    robot = [look for look in found if look.entity == "robot"]
    hand = recording.steps.eef_poses[:, 0, :3]
    nearest = min(np.linalg.norm(look.poses[:, :3] - hand, axis=1).max() for look in robot)
    assert nearest < 0.12


def test_another_scene_is_refused():
    other = dataclasses.replace(toy.SCENE, bodies=toy.SCENE.bodies[1:])
    with pytest.raises(ConfigError, match="begins with other objects now"):
        check_scene(other, toy.SCENE)
