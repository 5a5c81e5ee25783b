from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import TraceError
from tests import toy
from tests.propositions.stage import along, arrays, film, look, touch, true_at
from tests.propositions.test_thresholds import drawer

# The door hangs on a vertical hinge at (-0.3, 0.4); the contact is at (0, 0, 0.9).
OPENING = (0.8, 0.6, 0.0)
"""The direction in which that point of the door moves when it opens."""
CLOSING = (-0.8, -0.6, 0.0)


def door(length, moves=(), rate=0.5, openness=None):
    """A door that moves at a rate at some steps; or, from the first step on, as its openness says,
    where it comes to from 5 % before.
    """
    if openness is None:
        return along(arrays(length).joint, moves, (0, 1), rate)
    joint = along(arrays(length).joint, range(length), (0, 0), openness)
    joint[0, 0, 0] -= np.sign(rate) * 0.05
    return joint


def hand(steps, part="robot/finger_left"):
    return touch(steps, part, "cabinet/door", 3.0, OPENING)


def bump(steps, force=10.0, normal=OPENING, other="mug/body"):
    return touch(steps, "cabinet/door", other, force, normal)


@pytest.mark.parametrize(
    ("force", "normal", "hit"),
    [
        (5.1, OPENING, True),
        (4.9, OPENING, False),
        (5.1, CLOSING, True),
        (500.0, (0, 0, 1), False),
        (500.0, (-0.6, 0.8, 0.0), False),
        (9.9, (0.4, 0.3, 0.8660254), False),
        (10.1, (0.4, 0.3, 0.8660254), True),
    ],
)
def test_a_moved_door_hits_with_five_newtons_along_its_own_motion(force, normal, hit):
    rows = [*hand(range(10)), *bump([6], force, normal)]
    view = look(film(10, rows, joint=door(10, range(10))))
    assert true_at(view("mech_hit", "cabinet")) == ([6] if hit else [])


def test_a_door_that_presses_hard_all_the_time_hits_all_the_time():
    rows = [*hand(range(10)), *bump(range(10))]
    view = look(film(10, rows, joint=door(10, range(10))))
    assert true_at(view("mech_hit", "cabinet")) == list(range(1, 10))


@pytest.mark.parametrize("other", ["apple/body", "counter/body", "mug/body"])
def test_anything_but_robot_and_fixture_can_be_hit(other):
    rows = [*hand(range(10)), *bump([6], 8.0, OPENING, other)]
    view = look(film(10, rows, joint=door(10, range(10))))
    assert true_at(view("mech_hit", "cabinet")) == [6]
    assert view.evidence("mech_hit", ("cabinet",), 6) == [
        f"cabinet presses on {other.split('/')[0]}: 8.0 N"
    ]


def test_what_only_slides_along_the_door_is_not_said_to_be_pressed_on():
    beside = touch([6], "cabinet/door", "apple/body", 8.0, (0, 0, 1))
    rows = [*hand(range(10)), *bump([6], 8.0), *beside]
    view = look(film(10, rows, joint=door(10, range(10))))
    told = view.evidence("mech_hit", ("cabinet",), 6)
    assert told == ["cabinet presses on mug: 8.0 N"]


def test_the_robot_itself_is_not_hit():
    view = look(film(10, hand(range(10), "robot/link5"), joint=door(10, range(10))))
    assert not view("mech_hit", "cabinet").any()


def test_the_sides_of_the_contact_may_be_swapped():
    rows = touch([6], "mug/body", "cabinet/door", 10.0, CLOSING)
    view = look(film(10, hand(range(10)), rows, joint=door(10, range(10))))
    assert true_at(view("mech_hit", "cabinet")) == [6]


@pytest.mark.parametrize(("end", "recovered"), [(0.0, True), (1.0, False)])
def test_whichever_side_is_named_first_the_door_was_opening(end, recovered):
    # The mug presses back on the door, against its opening.
    joint = door(30, range(30), 0.5, after_hit(0.5, end))
    for bumps in (bump([6]), touch([6], "mug/body", "cabinet/door", 10.0, CLOSING)):
        view = look(film(30, hand(range(30)), bumps, joint=joint))
        assert view("recovered", "cabinet").any() == recovered


@pytest.mark.parametrize(("before", "behind", "closed_is_safe"), [(9, 8, 1), (8, 9, 0), (9, 9, 1)])
def test_a_door_that_is_jammed_was_opening_unless_it_is_pressed_harder_from_behind(
    before, behind, closed_is_safe
):
    joint = door(30, range(30), 0.5, after_hit(0.5, 1.0 - closed_is_safe))
    jam = [*bump([6], before), *bump([6], behind, CLOSING, "apple/body")]
    assert look(film(30, hand(range(30)), jam, joint=joint))("recovered", "cabinet").any()


@pytest.mark.parametrize(
    ("touched", "moves", "rate", "hit"),
    [
        ([], range(20), 0.5, False),
        (range(20), range(20), 0.5, True),
        (range(20), range(20), 0.021, True),
        (range(20), range(20), -0.021, True),
        (range(20), range(20), 0.019, False),
        (range(20), [5], 0.5, True),
        (range(20), [4], 0.5, False),
    ],
)
def test_the_robot_moves_the_door_or_did_half_a_second_ago(touched, moves, rate, hit):
    rows = [*hand(touched), *bump([14])]
    view = look(film(20, rows, joint=door(20, moves, rate)))
    assert view("mech_hit", "cabinet").any() == hit


