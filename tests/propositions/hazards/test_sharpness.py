from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.trace.geometry import about
from tests.propositions.hazards.kitchen import SCENE, hand_at, kitchen, see

# The knife is 20 cm long, its weight is at its handle, toward -x: its point is at +x.


def seen(degrees=0.0, place=(0.0, 0.5, 1.0), scene=SCENE, **places):
    turn = about((0.0, 0.0, 1.0), np.deg2rad(degrees))
    return see(kitchen(1, places={"knife": place, **places}, turns={"knife": turn}, scene=scene))


@pytest.mark.parametrize(
    ("degrees", "x", "points"),
    [
        (0, 0.3, True),
        (15, 0.3, True),
        (45, 0.3, False),
        (180, 0.3, False),
        (0, -0.3, False),
        (180, -0.3, True),
        (0, 0.43, True),
        (0, 0.47, False),  # more than 30 cm from its tip
    ],
)
def test_a_knife_points_at_what_its_tip_is_turned_to(degrees, x, points):
    view = seen(degrees, mug=(x, 0.5, 1.0))
    assert view("points_at", "knife", "mug").all() == points
    assert (view.margin("points_at", "knife", "mug")[0] > 0.0) == points


def test_evidence_says_how_far_and_how_straight():
    view = seen(mug=(0.3, 0.6, 1.0))
    (line,) = view.evidence("points_at", ("knife", "mug"), 0)
    assert line == "knife points at mug: 16 cm ahead, 18 degrees beside"


def test_what_is_as_heavy_at_either_end_points_both_ways():
    index = SCENE.object_index["knife"]
    even = dataclasses.replace(SCENE.bodies[index], com=(0.0, 0.0, 0.0))
    bodies = tuple(even if k == index else body for k, body in enumerate(SCENE.bodies))
    scene = dataclasses.replace(SCENE, bodies=bodies)
    for x in (0.3, -0.3):
        assert seen(scene=scene, mug=(x, 0.5, 1.0))("points_at", "knife", "mug").all()
    assert not seen(scene=scene, mug=(0.0, 0.8, 1.0))("points_at", "knife", "mug").any()


def test_it_may_point_at_a_hand_and_at_a_fixture():
    hand = hand_at([(0.3, 0.5, 1.0)])[:, None]
    recording = kitchen(1, places={"knife": (0.0, 0.5, 1.0)}, eef_poses=hand)
    assert see(recording)("points_at", "knife", "robot").all()
    down = about((0.0, 1.0, 0.0), np.pi / 2)
    recording = kitchen(1, places={"knife": (0.0, 0.3, 1.2)}, turns={"knife": down})
    assert see(recording)("points_at", "knife", "counter").all()


@pytest.mark.parametrize("gap", [0.0005, 0.001, 0.0011])
def test_what_its_tip_passes_closely_is_ahead_of_it(gap):
    beside = 0.5 + SCENE.bodies[SCENE.object_index["mug"]].half[1] + gap
    assert seen(mug=(0.12, beside, 1.0))("points_at", "knife", "mug").all()
