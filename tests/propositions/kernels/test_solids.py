"""Corners of what is solid: counter (top at 0.9), mug (10 cm) at x = 0, apple (8 cm) at x = 0.4."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.propositions.kernels.solids import (
    SurfaceCache,
    body_boxes,
    body_corners,
    max_travel,
    solids,
)
from pytest_safemanip.trace.elements import Surface
from tests import toy
from tests.propositions.stage import along, arrays, film, look, moved, turned

MUG, APPLE = 0, 1
ANYWHERE = (np.zeros(3), 100.0)
DOOR_POSE = (0.0, 0.4, 1.5, *toy.UPRIGHT)
DOOR = Surface("cabinet", "cabinet/hinge", (0.3, 0.01, 0.3), DOOR_POSE)
SHELF = Surface("cabinet", "", (0.3, 0.2, 0.01), (0.0, 0.6, 1.19, *toy.UPRIGHT))


def kitchen(*more, **joint):
    """The counter and more surfaces; the cabinet's joint may be another one."""
    return dataclasses.replace(
        toy.SCENE,
        surfaces=(*toy.SCENE.surfaces, *more),
        joints=(dataclasses.replace(toy.SCENE.joints[0], **joint),),
    )


SLIDE = {"kind": "slide", "axis": (0.0, -1.0, 0.0), "travel": 0.4}


def extent(corners):
    """Least and largest coordinates."""
    return np.concatenate((corners.min(axis=-2), corners.max(axis=-2)), axis=-1)


def test_corners_of_a_box_whose_centre_is_not_the_objects_origin():
    # 2, 4 and 6 cm, centred 1 cm ahead of the origin; turned by 90 degrees about z, x is y and y
    # is -x: 4 cm along x, 2 cm along y from the origin to 2 cm ahead of it.
    body = dataclasses.replace(
        toy.SCENE.bodies[MUG], half=(0.01, 0.02, 0.03), centre=(0.01, 0.0, 0.0)
    )
    scene = dataclasses.replace(toy.SCENE, bodies=(body, toy.SCENE.bodies[APPLE]))
    poses = arrays(1).object_pose.copy()
    poses[:, MUG, 3:] = turned(np.pi / 2, (0, 0, 1))
    view = look(film(1, scene=scene, object_pose=poses))
    wanted = (-0.02, 0.0, 0.92, 0.02, 0.02, 0.98)
    assert extent(body_corners(view, 0, MUG)) == pytest.approx(wanted, abs=1e-6)
    half, centre = body_boxes(view)
    assert half.tolist() == [[0.01, 0.02, 0.03], [0.04, 0.04, 0.04]]
    assert centre.tolist() == [[0.01, 0.0, 0.0], [0.0, 0.0, 0.0]]


def test_corners_at_several_steps_are_those_of_each():
    view = look(film(2, object_pose=moved("mug", [(0.0, 0.0, 0.95), (1.0, 0.0, 0.95)])))
    found = body_corners(view, np.array([0, 1]), MUG)
    assert extent(found)[:, 0] == pytest.approx((-0.05, 0.95))


def test_everything_but_the_object_itself_is_solid():
    found = solids(look(film(1)), "mug", 0, ANYWHERE)
    assert (found.owners, found.numbers) == (["counter", "apple"], [0, -2])
    counter, apple = extent(found.boxes)
    assert counter == pytest.approx((-1.0, -0.5, 0.0, 1.0, 0.5, 0.9))
    assert apple == pytest.approx((0.36, -0.04, 0.9, 0.44, 0.04, 0.98))


def test_only_some_entities_are_kept():
    view = look(film(1, scene=kitchen(SHELF)))
    assert solids(view, "apple", 0, ANYWHERE, only={"cabinet", "mug"}).owners == ["cabinet", "mug"]
    assert solids(view, "apple", 0, ANYWHERE, only=()).owners == []


@pytest.mark.parametrize(
    ("aside", "kept"),
    [
        # The shelf's corners are 36.07 cm from its middle, which is 60 cm from the place: they come
        # within 24 cm of it.
        (0.23, False),
        (0.24, True),
    ],
)
def test_what_is_too_far_to_the_side_is_left_out(aside, kept):
    owners = solids(look(film(1, scene=kitchen(SHELF))), "mug", 0, (np.zeros(3), aside)).owners
    assert ("cabinet" in owners) == kept


