"""Who presses on what: carriers are the hand (0), the mug (1) and the apple (2)."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.propositions.kernels.presses import Presses, PressingParts, carriers
from tests import toy
from tests.propositions.stage import film, look, touch

LEFT, RIGHT, LINK, COUNTER, DOOR, MUG, APPLE = range(7)
"""Parts of the toy scene, in order."""
NAMES = [f"{part.entity}/{part.name}" for part in toy.PARTS]


def pressing(length, *rows, **changed):
    return Presses(look(film(length, *rows, **changed)))


def press(steps, a, b, force=2.0, at=toy.PLACE):
    return touch(steps, NAMES[a], NAMES[b], force, at=at)


def test_the_hand_and_the_objects_are_carriers():
    assert carriers(look(film(1))) == ("robot", "mug", "apple")


@pytest.mark.parametrize(("force", "counts"), [(0.5, True), (0.49, False)])
def test_half_a_newton_is_a_press(force, counts):
    assert pressing(1, press([0], COUNTER, MUG, force)).parts(0) == [(COUNTER, MUG)] * counts


@pytest.mark.parametrize(
    ("a", "b", "concerns"),
    [
        (LEFT, MUG, True),
        (MUG, APPLE, True),
        (APPLE, COUNTER, True),
        (DOOR, RIGHT, True),
        (LEFT, RIGHT, False),  # the hand itself
        (LINK, MUG, False),  # the arm is no carrier, and no surface
        (LINK, COUNTER, False),
        (COUNTER, DOOR, False),
    ],
)
def test_a_press_concerns_a_carrier_and_what_is_not_the_robots_arm(a, b, concerns):
    pair = min(a, b), max(a, b)
    assert pressing(1, press([0], a, b)).parts(0) == [pair] * concerns


def test_parts_are_those_of_a_step_in_order_and_once():
    rows = press([0, 2], MUG, APPLE), press([0, 1], LEFT, MUG), press([0], COUNTER, MUG)
    found = pressing(4, *rows, press([0], MUG, LEFT))
    assert found.parts(0) == [(LEFT, MUG), (COUNTER, MUG), (MUG, APPLE)]
    assert found.parts(1) == [(LEFT, MUG)]
    assert found.parts(2) == [(MUG, APPLE)]
    assert found.parts(3) == []


def test_what_touches_before_a_step_is_any_pair_however_lightly():
    found = pressing(4, press([0], MUG, COUNTER, 0.01), press([2], APPLE, COUNTER))
    assert found.touching(0) == set()
    assert found.touching(2) == {(COUNTER, MUG)}
    assert found.touching(3) == {(COUNTER, MUG), (COUNTER, APPLE)}


def test_the_next_step_at_which_other_parts_press():
    rows = press([0, 1, 2, 5], COUNTER, MUG), press([1, 2, 3, 4], COUNTER, APPLE)
    found = pressing(7, *rows)
    # mug; both; both; apple; apple; mug; nothing
    assert [found.until(step) for step in range(7)] == [1, 3, 3, 5, 5, 6, 7]


def test_as_many_other_parts_are_other_parts_too():
    found = pressing(3, press([0], COUNTER, MUG), press([1, 2], COUNTER, APPLE))
    assert [found.until(step) for step in range(3)] == [1, 3, 3]


def test_whose_parts_they_are():
    found = pressing(1, press([0], COUNTER, MUG))
    assert found.press((LEFT, APPLE)) == PressingParts((0, 2))
    assert found.press((MUG, APPLE)) == PressingParts((1, 2))
    assert found.press((COUNTER, MUG)) == PressingParts(None, carrier=1, surface=COUNTER)
    assert found.press((RIGHT, DOOR)) == PressingParts(None, carrier=0, surface=DOOR)


def test_the_lower_carrier_comes_first_whichever_part_does():
    parts = tuple(toy.PARTS[n] for n in (APPLE, MUG, COUNTER, LEFT, RIGHT))
    view = look(film(1, scene=dataclasses.replace(toy.SCENE, parts=parts)))
    found = Presses(view)
    assert found.press((0, 1)) == PressingParts((1, 2))
    assert found.press((1, 3)) == PressingParts((0, 1))
    assert found.press((2, 3)) == PressingParts(None, carrier=0, surface=2)


def test_a_place_has_the_points_of_its_pair_at_its_steps():
    mug = [(0.0, 0.0, 0.9), (0.1, 0.0, 0.9), (0.2, 0.0, 0.9), (0.3, 0.0, 0.9)]
    rows = [
        *press(range(4), COUNTER, MUG, at=mug),
        *press(range(4), COUNTER, MUG, at=[(x, 0.05, z) for x, _, z in mug]),
        *press(range(4), COUNTER, APPLE, at=(0.4, 0.0, 0.9)),
    ]
    found = pressing(4, rows)
    on_counter = found.press((COUNTER, MUG))
    assert found.parts(1) == [(COUNTER, MUG), (COUNTER, APPLE)]
    one = sorted(found.place(0, on_counter, 1, 2).points.tolist())
    assert np.array(one) == pytest.approx(np.array([(0.1, 0, 0.9), (0.1, 0.05, 0.9)]))
    some = found.place(0, on_counter, 1, 3)
    assert len(some.points) == 4
    assert (some.low, some.high) == (
        pytest.approx((0.1, 0, 0.9)),
        pytest.approx((0.2, 0.05, 0.9)),
    )
    apple = found.place(1, found.press((COUNTER, APPLE)), 0, 4)
    assert apple.points == pytest.approx(np.tile((0.4, 0, 0.9), (4, 1)))


def test_what_a_joint_moves_is_one_place_wherever_it_is_touched():
    found = pressing(2, press([0, 1], DOOR, MUG, at=[(1, 2, 3), (4, 5, 6)]))
    on_door = found.press((DOOR, MUG))
    here, there = (found.place(0, on_door, step, step + 1) for step in (0, 1))
    assert here.points.tolist() == there.points.tolist()
