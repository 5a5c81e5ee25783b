from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.trace import Part
from tests import toy
from tests.propositions.stage import KITCHEN, TAP, arrays, film, grip, look, moved, tap, touch
from tests.propositions.stage import true_at as at

CLEAN = {"mug": frozenset({"raw"}), "apple": frozenset()}
BOWL = {"mug": frozenset({"raw"}), "apple": frozenset({"container"})}
FINGER = "robot/finger_left"


def seen(length, *rows, attributes=CLEAN, **changed):
    return look(film(length, *rows, **changed), attributes=attributes)


def test_raw_food_is_contaminated_and_nothing_else_is_at_first():
    view = seen(5)
    assert view("contaminated", "mug").all()
    assert not view("contaminated", "apple").any()
    assert not view("contaminated", "robot").any()


@pytest.mark.parametrize("part", ["robot/finger_left", "robot/finger_right"])
def test_the_hand_is_contaminated_by_a_touch_of_two_steps_and_stays_so(part):
    view = seen(10, touch([3, 4], part, "mug/body"))
    assert at(view("contaminated", "robot")) == list(range(4, 10))
    assert not seen(10, touch([3, 5], part, "mug/body"))("contaminated", "robot").any()


@pytest.mark.parametrize(("force", "reached"), [(0.5, True), (0.49, False)])
def test_a_touch_is_half_a_newton(force, reached):
    view = seen(10, touch([3, 4], FINGER, "mug/body", force))
    assert view("contaminated", "robot").any() == reached


def test_the_arm_is_not_the_hand():
    assert not seen(10, touch(range(10), "robot/link5", "mug/body"))("contaminated", "robot").any()


def test_it_spreads_through_what_was_touched_in_that_order_only():
    onto = touch([3, 4], FINGER, "mug/body")
    then = touch([6, 7], "robot/finger_right", "apple/body")
    assert at(seen(10, onto, then)("contaminated", "apple")) == [7, 8, 9]
    before = touch([0, 1], "robot/finger_right", "apple/body")
    assert not seen(10, onto, before)("contaminated", "apple").any()


def test_it_spreads_through_a_chain_within_one_step():
    view = seen(4, touch(range(4), FINGER, "mug/body"), touch(range(4), FINGER, "apple/body"))
    assert at(view("contaminated", "apple")) == [1, 2, 3]


def spots(distance):
    """The mug lies on the counter and is gone; then the apple touches it so far away."""
    x, y, z = toy.PLACE
    onto = touch([0, 1], "counter/body", "mug/body")
    return seen(8, onto, touch([4, 5], "counter/body", "apple/body", at=(x + distance, y, z)))


def test_it_spreads_over_the_spot_that_was_touched_and_not_over_the_whole_counter():
    assert at(spots(0.049)("contaminated", "apple")) == [5, 6, 7]
    assert not spots(0.051)("contaminated", "apple").any()


def test_a_surface_is_no_spot_before_it_was_touched():
    rows = [
        *touch([0, 1], "counter/body", "apple/body"),
        *touch([4, 5], "counter/body", "mug/body"),
    ]
    assert not seen(8, rows)("contaminated", "apple").any()


def side_by_side(shift=(), lifted=(), light=()):
    """The mug and the apple stand 3 cm apart on the counter, where contacts are said to be.

    Args:
        shift: steps at which the apple stands 2 cm from where it stood.
        lifted: steps at which nothing carries the apple.
        light: steps at which it presses on the counter with less than ``contaminated.force``.
    """
    rows = [
        *touch(range(12), "counter/body", "mug/body"),
        *touch([s for s in range(12) if s not in {*lifted, *light}], "counter/body", "apple/body"),
        *touch(light, "counter/body", "apple/body", 0.3),
    ]
    poses = arrays(12).object_pose.copy()
    poses[list(shift), 1, 0] += 0.02
    return look(film(12, rows, object_pose=poses), attributes=CLEAN)("contaminated", "apple")


def test_what_stood_side_by_side_at_the_first_step_leaves_nothing_on_one_another():
    assert not side_by_side().any()
    assert not side_by_side(lifted=[4, 5, 6]).any()
    # A mushroom presses with 0.3 N, until fingers take hold of it.
    assert not side_by_side(light=range(6)).any()


def test_what_is_put_beside_it_later_does():
    assert at(side_by_side(shift=range(6, 12))) == list(range(6, 12))
    assert at(side_by_side(lifted=range(3), shift=range(6, 12))) == list(range(4, 12))


def test_a_door_that_moves_is_one_spot():
    onto = touch([0, 1], "cabinet/door", "mug/body")
    view = seen(8, onto, touch([4, 5], "cabinet/door", "apple/body", at=np.add(toy.PLACE, 0.5)))
    assert view("contaminated", "apple")[5]


