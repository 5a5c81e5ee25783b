"""Who presses on whom, and to which side."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.propositions.kernels import forces
from pytest_safemanip.propositions.kernels.forces import (
    finger_groups,
    forces_on,
    hand_parts,
    object_parts,
    owners,
    robot_on_joint,
    robot_parts,
)
from pytest_safemanip.trace.elements import Part
from tests import toy
from tests.propositions.stage import film, look, touch

MUG, APPLE = 0, 1
LEFT, RIGHT = "robot/finger_left", "robot/finger_right"


def test_parts_of_the_robot_its_hand_and_an_object():
    gripper = dataclasses.replace(toy.SCENE.grippers[0], palm=("palm",))
    parts = (*toy.PARTS, Part("robot", "palm"))
    scene = dataclasses.replace(toy.SCENE, parts=parts, grippers=(gripper,))
    view = look(film(1, scene=scene))
    assert hand_parts(view) == {0, 1, 7}
    assert robot_parts(view) == {0, 1, 2, 7}
    assert object_parts(view, "mug") == {5}
    assert object_parts(view, "shelf without a part") == frozenset()
    assert owners(view).tolist() == [-1, -1, -1, -1, -1, MUG, APPLE, -1]


def test_the_largest_force_on_each_object_whichever_part_is_meant():
    view = look(
        film(
            3,
            touch([0, 1], LEFT, "mug/body", 3.0),
            touch([1], "mug/body", "robot/link5", 5.0),
            touch([1], RIGHT, "apple/body", 7.0),
            touch([2], "counter/body", "apple/body", 9.0),
        )
    )
    scene = view.trace.scene
    finger, link = (frozenset(scene.parts_of("robot", (n,))) for n in ("finger_left", "link5"))
    assert forces_on(view, robot_parts(view)).tolist() == [[3, 0], [5, 7], [0, 0]]
    assert forces_on(view, finger).tolist() == [[3, 0], [3, 0], [0, 0]]
    assert forces_on(view, link).tolist() == [[0, 0], [5, 0], [0, 0]]


def pushes(view, where):
    return forces.pushes(view, finger_groups(view)[0], where)


def pushed(*rows, length=1, where=None):
    view = look(film(length, *rows))
    wanted = np.zeros((length, 2), bool)
    for step, body in where or [(0, MUG)]:
        wanted[step, body] = True
    return pushes(view, wanted)  # (xyz, finger, case)


def test_a_finger_pushes_along_the_normal_that_points_away_from_it():
    found = pushed(
        touch([0], LEFT, "mug/body", 3.0, (1, 0, 0)),
        touch([0], "mug/body", RIGHT, 4.0, (1, 0, 0)),  # from the mug to the finger
    )
    assert found[:, 0, 0].tolist() == [3.0, 0.0, 0.0]
    assert found[:, 1, 0].tolist() == [-4.0, 0.0, 0.0]


def test_contact_points_of_one_finger_add_up():
    found = pushed(
        touch([0], LEFT, "mug/body", 3.0, (1, 0, 0)),
        touch([0], LEFT, "mug/body", 4.0, (0, 1, 0)),
        touch([0], RIGHT, "mug/body", 2.0, (0, 0, -1)),
    )
    assert found[:, 0, 0].tolist() == [3.0, 4.0, 0.0]
    assert found[:, 1, 0].tolist() == [0.0, 0.0, -2.0]


def test_only_the_cases_that_are_asked_for_in_order_of_step_and_object():
    rows = [
        row
        for step, force in ((0, 1.0), (1, 2.0), (2, 3.0))
        for row in (
            *touch([step], LEFT, "mug/body", force, (1, 0, 0)),
            *touch([step], LEFT, "apple/body", 10 * force, (1, 0, 0)),
        )
    ]
    found = pushed(rows, length=3, where=[(0, APPLE), (2, MUG), (2, APPLE)])
    assert found[0, 0].tolist() == [10.0, 3.0, 30.0]
    assert not found[:, 1].any()


def test_arm_counter_and_other_objects_push_with_no_finger():
    found = pushed(
        touch([0], "robot/link5", "mug/body", 3.0, (1, 0, 0)),
        touch([0], "counter/body", "mug/body", 4.0, (1, 0, 0)),
        touch([0], "apple/body", "mug/body", 5.0, (1, 0, 0)),
        touch([0], LEFT, "counter/body", 6.0, (1, 0, 0)),
    )
    assert not found.any()


def test_what_a_finger_presses_at_the_next_step_is_no_object_of_this_one():
    rows = touch([1], LEFT, "counter/body", 6.0, (1, 0, 0))
    assert not pushed(rows, length=2, where=[(0, APPLE), (1, MUG)]).any()


@pytest.mark.parametrize(("force", "push"), [(3.0, 3.0), (0.0, 8.0)])
def test_what_ended_within_the_step_counts_with_its_peak(force, push):
    view = look(film(1, touch([0], LEFT, "mug/body", force, (0, 1, 0), sustained=8.0)))
    assert pushes(view, np.array([[True, False]]))[:, 0, 0].tolist() == [0.0, push, 0.0]


def test_force_between_the_robot_and_what_a_joint_moves():
    rows = [
        *touch([0], LEFT, "cabinet/door", 3.0),
        *touch([0, 1], "cabinet/door", "robot/link5", 5.0),
        *touch([2], "cabinet/door", "mug/body", 7.0),
        *touch([2], LEFT, "counter/body", 9.0),
    ]
    assert robot_on_joint(look(film(3, rows)), 0).tolist() == [5.0, 5.0, 0.0]
