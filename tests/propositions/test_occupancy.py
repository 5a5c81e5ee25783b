from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import TraceError
from tests import toy
from tests.propositions.stage import arrays, film, grip, look, moved, true_at

INSIDE, BEFORE = (0.0, 0.6, 1.5), (0.0, 0.2, 1.5)
"""In the cabinet, and in front of it: the mug is 10 cm wide, the shelf begins at y = 0.4."""
WINDOW = 5


def seen(places, *rows, **changed):
    return look(film(len(places), *rows, object_pose=moved("mug", places), **changed))


def test_an_item_rests_inside_after_a_quarter_of_a_second():
    view = seen([BEFORE] * 3 + [INSIDE] * 10)
    assert true_at(view("item_in_enclosure", "cabinet")) == list(range(3 + WINDOW - 1, 13))


def test_what_the_robot_holds_inside_does_not_rest_there():
    view = seen([INSIDE] * 20, grip(range(10)))
    assert true_at(view("item_in_enclosure", "cabinet")) == list(range(12, 20))


@pytest.mark.parametrize(("drift", "rests"), [(0.0049, True), (0.0051, False)])
def test_what_moves_inside_does_not_rest(drift, rests):
    steps = np.arange(10)[:, None] * np.array((drift / (WINDOW - 1), 0.0, 0.0))
    view = seen(np.array(INSIDE) + steps)
    assert view("item_in_enclosure", "cabinet").any() == rests


def test_what_lies_in_a_drawer_that_moves_rests_in_it():
    way = np.arange(10)[:, None] * np.array((0.0, 0.05, 0.0))
    box = arrays(10).box_pose.copy()
    box[:, 0, :3] += way
    places = np.array(INSIDE) + way
    assert not seen(places)("item_in_enclosure", "cabinet").any()
    assert seen(places, box_pose=box)("item_in_enclosure", "cabinet")[-1]


def test_half_inside_is_inside_when_the_centre_is():
    edge = 0.4
    for y, rests in ((edge + 0.001, True), (edge - 0.001, False)):
        assert seen([(0.0, y, 1.5)] * 10)("item_in_enclosure", "cabinet").any() == rests


def test_a_held_object_is_inserted_with_its_first_corner():
    places = [BEFORE] * 5 + [(0.0, 0.349, 1.5), (0.0, 0.354, 1.5), (0.0, 0.356, 1.5), INSIDE]
    assert true_at(seen(places, grip(range(9)))("insert_item", "cabinet")) == [7]
    assert not seen(places)("insert_item", "cabinet").any()


def test_an_item_that_is_grasped_where_it_lies_is_not_inserted():
    view = seen([INSIDE] * 10, grip(range(3, 10)))
    assert not view("insert_item", "cabinet").any()


def test_nothing_is_inserted_in_the_settle_tail():
    places = [BEFORE] * 5 + [INSIDE] * 2
    assert not seen(places, grip(range(7)), tail=2)("insert_item", "cabinet").any()


def test_an_enclosure_is_cleared_when_no_centre_is_inside_for_a_quarter_of_a_second():
    view = seen([INSIDE] * 3 + [BEFORE] * 8)
    assert true_at(view("enclosure_cleared", "cabinet")) == list(range(3 + WINDOW - 1, 11))
    assert true_at(seen([BEFORE] * 8)("enclosure_cleared", "cabinet")) == list(range(4, 8))


def test_any_object_of_the_scene_counts_whether_or_not_the_task_is_about_it():
    poses = moved("apple", [INSIDE] * 10)
    view = look(film(10, object_pose=poses), objects=("mug",))
    assert view("item_in_enclosure", "cabinet").any()
    assert not view("enclosure_cleared", "cabinet").any()
    assert view.evidence("insert_item", ("cabinet",), 5) == ["apple is inside cabinet"]


def test_an_item_counts_in_either_of_two_interiors_and_at_rest_in_one():
    second = dataclasses.replace(toy.SCENE.boxes[0], name="lower")
    scene = dataclasses.replace(toy.SCENE, boxes=(toy.SCENE.boxes[0], second))
    box = np.repeat(arrays(10).box_pose, 2, axis=1)
    box[:, 1, 2] = 0.5
    below = (0.0, 0.6, 0.5)
    rests = seen([below] * 10, scene=scene, box_pose=box)("item_in_enclosure", "cabinet")
    assert rests[-1]
    hops = [INSIDE if step % 2 else below for step in range(10)]
    assert not seen(hops, scene=scene, box_pose=box)("item_in_enclosure", "cabinet").any()


def test_a_recording_shorter_than_the_window_rests_nowhere():
    assert not seen([INSIDE] * 3)("item_in_enclosure", "cabinet").any()


@pytest.mark.parametrize("name", ["item_in_enclosure", "insert_item", "enclosure_cleared"])
def test_a_fixture_without_an_interior_is_an_error(name):
    with pytest.raises(TraceError, match="'counter' has no interior"):
        look(film(3))(name, "counter")
