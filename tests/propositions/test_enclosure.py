from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import TraceError
from tests import toy
from tests.propositions.stage import UP, along, arrays, film, grip, look, moved, true_at, turned

FRONT = 0.4
"""The shelf's open side; it reaches from here to y = 0.8."""
HALF = 0.05
INSIDE = (0.0, 0.6, 1.5)


def hand_at(places):
    eef = np.repeat(toy.at_rest().eef_pose[None], len(places), axis=0)
    eef[:, :3] = places
    return eef


def depths(*values):
    return [(0.0, FRONT + value, 1.5) for value in values]


def test_reaching_in_is_the_step_at_which_the_gripper_comes_in():
    places = depths(-0.1, -0.001, 0.001, 0.1, 0.1, -0.1, 0.1)
    view = look(film(len(places), eef_pose=hand_at(places)))
    assert true_at(view("reach_in", "cabinet")) == [2, 6]


@pytest.mark.parametrize("place", [(0.31, 0.6, 1.5), (0.0, 0.6, 1.81), (0.0, 0.81, 1.5)])
def test_a_gripper_beside_the_interior_has_not_reached_in(place):
    view = look(film(3, eef_pose=hand_at([(0, 0, 1), place, place])))
    assert not view("reach_in", "cabinet").any()


def test_a_gripper_that_starts_inside_has_not_entered():
    assert not look(film(3, eef_pose=hand_at([INSIDE] * 3)))("reach_in", "cabinet").any()


def test_it_is_the_centre_of_the_grippers_box_that_enters():
    (hand,) = toy.SCENE.grippers
    hand = dataclasses.replace(hand, centre=(0.0, 0.1, 0.0))
    scene = dataclasses.replace(toy.SCENE, grippers=(hand,))
    places = depths(-0.2, -0.11, -0.09)
    view = look(film(3, scene=scene, eef_pose=hand_at(places)))
    assert true_at(view("reach_in", "cabinet")) == [2]


def test_a_turned_interior_is_entered_from_its_own_side():
    box = arrays(2).box_pose.copy()
    box[:, 0, 3:] = turned(np.pi / 2, (0, 0, 1))  # now 0.4 wide and 0.6 deep
    for place, entered in (((0.0, 0.31, 1.5), True), ((0.25, 0.6, 1.5), False)):
        view = look(film(2, eef_pose=hand_at([(0, 0, 1), place]), box_pose=box))
        assert view("reach_in", "cabinet").any() == entered


def test_nothing_reaches_in_during_the_settle_tail():
    eef = hand_at(depths(-0.1, -0.1, 0.1, 0.1))
    assert look(film(4, eef_pose=eef, tail=1))("reach_in", "cabinet").any()
    assert not look(film(4, eef_pose=eef, tail=2))("reach_in", "cabinet").any()


def test_open_is_nine_tenths_of_the_range_or_what_the_task_says():
    openness = (0.0, 0.799, 0.801, 0.899, 0.901, 1.0)
    joint = along(arrays(6).joint, range(6), (0, 0), openness)
    view = look(film(6, joint=joint))
    assert true_at(view("fix_open", "cabinet")) == [4, 5]
    view = look(film(6, joint=joint), open_at={"cabinet": 0.8})
    assert true_at(view("fix_open", "cabinet")) == [2, 3, 4, 5]
    assert view.evidence("fix_open", ("cabinet",), 1) == ["cabinet is 80% open (open means 80%)"]


def two_doors():
    left, right = toy.SCENE.joints[0], dataclasses.replace(toy.SCENE.joints[0], name="right")
    knob = dataclasses.replace(left, name="knob", gives_access=False)
    return dataclasses.replace(toy.SCENE, joints=(left, right, knob))


def test_the_most_open_door_counts_and_no_knob():
    joint = np.zeros((3, 3, 2), np.float32)
    joint[1, 1, 0] = joint[2, 2, 0] = 1.0
    view = look(film(3, scene=two_doors(), joint=joint))
    assert true_at(view("fix_open", "cabinet")) == [1]


def side_by_side():
    """Two doors, 0.3 m wide each, in front of the shelf; only the left one is open."""
    pose = toy.SCENE.joints[0].pose
    left, right = (
        dataclasses.replace(
            toy.SCENE.joints[0], name=name, half=(0.15, 0.01, 0.3), pose=(x, *pose[1:])
        )
        for name, x in (("hinge", -0.15), ("right", 0.15))
    )
    joint = np.zeros((2, 2, 2), np.float32)
    joint[:, 0, 0] = 1.0
    return {"scene": dataclasses.replace(toy.SCENE, joints=(left, right)), "joint": joint}


