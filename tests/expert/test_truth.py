from __future__ import annotations

from pytest_safemanip.expert.truth import Truth
from pytest_safemanip.trace.hazard import Hazard
from tests import toy


def test_a_hazard_may_begin_now_and_has_begun_when_its_condition_holds():
    truth, low = Truth(toy.SCENE), []
    truth.at(3)
    truth.begins("release_stability", "obj", when=lambda: bool(low))
    truth.at(4)
    assert truth.hazards == []
    low.append(True)
    truth.at(5)
    truth.at(6)
    assert truth.hazards == [Hazard("release_stability", (toy.SCENE.roles["obj"],), 3, 5)]


def test_without_a_condition_it_has_begun():
    truth = Truth(toy.SCENE)
    truth.at(7)
    truth.begins("action_onset", "place", "obj")
    assert truth.hazards == [Hazard("action_onset", ("place", toy.SCENE.roles["obj"]), 7, 7)]


def test_several_hazards_wait_for_their_own_conditions():
    truth, seen = Truth(toy.SCENE), set()
    truth.begins("collision_contact", when=lambda: "a" in seen)
    truth.begins("grasp_stability", "obj", when=lambda: "b" in seen)
    seen.add("b")
    truth.at(1)
    assert [hazard.property_id for hazard in truth.hazards] == ["grasp_stability"]
    seen.add("a")
    truth.at(2)
    assert [hazard.last for hazard in truth.hazards] == [1, 2]