def test_other_parts_of_the_robot_are_no_surface():
    parts = (*toy.PARTS, Part("robot", "base"))
    scene = dataclasses.replace(toy.SCENE, parts=parts)
    rows = [
        *touch([0, 1], "robot/link5", "mug/body"),
        *touch([4, 5], "robot/link5", "apple/body"),
    ]
    assert not seen(8, rows, scene=scene)("contaminated", "apple").any()


def washed(runs, place=TAP, *rows, attributes=CLEAN, **changed):
    """A tap that runs over the apple."""
    return seen(
        len(runs), *rows, attributes=attributes, scene=KITCHEN, **tap(runs, place), **changed
    )


def test_a_second_under_running_water_sanitizes():
    view = washed([False] * 5 + [True] * 25)
    assert at(view("sanitized", "apple")) == list(range(24, 30))
    assert not view("sanitized", "robot").any()
    assert not view("sanitized", "mug").any()


def test_a_tap_that_is_shut_in_between_starts_the_second_again():
    runs = [True] * 15 + [False] + [True] * 19
    assert not washed(runs)("sanitized", "apple").any()


def test_water_must_fall_on_it():
    assert not washed([True] * 30, (0.4, 0.07, 1.0))("sanitized", "apple").any()
    assert washed([True] * 30, (0.4, 0.05, 1.0))("sanitized", "apple").any()
    assert not washed([True] * 30, (0.4, 0.0, 0.6))("sanitized", "apple").any()


def test_the_hand_is_washed_where_the_gripper_is():
    hand = tuple(toy.at_rest().eef_pose[:3])
    assert washed([True] * 30, hand)("sanitized", "robot").any()


def test_what_was_washed_is_clean_and_what_is_raw_stays_raw():
    rows = touch([0, 1], "apple/body", "mug/body")
    view = washed([True] * 40, TAP, rows)
    assert at(view("contaminated", "apple")) == list(range(1, 19))
    poses = moved("mug", TAP, 40)
    assert washed([True] * 40, object_pose=poses)("contaminated", "mug").all()


def test_without_anything_raw_nothing_is_contaminated():
    view = seen(5, touch(range(5), FINGER, "mug/body"), attributes={})
    assert not view("contaminated", "robot").any()


def test_ready_to_eat_food_is_touched():
    rows = touch([3, 4, 5], FINGER, "apple/body")
    view = seen(10, rows, attributes={"apple": frozenset({"ready_to_eat"})})
    assert at(view("clean_contact", "robot")) == [4, 5]
    assert view.evidence("clean_contact", ("robot",), 4) == ["the hand touches apple (apple)"]
    assert not seen(10, rows, attributes={})("clean_contact", "robot").any()


@pytest.mark.parametrize("kind", ["utensil", "container"])
def test_what_is_clean_is_touched_for_as_long_as_it_was_clean_before(kind):
    kinds = {"mug": frozenset({"raw"}), "apple": frozenset({kind})}
    dirty = grip([0, 1])
    first = touch([4, 5, 6], FINGER, "apple/body")
    again = touch([10, 11, 12], FINGER, "apple/body")
    view = seen(15, dirty, first, again, attributes=kinds)
    assert at(view("clean_contact", "robot")) == [5, 6]
    assert at(view("contaminated", "apple")) == list(range(5, 15))


def test_a_clean_bowl_in_the_tool_that_holds_it_is_touched_by_the_tool():
    view = seen(6, touch(range(6), "apple/body", "mug/body"), attributes=BOWL)
    assert view("clean_contact", "mug").any()
    assert not view("clean_contact", "apple").any()


def test_a_knife_that_is_held_on_raw_food_soils_the_hand_and_not_the_hand_the_knife():
    kinds = {"mug": frozenset({"raw"}), "apple": frozenset({"utensil"})}
    held = touch(range(12), FINGER, "apple/body")
    cut = touch([4, 5], "apple/body", "mug/body")
    view = seen(12, held, cut, attributes=kinds)
    assert at(view("contaminated", "robot")) == list(range(5, 12))
    assert at(view("clean_contact", "robot")) == [1, 2, 3, 4]
    # The other way round, a finger in the meat soils the knife that the hand goes on holding.
    poked = seen(12, held, touch([4, 5], FINGER, "mug/body"), attributes=kinds)
    assert at(poked("contaminated", "apple")) == list(range(5, 12))
    assert at(poked("clean_contact", "robot")) == list(range(1, 12))


def test_a_container_of_raw_food_that_is_raw_itself_was_never_clean():
    kinds = {"mug": frozenset({"raw", "container"})}
    assert not seen(6, grip(range(6)), attributes=kinds)("clean_contact", "robot").any()


def test_a_recording_without_contact_spreads_nothing():
    assert not seen(3)("clean_contact", "robot").any()
    assert arrays(3).switch.shape == (3, 0)
    assert not np.any(seen(3)("sanitized", "robot"))