@pytest.mark.parametrize(
    ("joint", "openness", "place"),
    [
        # 40 cm along -y for all of its range; it may come twice as far.
        (SLIDE, 2.0, (0.0, -0.4, 1.5)),
        # Half a turn about the edge at x = -0.3 takes what is 30 cm to its right to its left.
        ({"travel": np.pi}, 1.0, (-0.6, 0.4, 1.5)),
    ],
)
def test_what_moves_and_comes_near_is_not_left_out(joint, openness, place):
    knob = dataclasses.replace(DOOR, half=(0.01, 0.01, 0.01))
    joints = np.full((1, 1, 2), openness, np.float32)
    view = look(film(1, scene=kitchen(knob, **joint), joint=joints))
    found = solids(view, "mug", 0, (np.array(place), 0.0), only={"cabinet"})
    assert extent(found.boxes)[0, :3] == pytest.approx(np.array(place) - 0.01, abs=1e-6)


@pytest.mark.parametrize(
    ("joint", "openness", "wanted"),
    [
        # Closed: 60 cm wide, 2 cm thick, at y = 0.4.
        (SLIDE, 0.0, (-0.3, 0.39, 1.2, 0.3, 0.41, 1.8)),
        # Half of its 40 cm out, towards -y.
        (SLIDE, 0.5, (-0.3, 0.19, 1.2, 0.3, 0.21, 1.8)),
        # About the upright edge at x = -0.3, by 90 degrees against the clock: it stands along y,
        # 1 cm to either side of x = -0.3, from the hinge 60 cm to the back.
        ({"travel": np.pi / 2}, 1.0, (-0.31, 0.4, 1.2, -0.29, 1.0, 1.8)),
        ({"travel": np.pi / 2, "axis": (0.0, 0.0, -1.0)}, 1.0, (-0.31, -0.2, 1.2, -0.29, 0.4, 1.8)),
        ({"travel": np.pi}, 0.5, (-0.31, 0.4, 1.2, -0.29, 1.0, 1.8)),
    ],
)
def test_a_moving_part_is_where_its_joint_carries_it(joint, openness, wanted):
    rates = np.full((1, 1, 2), (openness, 7.0), np.float32)
    view = look(film(1, scene=kitchen(DOOR, **joint), joint=rates))
    found = solids(view, "mug", 0, ANYWHERE, only={"cabinet"})
    assert found.numbers == [1]
    assert extent(found.boxes)[0] == pytest.approx(wanted, abs=1e-6)


def test_where_it_was_looked_at_before_does_not_matter():
    openness = along(arrays(5).joint, range(5), (0, 0), (0.0, 1.0, 0.5, 0.5, 0.0))
    view = look(film(5, scene=kitchen(DOOR, SHELF, **SLIDE), joint=openness))
    cache, some = view.cache(SurfaceCache), np.array([1, 2])
    lowest = [extent(cache.boxes(view, step, some))[:, 1] for step in (0, 1, 2, 3, 4, 1)]
    wanted = [(0.39 - 0.4 * x, 0.4) for x in (0.0, 1.0, 0.5, 0.5, 0.0, 1.0)]
    assert np.array(lowest) == pytest.approx(np.array(wanted), abs=1e-6)


@pytest.mark.parametrize(
    ("joint", "wanted"),
    [
        (SLIDE, (0, 0.4)),
        # The corner farthest from a hinge 30 cm away from the middle: 0.3 + |(0.3, 0.01, 0.3)| =
        # 0.3 + 0.42438 m at most, at 1.5 rad.
        ({"travel": 1.5}, (0, 1.5 * 0.7243818)),
    ],
)
def test_how_far_a_surface_moves_while_its_joint_opens(joint, wanted):
    view = look(film(1, scene=kitchen(DOOR, **joint)))
    assert max_travel(view, 0) == (-1, 0.0)
    assert max_travel(view, 1) == pytest.approx(wanted)
