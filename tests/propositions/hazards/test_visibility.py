from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import TraceError
from pytest_safemanip.trace.elements import Camera
from tests.propositions.hazards.kitchen import EYE, SCENE, kitchen, see
from tests.propositions.stage import true_at

# The camera is two metres in front of the mug, at 1.4 m, and sees 69 degrees of height.


def occluded(name="mug", **changed):
    return see(kitchen(1, **changed))("occluded_from_cameras", name).all()


def test_what_stands_in_the_open_is_seen():
    assert not occluded()
    view = see(kitchen(1))
    assert view.margin("occluded_from_cameras", "mug")[0] == pytest.approx(-3.0)
    assert view.evidence("occluded_from_cameras", ("mug",), 0) == [
        "of mug 100% is seen by a camera"
    ]


@pytest.mark.parametrize(
    ("place", "hidden"),
    [
        ((0.0, -0.3, 0.95), True),  # right in front of it, and larger
        ((0.0, 0.3, 0.95), False),  # behind it
        ((0.3, -0.3, 0.95), False),
    ],
)
def test_what_something_larger_stands_before_is_hidden(place, hidden):
    bodies = [
        dataclasses.replace(body, half=(0.2, 0.02, 0.3)) if body.entity == "pan" else body
        for body in SCENE.bodies
    ]
    scene = dataclasses.replace(SCENE, bodies=tuple(bodies))
    assert occluded(places={"pan": place}, scene=scene) == hidden


def test_what_a_small_thing_stands_before_is_seen_in_part():
    view = see(kitchen(1, places={"apple": (0.0, -0.2, 0.94)}))
    share = 1.0 - (view.margin("occluded_from_cameras", "mug")[0] + 3.0) / 4.0
    assert 0.0 < share < 1.0


@pytest.mark.parametrize(
    ("openness", "hidden"), [(0.0, True), (1.0, False)], ids=["closed", "open"]
)
def test_what_is_behind_a_door_is_hidden_while_that_is_closed(openness, hidden):
    joint = np.zeros((1, 1, 2), np.float32)
    joint[0, 0, 0] = -openness  # away from the camera
    assert occluded(places={"mug": (0.1, 0.6, 1.5)}, joint=joint) == hidden


def test_what_lies_in_a_vessel_is_seen_from_above():
    place = {"apple": (-0.6, -0.1, 0.93)}
    above = (-0.6, -0.1, 2.5, 1.0, 0.0, 0.0, 0.0)
    eye = np.tile(np.float32(above), (1, 1, 1))
    assert not occluded("apple", places=place, camera_pose=eye)


@pytest.mark.parametrize(
    ("place", "hidden"),
    [((2.1, 0.0, 1.4), True), ((1.6, 0.0, 1.4), False), ((0.0, -2.5, 1.4), True)],
)
def test_what_is_outside_of_the_picture_is_hidden(place, hidden):
    # 1.37 m to either side of the middle times 1.5, two metres ahead.
    assert occluded(places={"mug": place}) == hidden


def test_one_camera_that_sees_it_is_enough():
    scene = dataclasses.replace(SCENE, cameras=(*SCENE.cameras, Camera("back", 1.2, 1.0)))
    away = (5.0, 5.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    both = np.array([[away, EYE], [away, away]], np.float32)
    view = see(kitchen(2, scene=scene, camera_pose=both))
    assert true_at(view("occluded_from_cameras", "mug")) == [1]


def test_without_a_camera_nobody_knows_what_is_seen():
    scene = dataclasses.replace(SCENE, cameras=())
    recording = kitchen(1, scene=scene, camera_pose=np.zeros((1, 0, 7), np.float32))
    with pytest.raises(TraceError, match=r"occluded_from_cameras\(mug\) .* has no camera"):
        see(recording)("occluded_from_cameras", "mug")
