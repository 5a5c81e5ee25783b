"""Each proposition under real physics: where it becomes true, and where it almost does."""

from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.propositions.kernels.filters import rising
from pytest_safemanip.propositions.kernels.forces import finger_groups, forces_on
from pytest_safemanip.trace.geometry import corners
from tests.physics.moments import HOLDS, NEAR, TURNS
from tests.physics.scenario import CATALOGUE, PERIOD
from tests.physics.world import SHELF


def identify(row):
    return f"{' '.join(row.call)}, {row.rollout}".replace(" ", "_")


def test_every_proposition_has_a_rollout_in_which_it_turns_and_one_in_which_it_almost_does():
    # What is missing here has tests of its own below.
    elsewhere = {"pre_safe", "reach_in", "obj_released", "on", "heated"}
    assert {row.call[0] for row in TURNS} | {"pre_safe"} == set(CATALOGUE)
    assert {row.call[0] for row in NEAR} | elsewhere == set(CATALOGUE)


@pytest.mark.parametrize("row", TURNS, ids=identify)
def test_a_proposition_becomes_true_when_it_happens(play, row):
    rollout = play(row.rollout)
    turns = np.flatnonzero(rising(rollout.view(*row.call)))
    assert set(turns) & set(rollout.steps(*row.span)), (turns * PERIOD, row.span)


@pytest.mark.parametrize("row", NEAR, ids=identify)
def test_a_proposition_stays_false_where_one_thing_is_missing(play, row):
    rollout = play(row.rollout)
    steps = rollout.steps(*row.span)
    assert not rollout.view(*row.call)[steps].any()
    assert rollout.seen(row.but_for, **row.binding)(*row.call)[steps].any()


@pytest.mark.parametrize(("skill", "entity", "name", "safe"), HOLDS)
def test_the_conditions_of_a_skill_hold_or_not_where_it_starts(play, skill, entity, name, safe):
    view = play(name).view
    (onset, *_) = np.flatnonzero(view("skill_onset", skill, entity))
    assert view("pre_safe", skill, entity)[onset] == safe


def test_only_its_height_makes_a_drop_unsafe(play):
    rollout = play("can dropped")
    assert not rollout.view("pre_safe", "place", "can").all()
    assert rollout.seen({"pre_safe.drop": 0.1})("pre_safe", "place", "can").all()


def test_a_burner_that_is_out_heats_nothing(play):
    rollout = play("can put on cold burner")
    assert not rollout.view("on", "stove").any()
    assert not rollout.view("heated", "can").any()
    assert not rollout.view("hot", "can", "heating=1").any()


def test_what_was_on_a_burner_is_hot_after_it_was_taken_off(play):
    view, away = (
        play("can put on lit burner").view,
        play("can put on lit burner").steps("away", "end"),
    )
    assert not view("heated", "can")[away].any()
    assert view("hot", "can", "heating=1")[away].all()


def test_what_carries_a_thing_over_another_carries_what_lies_in_it_too(play):
    rollout = play("poured into pan")
    over, before = rollout.view("carried_over", "cherry", "pan"), rollout.steps("start", "pours")
    assert not rollout.view("obj_grasped", "cherry").any()
    assert over[before[-1]]
    assert not over[rollout.steps("poured", 6.0)].any()


def test_water_arrives_or_is_spilled(play):
    for name, arrives in (("water poured into pan", True), ("water poured beside pan", False)):
        rollout = play(name)
        label = rollout.verdict("object_containment").outcome.label
        assert label == ("SATISFIED" if arrives else "VIOLATED")
        assert rollout.view("spilled", "cup").any() != arrives
    assert not play("water poured into pan").view("spilled", "pan").any()


def test_closed_fingers_that_push_hold_nothing_and_lose_nothing(play):
    rollout = play("can pushed")
    ((left, right),) = finger_groups(rollout.view)
    left, right = (forces_on(rollout.view, side)[:, 0] for side in (left, right))
    at_once = np.convolve((left > 0.5) & (right > 0.5), np.ones(5), "valid")
    assert at_once.max() == 5  # for long enough to pass for a grasp
    assert not rollout.view("obj_grasped", "can").any()