THICKNESS = 0.05
"""Half of the toy gripper's."""


@pytest.mark.parametrize(
    ("x", "opened"),
    [
        (-0.2, True),
        (0.0, True),
        (THICKNESS - 0.001, True),
        (THICKNESS + 0.001, False),
        (0.2, False),
    ],
)
def test_only_the_door_that_the_hand_is_behind_gives_it_access(x, opened):
    hand = hand_at([(x, 0.3, 1.5), (x, 0.5, 1.5)])
    view = look(film(2, eef_pose=hand, **side_by_side()))
    assert true_at(view("reach_in", "cabinet")) == [1]
    assert view("fix_open", "cabinet")[1] == opened


def test_beside_all_doors_any_of_them_gives_access():
    places = [(0.9, 0.5, 1.5), (0.2, 0.5, 2.5)]
    assert look(film(2, eef_pose=hand_at(places), **side_by_side()))("fix_open", "cabinet").all()


def test_a_door_of_a_turned_fixture_is_looked_through_along_its_own_thickness():
    told = side_by_side()
    turn = turned(np.pi / 2, UP)
    # The same doors beside one another along y, seen along x.
    joints = tuple(
        dataclasses.replace(joint, pose=(0.0, joint.pose[0], 1.5, *turn))
        for joint in told["scene"].joints
    )
    told["scene"] = dataclasses.replace(told["scene"], joints=joints)
    hand = hand_at([(0.5, -0.2, 1.5), (0.5, 0.2, 1.5)])
    assert true_at(look(film(2, eef_pose=hand, **told))("fix_open", "cabinet")) == [0]


def test_open_shelves_are_always_open():
    assert true_at(look(film(3))("fix_open", "counter")) == [0, 1, 2]


def test_a_fixture_without_interior_is_an_error_and_not_false():
    view = look(film(3))
    with pytest.raises(TraceError, match="'counter' has no interior"):
        view("reach_in", "counter")


def test_a_held_object_starts_to_enter_with_its_first_corner_five_millimetres_in():
    places = depths(*(np.array((-0.1, -0.1, -0.1, 0.0, 0.0049, 0.0051, 0.1, 0.2)) - HALF))
    poses = moved("mug", places)
    view = look(film(8, grip(range(8)), object_pose=poses))
    assert true_at(view("place_in_onset", "mug", "cabinet")) == [5]
    assert true_at(view("obj_outside", "mug", "cabinet")) == [0, 1, 2, 3, 4]
    view = look(film(8, object_pose=poses))
    assert not view("place_in_onset", "mug", "cabinet").any()


@pytest.mark.parametrize(("tail", "entered"), [(1, [4]), (2, [])])
def test_nothing_starts_to_enter_in_the_settle_tail(tail, entered):
    poses = moved("mug", depths(*(np.array((-0.1, -0.1, -0.1, -0.1, 0.1, 0.1)) - HALF)))
    view = look(film(6, grip(range(6)), object_pose=poses, tail=tail))
    assert true_at(view("place_in_onset", "mug", "cabinet")) == entered


def test_what_meets_the_edge_of_the_floor_has_not_begun_to_enter():
    # Leaning by 0.35 rad, the mug's lower front corner is 6.4 cm ahead of its middle and 3 cm below
    # it, the upper one 3 cm ahead; the floor is 1 cm below its middle.
    floor, upper = INSIDE[2] - 0.3, HALF * (np.cos(0.35) - np.sin(0.35))
    places = [(0.0, FRONT - upper + depth, floor + 0.01) for depth in (-0.2, -0.03, 0.0049, 0.0051)]
    poses = moved("mug", np.repeat(places, 3, axis=0))
    poses[:, 0, 3:] = turned(0.35)
    view = look(film(12, grip(range(12)), object_pose=poses))
    assert true_at(view("place_in_onset", "mug", "cabinet")) == [9]
    assert true_at(view("insert_item", "cabinet")) == [9]


