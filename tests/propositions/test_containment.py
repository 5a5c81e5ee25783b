from __future__ import annotations

import numpy as np
import pytest

from tests.propositions.stage import arrays, film, grip, look, moved, touch, true_at, turned

ABOVE, IN_BOWL = (0.4, 0.0, 1.1), (0.4, 0.0, 0.94)
"""The mug is the content; the apple, a box of 8 cm at x = 0.4, plays the bowl."""
SHELF = (0.0, 0.6, 1.5)


def seen(places, *rows, **changed):
    places = np.asarray(places, float)
    return look(film(len(places), *rows, object_pose=moved("mug", places), **changed))


def let_go(place, receiver="apple", **changed):
    """Held at a place for ten steps, then let go there."""
    return seen([place] * 20, grip(range(10)), **changed)("transfer", "mug", receiver)


def test_what_is_let_go_above_the_receiver_is_transferred_when_the_grasp_ends():
    grasped = seen([ABOVE] * 20, grip(range(10)))("obj_grasped", "mug")
    assert true_at(let_go(ABOVE)) == [true_at(grasped)[-1] + 1]


@pytest.mark.parametrize(("beside", "transferred"), [(0.139, True), (0.141, False)])
def test_what_is_let_go_within_ten_centimetres_of_it_was_meant_for_it(beside, transferred):
    assert let_go((0.4 + beside, 0.0, 1.1)).any() == transferred
    assert let_go((0.4, beside, 1.1)).any() == transferred


def test_what_is_let_go_below_it_is_not_meant_for_it():
    assert not let_go((0.4, 0.0, 0.8)).any()


def test_a_fixture_receives_in_its_interior():
    assert let_go(SHELF, "cabinet").any()
    assert not let_go((0.0, -0.2, 1.5), "cabinet").any()


@pytest.mark.parametrize(("nearer", "meant"), [(0.01, {"apple"}), (-0.01, {"cabinet"})])
def test_of_several_receivers_that_stand_side_by_side_the_nearest_was_meant(nearer, meant):
    """The apple's box ends 8 cm beside the cabinet's interior; the mug is let go between them."""
    wall = 0.3
    poses = moved("mug", [(wall + 0.04 + nearer, 0.6, 1.5)] * 20)
    poses[:, 1, :3] = (wall + 0.08 + 0.04, 0.6, 1.45)
    pairs = (("mug", "apple"), ("mug", "cabinet"))
    view = look(film(20, grip(range(10)), object_pose=poses), transfers=pairs)
    assert {receiver for _, receiver in pairs if view("transfer", "mug", receiver).any()} == meant


def test_nothing_is_transferred_in_the_settle_tail_but_what_was_let_go_before_it():
    assert let_go(ABOVE, tail=9).any()
    assert not let_go(ABOVE, tail=10).any()


def test_what_is_flung_was_meant_for_what_it_was_over_when_the_fingers_left_it():
    """It is half a metre further when the debounced end of the grasp is seen."""
    assert seen([ABOVE] * 10 + [(0.9, 0.0, 1.0)] * 10, grip(range(10)))(
        "transfer", "mug", "apple"
    ).any()
    assert not seen([(0.9, 0.0, 1.0)] * 10 + [ABOVE] * 10, grip(range(10)))(
        "transfer", "mug", "apple"
    ).any()


@pytest.mark.parametrize(("way", "brought"), [(0.0, False), (0.039, False), (0.041, True)])
def test_what_is_let_go_where_it_lay_was_meant_for_nothing(way, brought):
    beside = np.array((0.4, 0.13, 1.1))
    places = np.repeat([beside], 40, axis=0)
    places[20:] += np.array((0.0, -way, 0.0))
    assert seen(places, grip(range(10, 30)))("transfer", "mug", "apple").any() == brought


def test_what_is_lifted_and_put_down_again_where_it_lay_was_meant_for_the_receiver():
    places = np.repeat([(0.4, 0.13, 1.1)], 40, axis=0)
    places[20:25, 2] += 0.05
    assert seen(places, grip(range(10, 30)))("transfer", "mug", "apple").any()


def test_what_slips_and_is_caught_over_the_receiver_was_brought_there_all_the_same():
    places = np.array([(0.9, 0.0, 1.1)] * 10 + [ABOVE] * 30)
    places[20:, 2] -= np.minimum(0.01 * np.arange(20), 0.05)
    rows = grip(range(5, 20)), grip(range(24, 35))
    assert len(true_at(seen(places, *rows)("transfer", "mug", "apple"))) == 2


