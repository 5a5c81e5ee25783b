"""Where objects are relative to interiors and boxes.

The shelf is 60 x 40 x 60 cm around (0, 0.6, 1.5); mug and apple are cubes of 10 and 8 cm.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import TraceError
from pytest_safemanip.propositions.kernels.interiors import (
    all_within,
    centre_within,
    centres,
    corners_inside,
    entered,
    holding_halves,
    inside,
    interiors,
    lies_in,
    near,
    place_in,
    seen_from,
)
from pytest_safemanip.trace.elements import Box
from tests import toy
from tests.propositions.stage import arrays, film, look, moved, turned

MUG = 0
SHELF = np.array((0.0, 0.6, 1.5))
HALF = np.array((0.3, 0.2, 0.3))
MILLIMETRE = 0.001


def at(*places, scene=toy.SCENE, turn=None, box_turn=None):
    """The mug at some places, one a step."""
    poses = moved("mug", np.array(places, float))
    boxes = arrays(len(places)).box_pose.copy()
    if turn is not None:
        poses[:, MUG, 3:] = turn
    if box_turn is not None:
        boxes[:, 0, 3:] = box_turn
    return look(film(len(places), scene=scene, object_pose=poses, box_pose=boxes))


def test_interiors_are_those_of_the_fixture():
    ((pose, half),) = interiors(at(SHELF, SHELF), "cabinet")
    assert pose.tolist() == [pytest.approx([*SHELF, *toy.UPRIGHT])] * 2
    assert half.tolist() == [0.3, 0.2, 0.3]
    with pytest.raises(TraceError, match="'counter' has no interior"):
        interiors(at(SHELF), "counter")


def test_a_handle_is_no_interior():
    boxes = (Box("cabinet", "bar", "handle", (0.1, 0.1, 0.1)), *toy.SCENE.boxes)
    poses = np.tile(arrays(1).box_pose, (1, 2, 1))
    poses[:, 0, 0] = 7.0
    view = look(film(1, scene=dataclasses.replace(toy.SCENE, boxes=boxes), box_pose=poses))
    ((pose, half),) = interiors(view, "cabinet")
    assert (pose[0, 0], half[0]) == (0.0, 0.3)


def test_an_object_holds_things_in_its_own_box():
    view = at(SHELF)
    assert [half.tolist() for half in holding_halves(view, "apple")] == [[0.04, 0.04, 0.04]]
    assert [half.tolist() for half in holding_halves(view, "cabinet")] == [[0.3, 0.2, 0.3]]


def test_places_are_seen_along_the_axes_of_what_holds_them():
    # Turned by 90 degrees about z, what is 10 cm along the world's y is 10 cm along its own x.
    place = np.add(SHELF, (0.0, 0.1, 0.02))
    view = at(place, box_turn=turned(np.pi / 2, (0, 0, 1)))
    assert place_in(view, "mug", "cabinet", 0)[0] == pytest.approx((0.1, 0.0, 0.02), abs=1e-6)
    assert place_in(at(place), "mug", "cabinet", 0)[0] == pytest.approx((0, 0.1, 0.02), abs=1e-6)


def test_places_are_those_of_box_centres_seen_from_a_box_centre():
    # Boxes 1 cm above their objects' origins; the apple is 40 cm beside the mug and 1 cm lower.
    mug, apple = (
        dataclasses.replace(body, centre=centre)
        for body, centre in zip(toy.SCENE.bodies, ((0.0, 0.0, 0.01), (0.0, 0.02, 0.0)), strict=True)
    )
    scene = dataclasses.replace(toy.SCENE, bodies=(mug, apple))
    view = at((0.0, 0.0, 0.95), scene=scene)
    wanted = np.array([(0.0, 0.0, 0.96), (0.4, 0.02, 0.94)])
    assert centres(view)[0] == pytest.approx(wanted, abs=1e-6)
    assert seen_from(view, "mug", 0)[0, 1] == pytest.approx((0.4, 0.02, -0.02), abs=1e-6)
    assert seen_from(view, "apple", 0)[0, 0] == pytest.approx((-0.4, -0.02, 0.02), abs=1e-6)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("beyond", "within"), [(-MILLIMETRE, True), (MILLIMETRE, False)])
def test_within_is_as_far_as_the_walls(axis, sign, beyond, within):
    place = SHELF.copy()
    place[axis] += sign * (HALF[axis] + beyond)
    view = at(place)
    assert all_within(view, "cabinet").tolist() == [[within, False]]
    assert centre_within(view, "mug", "cabinet").tolist() == [within]
    assert inside(view, "cabinet", 0) == ["mug"] * within


def test_exactly_on_a_wall_is_within():
    # Numbers that are exact in binary.
    box = dataclasses.replace(toy.SCENE.boxes[0], half=(0.25, 0.25, 0.25))
    poses = arrays(2).box_pose.copy()
    poses[:, 0, :3] = 0.0, 0.5, 1.5
    places = moved("mug", [(0.25, 0.25, 1.75), (0.2501, 0.5, 1.5)])
    scene = dataclasses.replace(toy.SCENE, boxes=(box,))
    view = look(film(2, scene=scene, box_pose=poses, object_pose=places))
    assert centre_within(view, "mug", "cabinet").tolist() == [True, False]


TWO = dataclasses.replace(
    toy.SCENE, boxes=(*toy.SCENE.boxes, Box("cabinet", "top", "interior", (0.3, 0.2, 0.1)))
)
"""A second shelf above the first, which ends at 1.8: from 1.82 to 2.02."""


def with_two(*places):
    boxes = np.tile(arrays(len(places)).box_pose, (1, 2, 1))
    boxes[:, 1, 2] = 1.92
    return look(
        film(len(places), scene=TWO, box_pose=boxes, object_pose=moved("mug", np.array(places)))
    )


def test_any_interior_of_a_fixture_counts():
    view = with_two(SHELF, (0.0, 0.6, 1.92), (0.0, 0.6, 1.81))
    assert centre_within(view, "mug", "cabinet").tolist() == [True, True, False]


@pytest.mark.parametrize(
    ("depth", "into", "found"),
    [
        # The nearest face of the mug is 5 cm before its centre; the shelf's front is at y = 0.4.
        (0.0, MILLIMETRE, True),
        (0.0, -MILLIMETRE, False),
        (0.005, 0.006, True),
        (0.005, 0.004, False),
    ],
)
def test_a_corner_enters_by_more_than_a_depth(depth, into, found):
    view = at((0.0, 0.4 - 0.05 + into, 1.5))
    assert entered(view, "cabinet", depth).tolist() == [[found, False]]


def test_a_turned_box_enters_with_its_corner():
    # A corner of the square of 10 cm is 7.07 cm from its middle.
    turn = turned(np.pi / 4, (0, 0, 1))
    places = [(0.0, 0.4 - 0.0707 + into, 1.5) for into in (0.001, -0.001)]
    assert entered(at(*places, turn=turn), "cabinet", 0.0)[:, MUG].tolist() == [True, False]


def corners(view, slack=0.0, **floor):
    steps = np.arange(len(view.trace))
    return corners_inside(view, "mug", "cabinet", steps, slack, **floor).sum(axis=1).tolist()


def test_how_many_corners_are_inside():
    places = [
        SHELF,
        (0.0, 0.4, 1.5),  # half way in
        (0.3, 0.4, 1.5),  # at an edge
        (0.3, 0.4, 1.8),  # at a corner
        (0.0, 0.0, 1.5),
    ]
    assert corners(at(*places)) == [8, 4, 2, 1, 0]


@pytest.mark.parametrize(
    ("slack", "out", "count"),
    [
        (0.005, 0.004, 8),
        (0.005, 0.006, 4),
        (0.0, 0.001, 4),
        (-0.005, -0.004, 4),
        (-0.005, -0.006, 8),
    ],
)
def test_slack_counts_as_inside(slack, out, count):
    # The back is at y = 0.8: the far four corners are so much beyond it.
    assert corners(at((0.0, 0.75 + out, 1.5)), slack) == [count]


@pytest.mark.parametrize(
    ("above", "with_floor", "count"),
    [
        (0.001, True, 8),  # the centre is above the floor: below it there is none
        (0.001, False, 4),
        (-0.001, True, 4),
        (-0.001, False, 4),
    ],
)
def test_corners_below_the_floor_are_on_it_if_the_centre_is_above(above, with_floor, count):
    assert corners(at((0.0, 0.6, 1.2 + above)), floor=with_floor) == [count]


def test_the_floor_is_no_wall():
    # At the front edge and half through the floor: the four corners behind the front count.
    assert corners(at((0.0, 0.4, 1.201)), floor=True) == [4]


def test_corners_are_those_in_one_interior():
    # Through the board between them: four in the lower one and four in the upper one are not eight.
    assert corners(with_two((0.0, 0.6, 1.81), (0.0, 0.6, 1.7), (0.0, 0.6, 1.9))) == [4, 8, 8]


def test_steps_may_be_asked_for_in_any_order():
    view = at(SHELF, (0.0, 0.4, 1.5), (0.0, 0.0, 1.5))
    found = corners_inside(view, "mug", "cabinet", np.array([2, 0, 1, 0]), 0.0)
    assert found.sum(axis=1).tolist() == [0, 8, 4, 8]


def test_near_is_where_the_ball_around_a_box_comes_near():
    # Half the diagonal of 10 cm is 8.66 cm, and the tolerance 5 mm: 9.16 cm before the front.
    view = at((0.0, 0.4 - 0.0915, 1.5), (0.0, 0.4 - 0.0918, 1.5))
    assert near(view, "cabinet", 0)[:, MUG].tolist() == [True, False]


def lying(place, turn=toy.UPRIGHT, half=(0.05, 0.05, 0.05)):
    """Whether the mug, so large, lies in the apple: a vessel of 8 cm at (0.4, 0, 0.94)."""
    body = dataclasses.replace(toy.SCENE.bodies[MUG], half=half)
    scene = dataclasses.replace(toy.SCENE, bodies=(body, toy.SCENE.bodies[1]))
    view = at((0.4, 0.0, 2.0), place, scene=scene, turn=turn)
    return lies_in(view, "mug", "apple", np.array([1])).tolist() == [True]


@pytest.mark.parametrize(
    ("place", "found"),
    [
        ((0.4, 0.0, 0.94), True),
        ((0.4391, 0.0, 0.94), True),
        ((0.4409, 0.0, 0.94), False),
        ((0.4, 0.0, 0.9791), True),  # the rim is at 0.98
        ((0.4, 0.0409, 0.94), False),
        ((0.4, 0.0, 0.8991), False),  # below its underside
    ],
)
def test_what_has_its_centre_in_a_vessel_lies_in_it(place, found):
    assert lying(place, half=(0.001, 0.001, 0.001)) == found


@pytest.mark.parametrize(
    ("bottom", "x", "found"),
    [
        # A spoon, 30 cm high and thin: its foot is 1 cm below the rim at 0.98 at least.
        (0.9699, 0.4, True),
        (0.9701, 0.4, False),
        (0.92, 0.4391, True),
        (0.92, 0.4409, False),
    ],
)
def test_what_leans_higher_than_the_rim_lies_in_it_if_its_foot_does(bottom, x, found):
    assert lying((x, 0.0, bottom + 0.15), half=(0.001, 0.001, 0.15)) == found


def test_what_hangs_below_a_vessel_does_not_lie_in_it():
    assert not lying((0.4, 0.0, 0.85), half=(0.001, 0.001, 0.15))


def test_the_foot_of_what_is_turned_is_its_lowest_point():
    # Half of 30 cm and a thin edge, leaning by 60 degrees: 7.5 cm below the middle, not 15.
    turn = turned(np.pi / 3)
    assert lying((0.4, 0.0, 0.969 + 0.075), turn, half=(0.0001, 0.0001, 0.15))
    assert not lying((0.4, 0.0, 0.971 + 0.075), turn, half=(0.0001, 0.0001, 0.15))
