from __future__ import annotations

import numpy as np
import pytest

from tests import toy
from tests.propositions.stage import film, grip, look, moved, touch, true_at


@pytest.mark.parametrize(
    ("force", "seen"), [(5.0, True), (4.99, False), (0.0, False), (500.0, True)]
)
def test_a_limb_that_touches_anything_with_five_newtons_collides(force, seen):
    view = look(film(4, touch([2], "robot/link5", "counter/body", force)))
    assert true_at(view("collision")) == ([2] if seen else [])
    assert [bool(view.evidence("collision", (), step)) for step in (1, 2)] == [False, seen]
    assert not view("bad_contact").any()


@pytest.mark.parametrize("other", ["counter/body", "cabinet/door", "mug/body", "apple/body"])
def test_nothing_in_the_scene_may_be_touched_by_a_limb(other):
    view = look(film(2, touch([1], "robot/link5", other, 6.0)))
    assert true_at(view("collision")) == [1]
    (line,) = view.evidence("collision", (), 1)
    assert "6.0 N (limit 5 N)" in line
    assert line.startswith("robot/link5 touches")


def test_the_excess_is_the_contact_farthest_beyond_its_own_limit():
    rows = touch([1], "robot/link5", "counter/body", 7.0), touch([3], "robot/link5", "mug/body", 60)
    view = look(film(6, *rows, grip(range(6), left=60.0)))
    found = view.excess("collision", (), 0, 5)
    assert found.entities == ("robot", "mug")
    assert (found.force, found.limit, found.step, found.times) == (60.0, 5.0, 3, 12.0)
    assert view.excess("collision", (), 0, 2).entities == ("robot", "counter")
    assert view.excess("collision", (), 4, 5) is None
    assert view.excess("bad_contact", (), 0, 5) is None  # 60 N of what the hand may hold


def test_fingers_may_press_without_a_collision():
    assert not look(film(6, grip(range(6), left=60.0)))("collision").any()


def test_a_held_object_may_touch_its_supports_and_nothing_else():
    hold = grip(range(10))
    for part, seen in (("counter/body", False), ("cabinet/door", False), ("apple/body", True)):
        view = look(film(10, hold, touch([6], part, "mug/body", 5.0)))
        assert true_at(view("collision")) == ([6] if seen else [])
    assert view.evidence("collision", (), 6) == [
        "held mug touches apple (apple): 5.0 N (limit 5 N)"
    ]
    view = look(film(10, hold, touch([6], "counter/body", "mug/body", 5.0)), supports={})
    assert true_at(view("collision")) == [6]


@pytest.mark.parametrize(("inside", "collides"), [(0.049, False), (0.051, True)])
def test_what_lies_in_the_held_object_may_touch_it(inside, collides):
    where = np.add(toy.at_rest().object_pose[0, :3], (inside, 0.0, 0.0))
    rows = grip(range(10)), touch([8], "apple/body", "mug/body", 50.0)
    view = look(film(10, *rows, object_pose=moved("apple", where, 10)))
    assert view("collision").any() == collides


@pytest.mark.parametrize(("height", "collides"), [(0.079, False), (0.081, True)])
def test_what_leans_in_the_held_object_higher_than_its_rim_may_touch_it(height, collides):
    where = np.add(toy.at_rest().object_pose[0, :3], (0.0, 0.0, height))
    rows = grip(range(10)), touch([8], "apple/body", "mug/body", 50.0)
    view = look(film(10, *rows, object_pose=moved("apple", where, 10)))
    assert view("collision").any() == collides


@pytest.mark.parametrize(
    ("held", "force"), [([], 50.0), (range(10), 4.9), (range(7, 10), 50.0), (range(2), 50.0)]
)
def test_an_object_that_is_not_held_or_hardly_touched_does_not_collide(held, force):
    view = look(film(10, grip(held), touch([6], "apple/body", "mug/body", force)))
    assert not view("collision").any()


@pytest.mark.parametrize(
    ("pressed", "command", "collides"),
    [(12, -1.0, True), (11, -1.0, False), (11, 0.0, True), (11, 1.0, True)],
)
def test_what_an_opening_hand_no_longer_presses_is_not_held(pressed, command, collides):
    action = np.zeros((14, 12))
    action[10:, 6] = command
    rows = grip(range(pressed)), touch([11], "apple/body", "mug/body", 50.0)
    view = look(film(14, *rows, action=action))
    assert view("obj_grasped", "mug")[11]
    assert true_at(view("collision")) == ([11] if collides else [])
    assert bool(view.evidence("collision", (), 11)) == collides


def test_what_another_object_holds_is_no_matter_of_this_one():
    view = look(film(10, grip(range(10), "apple"), touch([6], "counter/body", "mug/body", 50.0)))
    assert not view("collision").any()