def test_only_the_object_that_enters_is_put_in():
    poses = moved("mug", depths(*(np.array((-0.1, -0.1, -0.1, 0.1)) - HALF)))
    view = look(film(4, grip(range(4)), object_pose=poses))
    assert view("place_in_onset", "mug", "cabinet").any()
    assert not view("place_in_onset", "apple", "cabinet").any()
    assert view("obj_outside", "apple", "cabinet").all()


def test_an_object_is_inside_with_all_corners_up_to_five_millimetres():
    view = look(film(4, object_pose=moved("mug", depths(HALF - 0.0051, HALF - 0.0049, 0.2, 0.36))))
    assert true_at(view("obj_inside", "mug", "cabinet")) == [1, 2]
    assert not view("obj_inside", "apple", "cabinet").any()
    assert view.evidence("obj_inside", ("mug", "cabinet"), 0) == [
        "4 of 8 corners of mug are inside cabinet"
    ]


def test_the_box_around_a_round_thing_may_reach_below_the_floor_but_not_above_the_ceiling():
    low, high = INSIDE[2] - 0.3, INSIDE[2] + 0.3
    heights = (low - 0.001, low + 0.001, high - 0.046, high - 0.044)
    view = look(film(4, object_pose=moved("mug", [(*INSIDE[:2], z) for z in heights])))
    assert true_at(view("obj_inside", "mug", "cabinet")) == [1, 2]


def test_the_expert_leaves_the_object_inside(rollouts):
    view = rollouts.get("PickPlaceCounterToCabinet").judge.view
    assert view("obj_inside", "obj", next(iter(view.binding.enclosures)))[-20:].all()


def test_a_turned_object_needs_more_room():
    poses = moved("mug", depths(HALF, HALF))
    poses[1, 0, 3:] = turned(np.pi / 4, (0, 0, 1))
    assert true_at(look(film(2, object_pose=poses))("obj_inside", "mug", "cabinet")) == [0]


def test_an_object_half_way_in_is_neither_inside_nor_outside():
    view = look(film(1, object_pose=moved("mug", depths(0.0))))
    assert not view("obj_inside", "mug", "cabinet")[0]
    assert not view("obj_outside", "mug", "cabinet")[0]


@pytest.mark.parametrize("then", [0.2, -0.3])
def test_what_falls_in_or_out_while_its_release_is_still_in_doubt_was_let_go_half_way_in(then):
    late = round(0.5 / toy.DT)
    places = depths(*[-0.2] * 2, *[0.0] * 5, *[then] * (late + 5))
    action = arrays(len(places)).action.copy()
    action[5:, 6] = -1.0
    poses = moved("mug", places)
    view = look(film(len(places), grip(range(6)), object_pose=poses, action=action))
    [released] = true_at(view("obj_released", "mug"))
    assert 6 < released < 5 + late
    entered = true_at(view("place_in_onset", "mug", "cabinet"))
    assert entered == [2]
    inside, outside = view("obj_inside", "mug", "cabinet"), view("obj_outside", "mug", "cabinet")
    assert not (inside | outside)[2 : 5 + late].any()
    assert (inside if then > 0 else outside)[5 + late :].all()
    assert view.evidence("obj_inside", ("mug", "cabinet"), released) == [
        "4 of 8 corners of mug were inside cabinet"
    ]


def test_a_rod_that_sticks_through_is_not_outside_though_no_corner_is_inside():
    rod = dataclasses.replace(toy.SCENE.bodies[0], half=(0.02, 0.5, 0.02))
    scene = dataclasses.replace(toy.SCENE, bodies=(rod, toy.SCENE.bodies[1]))
    view = look(film(1, scene=scene, object_pose=moved("mug", INSIDE)))
    assert not view("obj_outside", "mug", "cabinet")[0]


@pytest.mark.parametrize(
    ("policy", "crossed_out"),
    [("scripted", False), ("scripted:half_inside", True)],
)
def test_the_fault_releases_half_inside_and_the_expert_does_not(rollouts, policy, crossed_out):
    view = rollouts.get("PickPlaceCounterToCabinet", policy).judge.view
    cabinet = next(iter(view.binding.enclosures))
    entered = true_at(view("place_in_onset", "obj", cabinet))
    released = true_at(view("obj_released", "obj"))
    inside = view("obj_inside", "obj", cabinet)
    outside = view("obj_outside", "obj", cabinet)
    assert entered
    assert entered[0] < released[0]
    assert outside[: entered[0]].all()
    assert (not inside[entered[0] : released[0] + 1].any()) == crossed_out
