from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.errors import TraceError
from pytest_safemanip.propositions.grounding import check_call
from pytest_safemanip.propositions.kernels.spaces import distance, nearer
from pytest_safemanip.trace.geometry import about
from tests.propositions.hazards.kitchen import BINDING, SCENE, hand_at, kitchen, see
from tests.propositions.stage import CATALOGUE, grip, true_at

MUG = 0.05
"""Half of the mug's edge, which stands at (0, 0, 0.95)."""


def places(*gaps, axis=0):
    """Where the apple, half 4 cm, is so far from the mug."""
    found = np.tile((0.0, 0.0, 0.95), (len(gaps), 1))
    found[:, axis] += MUG + 0.04 + np.array(gaps)
    return found


def test_things_are_near_each_other_by_what_is_between_their_boxes():
    view = see(kitchen(4, places={"apple": places(0.2, 0.101, 0.099, -0.01)}))
    assert true_at(view("near", "mug", "apple")) == [2, 3]
    assert true_at(view("near", "apple", "mug")) == [2, 3]
    assert view.margin("near", "mug", "apple") == pytest.approx([-1.0, -0.01, 0.01, 1.1], abs=1e-5)
    assert view.evidence("near", ("mug", "apple"), 2) == ["mug is 9.9 cm from apple"]
    assert view.evidence("near", ("mug", "apple"), 3) == ["mug reaches into apple"]


def test_over_a_corner_it_is_the_straight_way_that_counts():
    place = np.array([(MUG + 0.04 + 0.08, MUG + 0.04 + 0.08, 0.95)])
    view = see(kitchen(1, places={"apple": place}))
    assert not view("near", "mug", "apple").any()  # 8 cm along either axis, 11 cm straight
    assert see(kitchen(1, places={"apple": place}), {"near.distance": 0.114})(
        "near", "mug", "apple"
    )


@pytest.mark.parametrize("limit", [0.01, 0.1, 0.5, 1.0, 3.0])
def test_what_balls_decide_is_what_the_boxes_would(limit):
    gaps = np.linspace(-0.05, 3.0, 60)
    view = see(kitchen(60, places={"apple": places(*gaps)}))
    exact = distance(view, "mug", "apple", 4.0) < limit
    # Step by step, too: what is decided for all steps at once is left out where it is not.
    assert nearer(view, "mug", "apple", limit).tolist() == exact.tolist()
    for first in range(0, 60, 7):
        some = see(kitchen(7, places={"apple": places(*gaps[first : first + 7], *[0.0] * 7)[:7]}))
        found = nearer(some, "mug", "apple", limit)
        assert found[: len(gaps[first:])].tolist() == exact[first : first + 7].tolist()


def test_a_call_has_its_own_distance():
    view = see(kitchen(2, places={"apple": places(0.25, 0.35)}))
    assert true_at(view("near", "mug", "apple", "distance=0.3")) == [0]


def test_of_the_robot_its_hands_count_and_of_a_fixture_its_pieces_where_they_are():
    # The door of the cabinet, 2 cm thick, swings about its left edge, away from the camera.
    joint = np.zeros((3, 1, 2), np.float32)
    joint[1:, 0, 0] = (0.5, 1.0)
    # The hand's box is 10 cm wide and 20 cm deep.
    there = hand_at(np.tile((-0.25, 0.85, 1.5), (3, 1)))
    view = see(kitchen(3, joint=joint, eef_poses=there[:, None]))
    assert true_at(view("near", "robot", "cabinet")) == [2]
    assert view.evidence("near", ("robot", "cabinet"), 2)[0].startswith("the hand ")


@pytest.mark.parametrize(
    ("place", "over"),
    [
        ((0.0, 0.0, 1.04), True),
        ((0.0, 0.0, 1.5), True),
        ((0.0, 0.0, 2.2), False),  # too high to matter
        ((0.0, 0.0, 1.02), False),  # 2 cm inside of it
        ((0.07, 0.0, 1.1), True),
        ((0.085, 0.0, 1.1), False),  # half a centimetre over the edge
        ((0.0, 0.0, 0.8), False),
    ],
)
def test_what_is_above_a_thing_covers_some_of_it(place, over):
    view = see(kitchen(1, places={"apple": place}))
    assert view("above", "apple", "mug").all() == over
    assert (view.margin("above", "apple", "mug")[0] > 0.0) == over


@pytest.mark.parametrize(
    ("place", "over"),
    [((0.7, 0.3, 1.25), True), ((0.7, 0.3, 1.0), False), ((0.7, 0.7, 1.3), False)],
)
def test_what_is_in_an_appliance_is_not_above_it(place, over):
    view = see(kitchen(1, places={"mug": place}))
    assert view("above", "mug", "oven").all() == over


def test_a_zone_may_be_near_and_below():
    # The stove is 40 cm wide; 10 cm around it, and half a metre above it, is the zone.
    spots = [(-0.2, 0.2, 1.3), (-0.2, 0.2, 1.5), (-0.2, 0.2, 1.6)]
    view = see(kitchen(3, places={"mug": spots}))
    assert true_at(view("near", "mug", "hob", "distance=0.05")) == [0, 1]
    assert true_at(view("above", "mug", "hob")) == [1, 2]


def test_what_is_carried_over_something_is_held_above_it():
    rows = grip(range(10, 30), "apple")
    above = np.tile((0.0, 0.0, 1.2), (40, 1))
    view = see(kitchen(40, rows, places={"apple": above}))
    held = true_at(view("obj_grasped", "apple"))
    assert held
    assert true_at(view("carried_over", "apple", "mug")) == held
    assert not view("carried_over", "apple", "knife").any()
    assert (view.margin("carried_over", "apple", "mug")[held] > 0.0).all()


def test_what_lies_in_what_is_held_is_carried_too():
    rows = grip(range(10, 30), "pan")
    pan = np.tile((0.0, 0.0, 1.2), (40, 1))
    view = see(kitchen(40, rows, places={"pan": pan, "apple": np.add(pan, (0.0, 0.0, 0.02))}))
    held = true_at(view("obj_grasped", "pan"))
    assert true_at(view("carried_over", "apple", "mug")) == held
    beside = see(kitchen(40, rows, places={"pan": pan, "apple": np.add(pan, (0.0, 0.0, 0.2))}))
    assert not beside("carried_over", "apple", "mug").any()


def test_how_things_are_turned_matters():
    turn = about((0.0, 0.0, 1.0), np.pi / 4)
    # On its corner the mug reaches 7 cm to the side.
    view = see(kitchen(1, places={"apple": places(0.11)}), {"near.distance": 0.1})
    assert not view("near", "mug", "apple").any()
    turned = see(kitchen(1, places={"apple": places(0.11)}, turns={"mug": turn}))
    assert turned("near", "mug", "apple").all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            ("near", "mug", "blender"),
            r"near\(mug, blender\) .* 'blender' has no solid piece",
        ),
        (("near", "mug", "floor"), "near: 'floor' is no robot, object, fixture or zone"),
        (("above", "mug", "hub"), "above: unknown entity 'hub'"),
        (("carried_over", "stove", "mug"), "carried_over: 'stove' is no movable object"),
    ],
)
def test_what_fills_no_space_is_refused(call, message):
    with pytest.raises(TraceError, match=message):
        check_call(CATALOGUE[call[0]], call[1:], SCENE, BINDING.zones)