def test_fingertips_in_an_enclosure_are_no_reach_as_long_as_the_hand_is_outside(play):
    rollout = play("hand in open cabinet")
    tip = rollout.view.trace.steps.eef_pose[:, 1] + 0.025
    peeks = rollout.steps("peeks", "enters")
    assert tip[peeks].max() > 0.05
    assert not rollout.view("reach_in", "cabinet")[peeks].any()


def test_what_comes_in_without_being_held_was_not_put_in(play):
    not_held = play("can let go inside").seen({"obj_grasped.force": 1000.0})
    assert not not_held("insert_item", "cabinet").any()
    assert not not_held("place_in_onset", "can", "cabinet").any()
    assert not_held("obj_inside", "can", "cabinet").any()


def test_an_object_that_slips_out_of_closed_fingers_was_not_released(play):
    rollout = play("can slips")
    (end,) = np.flatnonzero(rising(~rollout.view("obj_grasped", "can")))
    assert end in rollout.steps("lifts", "lifted")
    assert not rollout.view("obj_released", "can").any()


def test_a_held_object_may_be_pushed_against_what_it_may_rest_on(play):
    rollout = play("can carried into jar")
    (line,) = rollout.verdict("collision_contact").findings[0].evidence
    assert line.startswith("held can touches jar (jam)")
    allowed = rollout.seen({}, supports={"can": frozenset({"counter", "jar"})})
    assert not allowed("collision").any()


def test_a_tilted_cup_is_held_firmly_only_if_it_need_not_stay_upright(play):
    rollout = play("poured into pan")
    pours = rollout.steps("pours", "poured")
    assert rollout.view("stable_grasp", "cup")[pours].all()
    must_not = rollout.seen({}, upright=frozenset({"cup"}))("stable_grasp", "cup")
    (spills, *_) = np.flatnonzero(~must_not[pours])
    assert 0 < spills < len(pours) - 1
    assert not must_not[pours][spills:].any()


def test_a_round_thing_that_was_turned_in_the_hand_lies_inside(play):
    rollout = play("turned apple let go inside")
    trace = rollout.view.trace
    let_go = rollout.steps("let go", "end")
    lowest = corners(trace.steps.object_pose[let_go, 0], trace.scene.bodies[0].half)[..., 2].min()
    assert lowest < SHELF - 0.005
    assert rollout.view("obj_inside", "apple", "cabinet")[let_go].all()
    assert rollout.verdict("enclosure_release").outcome.label == "SATISFIED"


def test_a_door_that_the_robot_does_not_touch_hits_nothing_on_its_behalf(play):
    rollout = play("can carried into door")
    trace = rollout.view.trace
    door = set(trace.scene.parts_of("cabinet", ("door",)))
    force = trace.pair_table.force(door, set(trace.scene.parts_of("can")))
    (struck, *_) = np.flatnonzero(force >= 5.0)
    assert struck in rollout.steps("carries", "carried")
    assert np.ptp(trace.steps.joint[:, 0, 0]) > 0.1
    assert not rollout.view("mech_hit", "cabinet").any()


def test_a_door_that_was_pushed_through_an_obstacle_is_not_safe_when_it_is_open(play):
    rollout = play("door pushed through")
    opened = rollout.steps("opened", "end")
    assert rollout.view("mech_hit", "cabinet")[: opened[0]].any()
    assert (rollout.view.trace.steps.joint[opened, 0, 0] > 0.95).all()
    assert not rollout.view("recovered", "cabinet").any()


def test_a_door_that_was_closed_against_something_is_safe_when_it_is_open_again(play):
    verdict = play("door opened after hit").verdict("mechanism_recovery")
    assert verdict.outcome.label == "SATISFIED"
    assert verdict.triggered
