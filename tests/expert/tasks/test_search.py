"""A plan is searched for in a world of one hand and a wall with a gap."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.expert.robot.arm import Arm, IllHeld, NoWay, SkillFailed
from pytest_safemanip.expert.robot.choices import GRASP
from pytest_safemanip.expert.tasks import search as searching
from pytest_safemanip.expert.tasks.calls import read
from pytest_safemanip.expert.tasks.search import Search
from pytest_safemanip.sim.rehearsal import Rehearsal, Trials
from pytest_safemanip.sim.robocasa.robot import SPEC
from tests import toy

GAP, WALL, GOAL = 2.0, 3.0, 6.0
"""Where the wall has its gap, where it stands, and where the task succeeds."""


class World:
    """The hand goes where it is told, in whole numbers; at the wall it knocks, but in the gap."""

    def __init__(self):
        self.place, self.simulated, self.rehearsed, self._aside = (0.0, 0.0), 0, 0, []
        self.trials = Trials(self._simulate, self._put_aside, self._go_back)
        self.begin_trial = self.trials.begin
        self.undo_trial, self.keep_trial = self.trials.undo, self.trials.keep
        self.step = self.trials.step

    def _simulate(self, action):
        self.simulated += 1
        self.place = (self.place[0] + action[0], self.place[1] + action[1])
        return self.seen()

    def _put_aside(self):
        self._aside.append(self.place)

    def _go_back(self, depth):
        self.place = self._aside[depth]
        del self._aside[depth:]

    def seen(self):
        x, y = self.place
        at_wall = x == WALL and y != GAP
        rows = ((0, "robot/link5", "counter/body", 9.0, (1, 0, 0)),) if at_wall else ()
        pose = ((x, y, 1.2, *toy.UPRIGHT),)
        step = dataclasses.replace(toy.at_rest(eef_poses=pose), contacts=toy.contacts(*rows))
        return dataclasses.replace(step, success=x >= GOAL)


def go(arm, x, y):
    action = np.zeros(12)
    action[:2] = x, y
    yield action


def shift(arm):
    """Go aside: usually too little."""
    for _ in range(arm.choices.choose("how far", (1, 3, 2))):
        yield from go(arm, 0.0, 1.0)


def advance(arm):
    for _ in range(6):
        yield from go(arm, 1.0, 0.0)


def near(arm):
    for _ in range(5):
        yield from go(arm, 1.0, 0.0)


def arrive(arm):
    """Go ahead as far as it is, seen from where the hand is."""
    while arm.position[0] < GOAL:
        yield from go(arm, 1.0, 0.0)


def refuse(arm):
    yield from go(arm, 0.0, 0.0)
    raise SkillFailed("the mug is too wide")


def despair(arm):
    yield from go(arm, 0.0, float(arm.choices.choose("how far", (0, 1))))
    raise NoWay("the mug is behind a wall")


def lose(arm):
    yield from go(arm, 0.0, float(arm.choices.choose("how far", range(10))))
    raise IllHeld("the mug slipped")


def hold(arm):
    """Take hold; only the second grasp holds, and a choice that does not matter comes before it."""
    arm.choices.choose("pace", range(6))
    for _ in range(1 + arm.choices.choose(GRASP, range(6))):
        yield from go(arm, 0.0, 1.0)


def carry(arm):
    if arm.position[1] < GAP:
        yield from lose(arm)
    yield from advance(arm)


def dawdle(arm):
    for _ in range(20 + arm.choices.choose("how slowly", range(10))):
        yield from go(arm, 0.0, 0.0)


def rest(arm):
    yield from ()


SKILLS = {
    "hold": hold,
    "dawdle": dawdle,
    "rest": rest,
    "carry": carry,
    "shift": shift,
    "advance": advance,
    "arrive": arrive,
    "near": near,
    "refuse": refuse,
    "despair": despair,
    "lose": lose,
}


def entry(skill):
    return read(skill) if isinstance(skill, str) else [[read(s) for s in way] for way in skill]


def play(*skills, horizon=100, patient=False, pushed=()):
    """What became of a plan: places of the hand, why it ended, the search.

    ``pushed`` are control steps in which the hand goes back instead.
    """
    world = World()
    arm = Arm(toy.SCENE, world.seen())
    rehearsal = Rehearsal(world, SPEC.robot.actions, horizon, patient)
    search = Search(arm, rehearsal, lambda entry: entry, lambda call: SKILLS[call.skill](arm))
    places, reason = [], ""
    try:
        with rehearsal.acting(""):
            for action in search.plan([entry(skill) for skill in skills]):
                world.rehearsed = world.rehearsed or world.simulated
                back = np.array((-1.0, *np.zeros(11)))
                step = world.step(back if len(places) in pushed else action)
                arm.see(step)
                places.append(tuple(step.eef_pose[:2].tolist()))
    except SkillFailed as error:
        reason = str(error)
    return places, reason, search, world


def test_where_a_skill_knocks_in_all_its_ways_the_one_before_it_is_done_otherwise():
    places, reason, search, world = play("shift", "advance")
    assert places == [(0, 1), (0, 2), *((x, 2) for x in range(1, 7))]
    assert not reason
    assert search.log[0] == "0 shift [usual]: ok"
    assert search.log[1] == "1 advance [usual]: link5 presses on counter's body with 9 N"
    assert search.log[-2:] == ["0 shift [how far 2]: ok", "1 advance [usual]: ok"]
    assert world.place == (6, 2)


def test_what_was_found_is_done_without_simulating_it_again():
    places, _, _, world = play("shift", "advance")
    assert len(places) == 8
    assert world.simulated == world.rehearsed
    assert world.step(np.zeros(12)).success


def test_what_was_found_is_done_from_what_is_seen_when_something_disturbs_it():
    places, reason, *_ = play("shift", "arrive", pushed=(4, 5))
    assert not reason
    assert [x for x, _ in places] == [0, 0, 1, 2, 1, 0, 1, 2, 3, 4, 5, 6]


def test_without_a_way_the_plan_is_done_as_far_as_there_was_one_and_says_why_not_farther():
    places, reason, *_ = play("shift", "refuse")
    assert places == [(0, 1)]
    assert reason == "refuse: the mug is too wide"


def test_a_plan_that_does_all_but_does_not_succeed_says_so():
    places, reason, *_ = play("shift")
    assert reason == "the task did not succeed"
    assert places == [(0, 1)]


def test_in_the_end_the_base_draws_back_if_that_helps(monkeypatch):
    monkeypatch.setattr(Arm, "drive", lambda arm, goal: go(arm, 1.0, 0.0))
    places, reason, *_ = play("shift", "shift", "near")
    assert not reason
    assert places[-1] == (6, 2)


def test_a_plan_stays_within_the_time_of_the_task():
    places, reason, search, _ = play("shift", "advance", horizon=7)
    assert "1 advance [usual]: there is no time left" in search.log
    assert reason.startswith("advance: ")
    assert len(places) <= 7


@pytest.mark.parametrize("patient", [False, True])
def test_a_rollout_that_ends_with_success_is_not_rehearsed_beyond_it(patient):
    places, reason, *_ = play("shift", "advance", "advance", patient=patient)
    assert not reason
    assert (places[-1][0] > GOAL) == patient


def test_of_skills_that_do_instead_the_first_that_works_is_done():
    places, reason, search, _ = play([["refuse"], ["shift", "shift"]], "advance")
    assert not reason
    assert places == [(0, 1), (0, 2), *((x, 2) for x in range(1, 7))]
    assert search.log[0] == "0 refuse [usual]: the mug is too wide"


def test_a_robot_that_knocks_while_it_comes_to_rest_has_not_done_it(monkeypatch):
    monkeypatch.setattr(Arm, "hold", lambda arm: next(go(arm, WALL - GOAL, 1.0)))
    _, reason, search, _ = play("shift", "shift", "advance")
    assert "link5 presses" in search.log[2]
    assert reason.startswith("advance: link5 presses")


def test_where_nothing_that_is_chosen_helps_only_what_comes_before_is_done_otherwise():
    _, reason, search, _ = play("shift", "despair")
    tries = [line for line in search.log if line.startswith("1 ")]
    assert reason == "despair: the mug is behind a wall"
    assert {line.partition(": ")[0] for line in tries} == {"1 despair [usual]"}
    assert len(tries) == sum(line.startswith("0 ") and line.endswith("ok") for line in search.log)


def test_where_a_thing_is_held_badly_what_comes_before_is_soon_done_otherwise():
    *_, reason, search, _ = play("shift", "lose")
    assert reason == "lose: the mug slipped"
    calls = [line for line in search.log if "no time" not in line]
    assert [line[:6] for line in calls[:5]] == ["0 shif", *["1 lose"] * 3, "0 shif"]


def test_after_what_was_held_ill_another_grasp_comes_before_anything_else():
    _, reason, search, _ = play("hold", "carry")
    assert not reason
    grasps = [line for line in search.log if "hold" in line]
    assert grasps == [
        "0 hold [usual]: ok",
        "0 hold [way to grasp 1]: ok",
    ]


def test_what_runs_out_of_time_in_two_ways_is_not_tried_in_a_third():
    _, reason, search, _ = play("shift", "dawdle", horizon=15)
    assert reason == "dawdle: there is no time left"
    tries = [line for line in search.log if line.startswith("1 ")]
    done = [line for line in search.log if line.startswith("0 ") and line.endswith("ok")]
    assert len(tries) == 2 * len(done)


def test_what_takes_no_time_is_not_tried_for_ever(monkeypatch):
    monkeypatch.setattr(searching, "BUDGET", 100)
    *_, search, _ = play(*[[["rest"], ["rest"]]] * 20, "refuse")
    assert len(search.log) < 150