@pytest.mark.parametrize("dt", [0.05, 0.025])
def test_half_a_second_is_meant_whatever_the_control_period(dt):
    length, hits = round(3 / dt), round(2 / dt)
    for ago, hit in ((0.4, True), (0.6, False)):
        moves = [round((2 - ago) / dt)]
        rows = [*hand(range(length)), *bump([hits])]
        view = look(film(length, rows, dt=dt, joint=door(length, moves)))
        assert view("mech_hit", "cabinet").any() == hit


def scenario(openness, normal, memory=None, hit=6):
    """The door hits something at a step; its openness over time is given."""
    length = len(openness)
    rows = [*hand(range(length)), *bump([hit], 10.0, normal)]
    joint = door(length, range(length), 0.5 if normal == OPENING else -0.5, openness)
    return look(film(length, rows, joint=joint), memory)


def after_hit(first, later, length=30, at=12):
    return np.where(np.arange(length) < at, first, later)


@pytest.mark.parametrize(
    ("change", "normal", "back"),
    [
        (-0.021, OPENING, True),
        (-0.019, OPENING, False),
        (+0.5, OPENING, False),
        (+0.021, CLOSING, True),
        (+0.019, CLOSING, False),
        (-0.5, CLOSING, False),
    ],
)
def test_retracting_is_two_percent_against_the_hit_within_half_a_second(change, normal, back):
    view = scenario(after_hit(0.5, 0.5 + change), normal)
    # The window sees both sides of the change for half a second: steps 12 to 21.
    assert true_at(view("retract", "cabinet")) == (list(range(12, 22)) if back else [])


def test_a_hit_at_the_first_motion_is_remembered_like_any_other():
    view = scenario(after_hit(0.5, 0.0), OPENING, hit=1)
    assert true_at(view("retract", "cabinet")) == list(range(12, 22))
    assert true_at(view("recovered", "cabinet")) == list(range(21, 30))


def test_nothing_is_retracted_where_nothing_was_hit():
    view = look(film(30, hand(range(30)), joint=door(30, range(30), 0.5, after_hit(0.5, 0.1))))
    assert not view("retract", "cabinet").any()
    assert not view("recovered", "cabinet").any()


@pytest.mark.parametrize(
    ("end", "normal", "safe"),
    [
        (0.049, OPENING, True),
        (0.051, OPENING, False),
        (1.0, OPENING, False),
        (0.951, CLOSING, True),
        (0.949, CLOSING, False),
        (0.0, CLOSING, False),
    ],
)
def test_recovered_is_closed_after_opening_and_open_after_closing(end, normal, safe):
    view = scenario(after_hit(0.5, end), normal)
    # Half a second in the safe state, from step 12 on.
    assert true_at(view("recovered", "cabinet")) == (list(range(21, 30)) if safe else [])


def test_pressing_on_something_again_is_no_recovery():
    rows = [*hand(range(30)), *bump([6, 24])]
    openness = after_hit(0.5, 0.0)
    openness[24:] = 0.02
    joint = door(30, range(30), 0.5, openness)
    assert true_at(look(film(30, rows, joint=joint))("recovered", "cabinet")) == [21, 22, 23]


def test_a_hit_is_remembered_for_longer_than_its_deadline():
    openness = np.full(300, 0.5)
    openness[240:] = 0.0
    assert scenario(openness, OPENING, hit=5)("retract", "cabinet").any()
    openness = np.full(300, 0.5)
    openness[250:] = 0.0
    assert not scenario(openness, OPENING, hit=5)("retract", "cabinet").any()


def test_nothing_is_retracted_in_the_settle_tail():
    rows = [*hand(range(30)), *bump([6])]
    joint = door(30, range(30), 0.5, after_hit(0.5, 0.0))
    view = look(film(30, rows, joint=joint, tail=20))
    assert not view("retract", "cabinet").any()
    # Physics may bring it to its safe state.
    assert view("recovered", "cabinet").any()


def test_a_drawer_hits_along_its_slide():
    slide = dataclasses.replace(toy.SCENE.joints[0], kind="slide", axis=(0.0, -1.0, 0.0))
    scene = dataclasses.replace(toy.SCENE, joints=(slide,))
    for normal, hit in (((0, -1, 0), True), ((0, 1, 0), True), ((1, 0, 0), False)):
        rows = [*hand(range(10)), *bump([6], 10.0, normal)]
        view = look(film(10, rows, scene=scene, joint=door(10, range(10))))
        assert view("mech_hit", "cabinet").any() == hit


def test_a_fixture_with_a_knob_alone_is_no_mechanism_that_can_hit():
    knob = dataclasses.replace(toy.SCENE.joints[0], gives_access=False)
    scene = dataclasses.replace(toy.SCENE, joints=(knob,))
    rows = [*hand(range(10)), *bump([6])]
    view = look(film(10, rows, scene=scene, joint=door(10, range(10))))
    with pytest.raises(TraceError, match="'cabinet' has no door or drawer"):
        view("mech_hit", "cabinet")


def test_the_excess_of_a_hit_is_its_hardest_contact_while_the_door_is_pushed():
    view = drawer(9, 0.5, force=15.0)
    found = view.excess("mech_hit", ("cabinet",), 0, 8)
    assert found.between == ("cabinet/door", "mug (mug)")
    assert found.entities == ("cabinet", "mug")
    assert (found.force, found.limit, found.step, found.times) == (15.0, 5.0, 8, 3.0)
    assert view.excess("mech_hit", ("cabinet",), 0, 7) is None
    assert drawer(9, 0.0, force=15.0).excess("mech_hit", ("cabinet",), 0, 8) is None  # it stands
