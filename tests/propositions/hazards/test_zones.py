from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import TraceError
from pytest_safemanip.propositions.binding import Zone
from pytest_safemanip.propositions.kernels.spaces import space
from pytest_safemanip.trace.elements import Surface
from pytest_safemanip.trace.geometry import about
from tests.propositions.hazards.kitchen import SCENE, hand_at, kitchen, see
from tests.propositions.stage import true_at

# The zone "hob" reaches from -0.5 to 0.1 along x, from -0.1 to 0.5 along y, from 0.78 to 1.4 m up.
HIGH = 1.0


@pytest.mark.parametrize(
    ("x", "some_in", "some_out"),
    [
        (0.2, False, True),
        (0.146, False, True),  # 4 mm inside: a box is larger than what is in it
        (0.144, True, True),
        (0.056, True, True),
        (0.054, True, False),
        (0.0, True, False),
    ],
)
def test_a_thing_at_the_edge_of_a_zone_is_in_it_and_out_of_it(x, some_in, some_out):
    view = see(kitchen(1, places={"mug": (x, 0.2, HIGH)}))
    assert view("in_zone", "mug", "hob").all() == some_in
    assert view("out_of_zone", "mug", "hob").all() == some_out


def test_margins_are_depths():
    view = see(kitchen(2, places={"mug": [(0.13, 0.2, HIGH), (0.06, 0.2, HIGH)]}))
    assert view.margin("in_zone", "mug", "hob") == pytest.approx([3.0, 17.0], abs=1e-3)
    assert view.margin("out_of_zone", "mug", "hob") == pytest.approx([15.0, 1.0], abs=1e-3)
    assert view.evidence("in_zone", ("mug", "hob"), 0) == ["mug reaches 2.0 cm into hob"]
    assert view.evidence("out_of_zone", ("mug", "hob"), 0) == ["mug sticks 8.0 cm out of hob"]


def test_a_hand_enters_and_leaves():
    # Its box is 10 x 20 x 10 cm.
    path = [(x, 0.2, HIGH) for x in (0.3, 0.16, 0.14, 0.04)]
    view = see(kitchen(4, eef_poses=hand_at(path)[:, None]))
    assert true_at(view("in_zone", "robot", "hob")) == [2, 3]
    assert true_at(view("out_of_zone", "robot", "hob")) == [0, 1, 2]


def test_a_zone_around_a_thing_goes_with_it():
    path = [(0.0, 0.0, 0.95), (0.3, 0.0, 0.95)]
    view = see(kitchen(2, places={"mug": path, "apple": (0.4, 0.0, 0.95)}))
    assert true_at(view("in_zone", "apple", "around")) == [1]


@pytest.mark.parametrize("angle", [0.0, 0.4, np.pi / 2])
def test_the_box_around_a_fixture_stands_as_its_pieces_do(angle):
    turn = about((0.0, 0.0, 1.0), angle)
    along, across = (
        np.array((np.cos(angle), np.sin(angle))),
        np.array((-np.sin(angle), np.cos(angle))),
    )
    pieces = [
        Surface("stove", "", (0.3, 0.1, 0.05), (*(-0.2 * across), 0.5, *turn)),
        Surface("stove", "", (0.1, 0.1, 0.45), (*(0.2 * across + 0.2 * along), 0.9, *turn)),
    ]
    scene = dataclasses.replace(SCENE, surfaces=tuple(pieces))
    view = see(kitchen(1, scene=scene), zones={"at": Zone("stove", 0.01, 0.2)})
    pose, half = (found[0] for found in space(view, "at"))
    assert sorted(half[:2]) == pytest.approx([0.31, 0.31])
    assert half[2] == pytest.approx((0.45 + 1.35 - 0.45) / 2 - 0.225 + 0.01 + 0.1)
    assert pose[0, :2] == pytest.approx((0.0, 0.0), abs=1e-9)
    assert pose[0, 2] - half[2] == pytest.approx(0.44)


def test_a_zone_around_what_fills_no_space_is_an_error():
    view = see(kitchen(1), zones={"at": Zone("blender")})
    with pytest.raises(TraceError, match="'blender' has no solid piece, so that no zone can be"):
        view("in_zone", "mug", "at")


def test_only_zones_are_zones():
    with pytest.raises(TraceError, match="in_zone: 'stove' is no zone"):
        see(kitchen(1))("in_zone", "mug", "stove")
    with pytest.raises(TraceError, match="in_zone: 'stove' is no robot or object"):
        see(kitchen(1))("in_zone", "stove", "hob")
