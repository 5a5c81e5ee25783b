from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.propositions.onset import SKILLS
from pytest_safemanip.trace import Part
from tests import toy
from tests.propositions.stage import CATALOGUE, along, arrays, film, grip, look, touch, true_at

KNOB = dataclasses.replace(toy.SCENE.joints[0], name="knob", gives_access=False)
SINK = dataclasses.replace(
    toy.SCENE,
    joints=(*toy.SCENE.joints, KNOB),
    parts=(*toy.SCENE.parts, Part("cabinet", "knob", "cabinet/knob")),
)
"""The toy cabinet with a knob beside its door."""


def times(dt, start, stop):
    return range(round(start / dt), round(stop / dt))


def test_picking_starts_when_the_fingers_have_closed_and_placing_when_they_let_go():
    gripper = along(arrays(30).gripper, range(16, 19), 1, 0.5)
    view = look(film(30, grip(range(5, 16)), gripper=gripper))
    assert true_at(view("skill_onset", "pick", "mug")) == [7]
    assert true_at(view("skill_onset", "place", "mug")) == [18]
    for skill in ("pick", "place"):
        assert not view("skill_onset", skill, "apple").any()


def test_an_object_that_is_dropped_was_not_placed():
    view = look(film(30, grip(range(5, 16))))
    assert true_at(view("skill_onset", "pick", "mug")) == [7]
    assert not view("skill_onset", "place", "mug").any()


def opening(moves, touched, rate=0.5, dt=toy.DT, length=None):
    length = length or round(2 / dt)
    joint = along(arrays(length).joint, moves, (0, 1), rate)
    rows = touch(touched, "robot/finger_left", "cabinet/door", 3.0)
    return look(film(length, rows, joint=joint, dt=dt))


@pytest.mark.parametrize("dt", [0.05, 0.025])
def test_opening_starts_when_the_door_moves_that_is_touched(dt):
    view = opening(times(dt, 0.5, 1.0), times(dt, 0.2, 1.5), dt=dt)
    (step,) = true_at(view("skill_onset", "open", "cabinet"))
    assert step * dt == pytest.approx(0.5, abs=dt)
    assert not view("skill_onset", "close", "cabinet").any()


@pytest.mark.parametrize(
    ("skill", "rate", "seen"),
    [
        ("open", 0.021, True),
        ("open", 0.019, False),
        ("open", -0.5, False),
        ("close", -0.021, True),
        ("close", -0.019, False),
        ("close", 0.5, False),
    ],
)
def test_a_door_that_moves_slower_or_the_other_way_is_no_onset(skill, rate, seen):
    view = opening(range(10, 20), range(5, 25), rate)
    assert view("skill_onset", skill, "cabinet").any() == seen


def test_a_door_that_moves_by_itself_is_no_onset():
    assert not opening(range(10, 20), [])("skill_onset", "open", "cabinet").any()


def test_two_steps_of_touching_are_a_flicker_and_three_are_an_onset():
    assert not opening(range(8, 20), [10, 11])("skill_onset", "open", "cabinet").any()
    assert true_at(opening(range(8, 20), [10, 11, 12])("skill_onset", "open", "cabinet")) == [12]


def test_a_door_that_only_trembles_is_not_opened_however_fast():
    rates = np.zeros(40)
    rates[10:30:2], rates[11:30:2] = 0.09, -0.09
    assert not opening(range(40), range(40), rates)("skill_onset", "open", "cabinet").any()


def test_a_motion_that_halts_for_two_steps_is_one_onset():
    moves = [step for step in range(10, 30) if step not in (17, 18)]
    assert true_at(opening(moves, range(40))("skill_onset", "open", "cabinet")) == [10]


def turning(force, part="robot/finger_left", control="cabinet/knob", steps=range(5, 15)):
    joint = arrays(30).joint.repeat(2, axis=1)
    view = look(film(30, touch(steps, part, control, force), scene=SINK, joint=joint))
    return view("skill_onset", "turn", "cabinet")


@pytest.mark.parametrize(("force", "seen"), [(0.5, True), (0.49, False)])
def test_turning_starts_when_the_hand_touches_a_control(force, seen):
    assert true_at(turning(force)) == ([7] if seen else [])


@pytest.mark.parametrize(
    ("part", "control"), [("robot/link5", "cabinet/knob"), ("robot/finger_left", "cabinet/door")]
)
def test_a_limb_or_a_door_turns_nothing(part, control):
    assert not turning(9.0, part, control).any()


def test_a_short_touch_turns_nothing():
    assert not turning(9.0, steps=[5, 6]).any()


@pytest.mark.parametrize(("skill", "starts"), [("pick", 22), ("open", 20)])
def test_no_skill_starts_in_the_settle_tail(skill, starts):
    joint = along(arrays(30).joint, range(20, 30), (0, 1), 0.5)
    rows = [*grip(range(20, 30)), *touch(range(30), "robot/link5", "cabinet/door", 3.0)]
    entity = "mug" if skill == "pick" else "cabinet"
    # The vote takes two steps.
    for tail, found in ((31 - starts, [starts]), (32 - starts, [])):
        view = look(film(30, rows, joint=joint, tail=tail))
        assert true_at(view("skill_onset", skill, entity)) == found


def test_every_skill_of_the_shipped_tasks_has_an_onset():
    assert set(SKILLS) >= {"pick", "place", "open", "close", "turn"}
    assert CATALOGUE["skill_onset"].act


@pytest.mark.parametrize(
    ("task", "skill", "role"),
    [("OpenDrawer", "open", "drawer"), ("TurnOnSinkFaucet", "turn", "sink")],
)
def test_the_expert_starts_the_skill_of_the_task_once_and_safely(rollouts, task, skill, role):
    judged = rollouts.get(task)
    view = judged.judge.view
    entity = judged.recording.scene.roles[role]
    (step,) = true_at(view("skill_onset", skill, entity))
    assert view("pre_safe", skill, entity)[step]
    assert 0 < step < judged.recording.acting