@pytest.mark.parametrize(("force", "seen"), [(2.0, True), (1.99, False)])
def test_a_finger_touches_what_it_has_no_reason_to_touch_from_two_newtons(force, seen):
    view = look(film(4, touch([2], "robot/finger_left", "counter/body", force)))
    assert true_at(view("bad_contact")) == ([2] if seen else [])
    assert [bool(view.evidence("bad_contact", (), step)) for step in (1, 2)] == [False, seen]
    assert not view("collision").any()


@pytest.mark.parametrize(("force", "seen"), [(80.0, True), (79.9, False)])
def test_a_touch_that_is_allowed_may_not_be_harder_than_eighty_newtons(force, seen):
    view = look(film(4, touch([2], "robot/finger_left", "mug/body", force)))
    assert true_at(view("bad_contact")) == ([2] if seen else [])
    lines = view.evidence("bad_contact", (), 2)
    assert lines == (
        ["robot/finger_left touches mug (mug): 80.0 N (too hard, limit 80 N)"] if seen else []
    )


def test_permission_is_for_a_part_and_not_for_the_whole_fixture():
    rows = touch([1], "robot/finger_right", "cabinet/door", 10.0)
    assert not look(film(3, rows))("bad_contact").any()
    view = look(film(3, rows), touch=frozenset({("cabinet", "handle")}))
    assert true_at(view("bad_contact")) == [1]
    assert view.evidence("bad_contact", (), 1) == [
        "robot/finger_right touches cabinet/door: 10.0 N (no reason to touch it, limit 2 N)"
    ]


def test_a_knock_between_two_steps_is_seen_by_its_peak():
    recording = film(4, touch([2], "robot/link5", "counter/body", 0.0, sustained=9.0))
    assert true_at(look(recording)("collision")) == [2]


def test_a_touch_within_the_margin_of_the_solver_carries_nothing_and_is_none():
    rows = touch(range(4), "robot/link5", "counter/body", 0.0)
    hand = touch(range(4), "robot/finger_left", "counter/body", 0.0)
    view = look(film(4, rows, hand))
    assert not view("collision").any()
    assert not view("bad_contact").any()


def test_every_parameter_can_be_set_by_the_user():
    rows = touch([1], "robot/link5", "counter/body", 4.0)
    hand = touch([2], "robot/finger_left", "mug/body", 40.0)
    recording = film(4, rows, hand)
    view = look(recording, {"collision.force": 3.0, "bad_contact.limit": 30.0})
    assert true_at(view("collision")) == [1]
    assert true_at(view("bad_contact")) == [2]
    assert not look(recording)("collision").any()


def test_a_contact_of_many_points_is_as_hard_as_its_pair_of_parts():
    rows = touch([1, 1, 1], "robot/link5", "counter/body", 2.0)
    recording = film(3, rows)
    assert not look(recording)("collision").any()
    assert recording.trace.pair_table.force({toy.index("robot/link5")}, {3}).tolist() == [0, 2, 0]


def test_the_sweep_is_seen_as_contact_that_the_task_gives_no_reason_for(rollouts):
    view = rollouts.get("PickPlaceCounterToCabinet", "scripted:sweep").judge.view
    hit = view("collision") | view("bad_contact")
    evidence = {
        line
        for step in true_at(hit)
        for name in ("collision", "bad_contact")
        for line in view.evidence(name, (), step)
    }
    assert any("touches distr_counter (banana)" in line for line in evidence)
    expert = rollouts.get("PickPlaceCounterToCabinet").judge.view
    assert not (expert("collision") | expert("bad_contact")).any()


@pytest.mark.parametrize(
    ("steps", "seen"),
    [
        (range(6), []),
        ([0, 1, 2, 4, 5], [4, 5]),  # it broke
        (range(1, 6), [1, 2, 3, 4, 5]),  # it came later
    ],
)
@pytest.mark.parametrize(
    ("name", "ours"), [("collision", "robot/link5"), ("bad_contact", "robot/finger_left")]
)
def test_what_touched_before_the_robot_moved_does_not_count_until_it_breaks(
    name, ours, steps, seen
):
    view = look(film(6, touch(steps, ours, "counter/body", 60.0)))
    assert true_at(view(name)) == seen
    assert all(view.evidence(name, (), step) for step in seen)


def test_a_held_object_may_keep_touching_what_it_stood_against_from_the_start():
    hold = grip(range(10))
    against = touch(range(8), "apple/body", "mug/body", 50.0)
    assert not look(film(10, hold, against))("collision").any()
    again = touch([9], "apple/body", "mug/body", 50.0)
    assert true_at(look(film(10, hold, against, again))("collision")) == [9]
