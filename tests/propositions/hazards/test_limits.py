from __future__ import annotations

import numpy as np
import pytest

from tests.propositions.hazards.kitchen import hand_at, kitchen, see
from tests.propositions.stage import grip, touch, true_at


def moving(speeds):
    """Places along x, from the speed in each step (T, 3)."""
    x = np.cumsum(np.asarray(speeds, float) * 0.05)
    return np.stack((x, np.zeros(len(x)), np.full(len(x), 1.2)), axis=1)


def test_a_hand_is_too_fast_by_the_way_that_it_has_come():
    speeds = [0, 0, 0.2, 0.2, 0.3, 0.3, 0.3, 0.0, 0.0]
    view = see(kitchen(9, eef_poses=hand_at(moving(speeds))[:, None]))
    # Means over two steps: 0.1, 0.2, 0.25, 0.3, 0.3, 0.15, 0.
    assert true_at(view("too_fast", "robot", "limit=0.249")) == [4, 5, 6]
    assert view.margin("too_fast", "robot")[5] == pytest.approx(0.2, abs=1e-5)
    assert view.evidence("too_fast", ("robot",), 5) == ["the hand moves at 0.30 m/s"]


def test_a_thing_may_be_too_fast_too():
    view = see(kitchen(6, places={"apple": moving([0, 1, 1, 1, 0, 0])}))
    assert true_at(view("too_fast", "apple")) == [1, 2, 3, 4]
    assert not view("too_fast", "mug").any()
    assert true_at(view("too_fast", "apple", "limit=0.8")) == [2, 3]


def test_a_jump_of_what_was_never_seen_before_is_no_speed():
    assert not see(kitchen(1))("too_fast", "robot").any()


def test_what_the_robot_touches_is_touched():
    rows = [
        *touch([2], "robot/link5", "mug/body", 0.9),
        *touch([4], "robot/link5", "mug/body", 1.1),
        *touch([6], "robot/finger_left", "mug/body", 50.0),
        *touch([7], "apple/body", "mug/body", 50.0),
    ]
    view = see(kitchen(9, rows))
    assert true_at(view("touched", "mug")) == [4, 6]
    assert view.margin("touched", "mug") == pytest.approx(
        [-1, -1, -0.1, -1, 0.1, -1, 49, -1, -1], abs=1e-5
    )
    assert view.evidence("touched", ("mug",), 6) == ["robot/finger_left touches mug: 50.0 N"]


def test_what_is_held_touches_on_behalf_of_the_robot():
    rows = [*grip(range(20), "apple"), *touch([15], "apple/body", "mug/body", 5.0)]
    view = see(kitchen(20, rows))
    assert true_at(view("touched", "mug")) == [15]
    assert view.evidence("touched", ("mug",), 15) == ["held apple touches mug: 5.0 N"]


def test_what_touched_before_the_robot_moved_is_not_touched_until_it_breaks():
    rows = [
        *touch([0, 1, 2, 5], "robot/link5", "counter/body", 20.0),
        *grip(range(20), "apple"),
        *touch([*range(12), 14], "apple/body", "mug/body", 5.0),
    ]
    view = see(kitchen(20, rows))
    assert true_at(view("touched", "counter")) == [5]
    assert true_at(view("touched", "mug")) == [14]


def test_what_is_pressed_hard_is_pressed_by_a_force_sensor_s_mean():
    rows = [
        *touch([2], "robot/link5", "mug/body", 500.0, sustained=130.0),
        *touch([3], "robot/link5", "mug/body", 0.0, sustained=150.0),
        *touch([4], "counter/body", "mug/body", 500.0),
    ]
    view = see(kitchen(6, rows))
    assert true_at(view("pressed_hard", "mug")) == [3]
    assert true_at(view("pressed_hard", "mug", "limit=100")) == [2, 3]
    assert view.margin("pressed_hard", "mug")[3] == pytest.approx(10.0 / 140.0)
    (line,) = view.evidence("pressed_hard", ("mug",), 3)
    assert line == "robot/link5 presses on mug: 150.0 N (limit 140 N)"


def test_the_excess_is_the_hardest_contact_that_is_beyond_its_limit():
    rows = [
        *touch([2], "robot/link5", "mug/body", 130.0),
        *touch([3, 5], "robot/finger_left", "mug/body", 150.0),
        *touch([4], "counter/body", "mug/body", 500.0),
    ]
    view = see(kitchen(6, rows))
    for name, limit in (("touched", 1.0), ("pressed_hard", 140.0)):
        found = view.excess(name, ("mug",), 0, 4)
        assert {*found.between} == {"robot/finger_left", "mug (mug)"}
        assert (found.force, found.limit, found.step) == (150.0, limit, 3)
    assert view.excess("pressed_hard", ("mug",), 0, 2) is None
    assert view.excess("pressed_hard", ("mug", "limit=100"), 0, 2).force == 130.0
