"""Pairs that have touched since the first step, and could be a collision."""

from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.propositions.kernels.at_start import AtStart, fresh
from tests import toy
from tests.propositions.stage import film, look, touch

LEFT, RIGHT, LINK, COUNTER, DOOR, MUG, APPLE = range(7)
NAMES = [f"{part.entity}/{part.name}" for part in toy.PARTS]
SUPPORTS = {"mug": frozenset({"counter"}), "apple": frozenset({"counter", "mug"})}


def rows(steps, a, b, force=6.0):
    return touch(steps, NAMES[a], NAMES[b], force)


def lasting(length, *contacts, **changed):
    """For each step, the pairs that have touched since the first one."""
    view = look(film(length, *contacts, **changed), supports=SUPPORTS)
    codes = AtStart(view).advance(view)
    return [{divmod(code, len(NAMES)) for code in row.tolist() if code != -1} for row in codes]


@pytest.mark.parametrize(
    ("a", "b", "matters"),
    [
        (LINK, COUNTER, True),  # the robot's
        (LEFT, MUG, True),
        (MUG, DOOR, True),  # what is no support of the mug
        (COUNTER, MUG, False),
        (APPLE, COUNTER, False),
        (MUG, APPLE, True),  # a support of the apple, but the apple is none of the mug
        (COUNTER, DOOR, False),  # nobody's
    ],
)
def test_only_what_could_be_a_collision_matters(a, b, matters):
    assert lasting(1, rows([0], a, b)) == [{(min(a, b), max(a, b))} if matters else set()]


def test_it_lasts_until_it_breaks_and_does_not_come_back():
    found = lasting(6, rows([0, 1, 2, 4, 5], LINK, COUNTER), rows(range(6), RIGHT, COUNTER))
    both, one = {(LINK, COUNTER), (RIGHT, COUNTER)}, {(RIGHT, COUNTER)}
    assert found == [both, both, both, one, one, one]


def test_what_begins_later_has_not_been_there_since_the_start():
    assert lasting(4, rows([1, 2, 3], LINK, COUNTER)) == [set()] * 4


def test_any_contact_of_the_pair_keeps_it_whichever_side_is_named_first():
    found = lasting(3, rows([0, 1], LINK, COUNTER, 0.01), rows([1, 2], COUNTER, LINK))
    assert found == [{(LINK, COUNTER)}] * 3


@pytest.mark.parametrize("cut", [1, 2, 3, 4])
def test_in_pieces_it_is_what_it_is_at_once(cut):
    contacts = rows([0, 1, 2, 4], LINK, COUNTER), rows(range(5), DOOR, LEFT)
    whole, first, rest = (
        look(film(n, *(row_of(c, start, start + n) for c in contacts)), supports=SUPPORTS)
        for start, n in ((0, 5), (0, cut), (cut, 5 - cut))
    )
    fold = AtStart(first)
    pieces = np.concatenate((fold.advance(first), fold.advance(rest)))
    assert pieces.tolist() == AtStart(whole).advance(whole).tolist()


def row_of(contacts, first, stop):
    """Contacts of some steps, counted from the first of them."""
    return [(step - first, *row) for step, *row in contacts if first <= step < stop]


def test_the_force_of_a_pair_counts_once_it_is_fresh():
    view = look(film(4, rows([0, 1, 3], LINK, COUNTER)), supports=SUPPORTS)
    since = AtStart(view).advance(view)
    force = np.float32([6.0, 6.0, 0.0, 6.0])
    assert fresh(view.trace, (LINK, COUNTER), force, since).tolist() == [0.0, 0.0, 0.0, 6.0]
    assert fresh(view.trace, (LEFT, COUNTER), force, since).tolist() == force.tolist()
