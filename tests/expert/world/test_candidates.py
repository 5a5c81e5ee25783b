"""The first free candidate is taken, and where there is none the nearest miss is told."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.world.candidates import Candidates
from pytest_safemanip.expert.world.ways import Leg
from pytest_safemanip.sim.clearance import Clearance, Touch
from tests import toy

HERE = np.array((0.4, 0.0, 1.1))
TOUCH = Touch("palm", "cab", "door", (0.5, 0.0, 1.0), 0.02)
COSTS = np.array((0.3, 0.1, 0.2))


def _answer(waypoint, touch):
    return Clearance(waypoint, touch, 0.0, 0.0, 0.04, np.zeros(7), np.zeros(7))


def _free(number, *answers, refine=np.zeros_like, then=None):
    answers = list(answers)
    arm = Arm(toy.SCENE, toy.at_rest(), "", lambda paths: [answers.pop(0)])
    found = Candidates(COSTS, 9.0 * np.eye(3), 3, np.arange(3), refine)
    taken = found.free(number, arm, lambda n: ([Leg(HERE + 0.1 * n)], 1.0), (), "the knob", then)
    assert not answers
    return taken


def test_the_cheapest_free_one_is_taken():
    assert _free(0, _answer(0, TOUCH), _answer(1, None)) == 2


def test_others_that_are_free_come_after_it():
    assert _free(1, *[_answer(1, None)] * 2) == 2


@pytest.mark.parametrize(
    ("number", "stops", "taken"),
    [(0, {1: 3, 2: None}, 2), (0, {1: 3, 2: 5, 0: 4}, 2), (1, {1: 3, 2: 5, 0: 4}, 0)],
    ids=["one to the end", "the farthest", "the next farthest"],
)
def test_one_from_which_it_is_free_to_the_end_comes_first_then_those_from_where_it_is_farthest(
    number, stops, taken
):
    free = [_answer(1, None)] * len(stops)
    assert _free(number, *free, then=stops.__getitem__) == taken


def test_a_closer_look_may_change_the_order():
    assert _free(0, _answer(1, None), refine=lambda numbers: 1.0 * (numbers != 0)) == 0


def test_where_none_is_free_the_error_tells_what_stops_the_way_that_comes_farthest():
    nearer = dataclasses.replace(TOUCH, own="link5")
    reason = "no way to the knob: link5 meets door of cab 20 mm deep"
    with pytest.raises(SkillFailed, match=reason):
        _free(0, _answer(0, TOUCH), _answer(1, nearer), _answer(0, TOUCH))