def over(angle, place, *rows):
    """The mug is at a place from the start; the apple is a bowl, turned about a level axis."""
    poses = moved("mug", [place] * 20)
    poses[:, 1, 3:] = turned(np.deg2rad(angle))
    return look(film(20, *rows, object_pose=poses))


@pytest.mark.parametrize("angle", [0, 90, 180])
def test_above_is_above_however_the_receiver_lies(angle):
    assert over(angle, ABOVE, grip(range(10)))("transfer", "mug", "apple").any()
    assert not over(angle, (0.4, 0.0, 0.8), grip(range(10)))("transfer", "mug", "apple").any()


@pytest.mark.parametrize(("angle", "held"), [(59, True), (61, False), (180, False)])
def test_a_vessel_that_is_tipped_over_contains_nothing(angle, held):
    view = over(angle, IN_BOWL)
    assert view("contained", "mug", "apple").any() == held
    assert ("apple does not stand upright" in view.evidence("contained", ("mug", "apple"), 19)) != (
        held
    )


@pytest.mark.parametrize(("force", "free"), [(0.49, True), (0.5, False)])
def test_what_a_finger_pins_in_the_receiver_is_not_at_rest_in_it(force, free):
    view = over(0, IN_BOWL, touch(range(20), "robot/finger_left", "mug/body", force))
    assert view("contained", "mug", "apple").any() == free


def tipped(content, held):
    """The apple is a ladle that the robot holds; the mug leaves it at step 10, toward the shelf."""
    ladle = np.array(SHELF)
    poses = moved("apple", [SHELF] * 20)
    mug = np.repeat([ladle], 20, axis=0)
    mug[10:] = content
    poses[:, 0, :3] = mug
    rows = grip(range(20), "apple") if held else []
    return look(film(20, rows, object_pose=poses))("transfer", "mug", "cabinet")


def test_what_leaves_a_container_that_the_robot_holds_is_transferred():
    assert true_at(tipped((0.1, 0.6, 1.4), held=True)) == [10]
    assert not tipped((0.1, 0.6, 1.4), held=False).any()
    assert not tipped((0.039, 0.6, 1.5), held=True).any()


def test_what_lies_in_the_receiver_for_a_quarter_of_a_second_is_contained():
    view = seen([ABOVE] * 5 + [IN_BOWL] * 15)
    assert true_at(view("contained", "mug", "apple")) == list(range(9, 20))


def test_what_is_above_a_flat_receiver_is_contained_while_it_touches_it():
    on_top = (0.4, 0.0, 1.03)
    rests = touch(range(20), "apple/body", "mug/body")
    assert seen([on_top] * 20, rests)("contained", "mug", "apple")[-1]
    assert not seen([on_top] * 20)("contained", "mug", "apple").any()
    beside = (0.445, 0.0, 1.03)
    assert not seen([beside] * 20, rests)("contained", "mug", "apple").any()


def test_what_the_robot_still_holds_is_not_contained():
    view = seen([IN_BOWL] * 20, grip(range(10)))
    assert true_at(view("contained", "mug", "apple"))[0] == 12


@pytest.mark.parametrize(("drift", "rests"), [(0.0049, True), (0.0051, False)])
def test_what_moves_in_the_receiver_is_not_contained_yet(drift, rests):
    steps = np.arange(5)[:, None] * np.array((drift / 4, 0.0, 0.0))
    assert seen(np.array(IN_BOWL) + steps)("contained", "mug", "apple").any() == rests


def test_what_is_carried_about_in_the_receiver_is_contained():
    way = np.arange(20)[:, None] * np.array((0.02, 0.0, 0.0))
    poses = arrays(20).object_pose.copy()
    poses[:, 1, :3] += way
    poses[:, 0, :3] = poses[:, 1, :3]
    assert look(film(20, object_pose=poses))("contained", "mug", "apple")[-1]


def test_the_evidence_says_how_far_it_missed():
    view = seen([(0.54, 0.0, 0.94)] * 10)
    assert view.evidence("contained", ("mug", "apple"), 9) == [
        "the centre of mug is 10 cm beside and 0 cm above or below the box of apple"
    ]
    view = seen([(1.44, 0.0, 1.98)] * 10)
    assert view.evidence("contained", ("mug", "apple"), 9) == [
        "the centre of mug is 100 cm beside and 100 cm above or below the box of apple"
    ]
    assert seen([SHELF] * 3).evidence("contained", ("mug", "cabinet"), 2) == [
        "the centre of mug is inside the box of cabinet"
    ]
