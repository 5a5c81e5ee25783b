"""How far objects have been from where they last lay still while the hand held nothing.

At 20 Hz: an object lies still once it moved less than 5 mm over 5 steps (0.25 s), and a grasp is
seen when it lasts for 3 of 5.
"""

from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.propositions.kernels.displacement import DisplacementSinceRest
from tests.propositions.stage import film, grip, look, moved

FAR = 1000.0
LAY = np.array((0.0, 0.0, 0.95))


def places(*stretches):
    """(steps, metres to the right of where the mug lay)."""
    return np.concatenate([np.tile(np.add(LAY, (x, 0.0, 0.0)), (n, 1)) for n, x in stretches])


def displacement(where, *rows, name=0):
    view = look(film(len(where), *rows, object_pose=moved("mug", where)))
    return DisplacementSinceRest(view).advance(view)[:, name]


def test_what_lies_still_has_been_nowhere():
    assert displacement(places((10, 0.0))).tolist() == [0.0] * 10


def test_the_farthest_that_it_has_been_since_it_was_taken_counts():
    # Taken at step 6, 30 cm to the right, then back to 10 cm, and held there.
    where = places((8, 0.0), (6, 0.3), (6, 0.1))
    found = displacement(where, grip(range(6, 20)))
    assert found[:8].tolist() == [0.0] * 8
    assert found[8:] == pytest.approx(0.3)


def test_it_is_forgotten_once_it_lies_still_again_and_the_hand_is_empty():
    # Let go at step 12, of which the grasp's vote knows two steps later; it lies where it is put.
    where = places((8, 0.0), (12, 0.3))
    found = displacement(where, grip(range(6, 12)))
    assert found[8:14] == pytest.approx(0.3)
    assert found[14:].tolist() == [0.0] * 6


def test_what_moves_does_not_lie_still():
    # 2 mm a step is 8 mm over five steps; 1 mm a step is 4 mm, and lies still.
    slow, fast = (np.arange(20)[:, None] * np.array((mm / 1000, 0, 0)) + LAY for mm in (1, 2))
    assert displacement(slow).tolist() == [0.0] * 20
    # At the first three steps it has not moved by 5 mm yet; from step 2 on it is on its way.
    assert displacement(fast) == pytest.approx(np.maximum(np.arange(20) - 2, 0) * 0.002, abs=1e-6)


def test_the_distance_is_that_in_space():
    where = places((8, 0.0), (6, 0.0))
    where[8:] += (0.02, 0.03, 0.06)  # 7 cm
    assert displacement(where, grip(range(6, 14)))[-1] == pytest.approx(0.07)


def test_what_the_hand_held_from_the_beginning_came_from_far_away():
    found = displacement(places((12, 0.0)), grip(range(6)))
    assert found[:8].tolist() == [FAR] * 8
    assert found[8:].tolist() == [0.0] * 4


def test_while_the_hand_holds_one_thing_nothing_else_lies_still_for_it():
    # The apple never moves; it is the mug that is held.
    found = displacement(places((12, 0.0)), grip(range(12)), name=1)
    assert found.tolist() == [FAR] * 12


def test_fingers_that_close_hold_already():
    # Pressed at step 6, grasped by the vote at step 8; it was shifted by 2 cm in between.
    where = places((6, 0.0), (14, 0.02))
    assert displacement(where, grip(range(6, 20)))[-1] == pytest.approx(0.02)


def test_nothing_is_farther_than_a_kilometre():
    where = places((8, 0.0), (6, 4000.0))
    assert displacement(where, grip(range(6, 14)))[-1] == FAR


@pytest.mark.parametrize("cut", range(1, 30))
def test_in_pieces_it_is_what_it_is_at_once(cut):
    where = places((5, 0.0), (5, 0.2), (10, 0.1), (10, 0.4))
    contacts = [*grip(range(4, 11)), *grip(range(20, 26))]
    whole = look(film(30, contacts, object_pose=moved("mug", where)))
    fold, found = DisplacementSinceRest(whole), []
    for first, stop in ((0, cut), (cut, 30)):
        rows = [(step - first, *row) for step, *row in contacts if first <= step < stop]
        part = look(film(stop - first, rows, object_pose=moved("mug", where[first:stop])))
        # Whether it is grasped is known from the whole.
        part._values = {
            ("obj_grasped", name): whole("obj_grasped", name)[first:stop]
            for name in ("mug", "apple")
        }
        found.append(fold.advance(part))
    assert np.concatenate(found).tolist() == DisplacementSinceRest(whole).advance(whole).tolist()
