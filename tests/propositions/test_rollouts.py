"""What the newer propositions say about rollouts in which it is known what happened."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.propositions.view import View
from tests.conftest import Rollouts
from tests.propositions.stage import CATALOGUE, true_at

TASK = "PickPlaceCounterToCabinet"
RAW = {"obj": frozenset({"raw"})}


def seen(rollouts: Rollouts, policy: str = "scripted", task: str = TASK, **binding: object) -> View:
    view = rollouts.get(task, policy).judge.view
    changed = dataclasses.replace(view.binding, **binding)
    return View(view.trace, changed, CATALOGUE.parameters({}), CATALOGUE)


def cabinet(view: View) -> str:
    return view.trace.scene.roles["cab"]


def test_the_hand_is_contaminated_from_the_grasp_of_raw_food_on(rollouts):
    view = seen(rollouts, attributes=RAW)
    grasp = true_at(view("obj_grasped", "obj"))[0]
    dirty = true_at(view("contaminated", "robot"))
    assert abs(dirty[0] - grasp) <= 5
    assert dirty == list(range(dirty[0], len(view.trace)))
    assert not seen(rollouts, attributes={})("contaminated", "robot").any()


def test_what_stands_away_from_it_stays_clean_and_what_the_hand_knocks_over_does_not(rollouts):
    assert not seen(rollouts, attributes=RAW)("contaminated", "distr_counter").any()
    swept = seen(rollouts, "scripted:sweep", attributes={"distr_counter": frozenset({"raw"})})
    assert swept("contaminated", "robot").any()


def test_the_expert_puts_another_item_into_a_cabinet_that_holds_one(rollouts):
    view = seen(rollouts)
    assert true_at(view("item_in_enclosure", cabinet(view))) == list(range(4, len(view.trace)))
    (inserted,) = true_at(view("insert_item", cabinet(view)))
    assert inserted < true_at(view("obj_released", "obj"))[0]
    assert view.evidence("insert_item", (cabinet(view),), inserted) == [
        f"distr_cab is inside {cabinet(view)}"
    ]
    assert not view("enclosure_cleared", cabinet(view)).any()


def test_what_is_dropped_in_front_of_the_cabinet_was_not_inserted(rollouts):
    view = seen(rollouts, "scripted:drop_high")
    assert not view("insert_item", cabinet(view)).any()


def test_the_drawer_is_cleared_when_the_expert_has_taken_the_item_out(rollouts):
    view = seen(rollouts, task="PickPlaceDrawerToCounter")
    drawer = view.trace.scene.roles["drawer"]
    held = true_at(view("obj_grasped", "obj"))
    assert view("item_in_enclosure", drawer)[4 : held[0]].all()
    assert not view("item_in_enclosure", drawer)[held[-1] :].any()
    cleared = true_at(view("enclosure_cleared", drawer))
    assert held[0] < cleared[0] <= held[-1]
    assert cleared[-1] == len(view.trace) - 1


@pytest.mark.parametrize("policy", ["scripted", "scripted:drop_high"])
def test_a_transfer_ends_in_its_receiver_unless_it_was_let_go_far_from_it(rollouts, policy):
    view = seen(rollouts, policy)
    let_go = true_at(view("transfer", "obj", cabinet(view)))
    contained = view("contained", "obj", cabinet(view))
    if policy == "scripted":
        assert let_go == true_at(view("obj_released", "obj"))
        assert contained[-1]
        assert not contained[: let_go[0]].any()
    else:
        assert not let_go
        assert not contained.any()


def test_water_runs_when_the_expert_has_turned_it_on_and_his_hand_is_not_under_it(rollouts):
    view = seen(rollouts, task="TurnOnSinkFaucet")
    scene, sink = view.trace.scene, view.trace.scene.roles["sink"]
    (tap,) = [k for k, s in enumerate(scene.switches) if s.entity == sink]
    runs = view.trace.steps.switch[:, tap] == 1.0
    assert not runs[0]
    assert runs[-1]
    success = np.flatnonzero(view.trace.steps.success)[0]
    assert abs(np.flatnonzero(runs)[0] - success) <= 1
    assert not view("sanitized", "robot").any()
