from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import TraceError
from pytest_safemanip.propositions.grounding import check_call
from tests.propositions.hazards.kitchen import (
    BINDING,
    BLENDER,
    COFFEE,
    OVEN,
    SCENE,
    STOVE,
    kitchen,
    see,
)
from tests.propositions.stage import CATALOGUE, touch, true_at

ON_BURNER = (-0.2, 0.2, 0.93)
IN_OVEN = (0.7, 0.3, 1.0)
QUICK = {"hot.heating": 1.0, "hot.cooling": 2.0}


def test_an_appliance_is_on_while_one_of_its_switches_is():
    view = see(kitchen(6, on=[(STOVE, slice(2, 4)), BLENDER]))
    assert true_at(view("on", "stove")) == [2, 3]
    assert true_at(view("on", "blender")) == list(range(6))
    assert not view("on", "oven").any()
    assert view.evidence("on", ("stove",), 2) == ["left of stove is on"]


def test_what_has_no_switch_is_not_told_to_be_off():
    with pytest.raises(TraceError, match="on: 'counter' is no appliance"):
        see(kitchen(1))("on", "counter")


@pytest.mark.parametrize(
    ("place", "switch", "heats"),
    [
        (ON_BURNER, STOVE, True),
        ((-0.2, 0.41, 0.93), STOVE, False),  # beside the burner
        (IN_OVEN, OVEN, True),
        ((0.7, 0.3, 1.2), OVEN, False),  # on top of it
        (ON_BURNER, OVEN, False),
        ((-0.9, 0.3, 0.93), COFFEE, True),
        ((-0.9, 0.3, 1.0), COFFEE, False),  # above the place that it pours onto
    ],
)
def test_what_is_where_something_heats_is_heated_while_it_is_on(place, switch, heats):
    view = see(kitchen(4, on=[(switch, slice(1, 3))], places={"pan": place}))
    assert true_at(view("heated", "pan")) == ([1, 2] if heats else [])


def test_what_touches_a_flame_is_heated():
    kinds = {**BINDING.attributes, "apple": frozenset({"hot_source"})}
    rows = touch([2], "mug/body", "apple/body", 1.0)
    view = see(kitchen(4, rows), attributes=kinds)
    assert true_at(view("heated", "mug")) == [2]
    assert view.evidence("heated", ("mug",), 2) == ["apple heats mug"]
    assert view("hot", "apple").all()


def test_a_pan_on_a_burner_becomes_hot_and_stays_so_for_a_while():
    # From 20 towards 200 degrees: 55 are reached after 0.22 s, and left again after 2.2 s.
    view = see(kitchen(100, on=[(STOVE, slice(0, 20))], places={"pan": ON_BURNER}), QUICK)
    hot = true_at(view("hot", "pan"))
    reached = -np.log(1.0 - 35.0 / 180.0)
    highest = 200.0 - 180.0 * np.exp(-1.0)
    left = 1.0 + 2.0 * np.log((highest - 20.0) / 35.0)
    assert hot[0] * 0.05 == pytest.approx(reached, abs=0.06)
    assert hot[-1] * 0.05 == pytest.approx(left, abs=0.06)
    assert hot == list(range(hot[0], hot[-1] + 1))
    assert not view("hot", "mug").any()


def test_evidence_of_heat_is_a_temperature():
    view = see(kitchen(20, on=[STOVE], places={"pan": ON_BURNER}), QUICK)
    expected = 200.0 - 180.0 * np.exp(-1.0)
    assert view.evidence("hot", ("pan",), 19) == [f"pan has {expected:.0f} degrees Celsius"]
    assert view.evidence("heated", ("pan",), 3) == ["left of stove heats pan"]


def test_with_the_usual_constants_a_pan_is_hot_after_half_a_minute_and_for_a_quarter_of_an_hour():
    recording = kitchen(900, on=[(STOVE, slice(0, 300))], places={"pan": ON_BURNER})
    scene = dataclasses.replace(recording.scene, control_period=2.0)
    hot = true_at(see(dataclasses.replace(recording, scene=scene))("hot", "pan"))
    assert 22.0 <= 2.0 * hot[0] <= 32.0
    assert 14.0 <= (2.0 * hot[-1] - 600.0) / 60.0 <= 18.0


def test_a_burner_itself_is_hot_after_it_was_on():
    view = see(kitchen(40, on=[(STOVE, slice(0, 10))]), QUICK)
    assert true_at(view("hot", "stove"))[0] < 10
    assert view("hot", "stove")[35]
    assert not view("hot", "stove")[39]
    assert not view("hot", "oven").any()


def test_what_the_task_says_is_hot_begins_so():
    view = see(kitchen(40), {"hot.cooling": 1.0}, hot=frozenset({"pan"}))
    assert true_at(view("hot", "pan"))[0] == 0
    assert not view("hot", "pan")[-1]


def test_of_what_is_no_hot_source_nobody_knows_how_hot_it_is():
    with pytest.raises(TraceError, match="'blender' is no hot source"):
        see(kitchen(1))("hot", "blender")


def test_an_appliance_of_an_unknown_kind_may_be_a_hot_source():
    kinds = {name: own for name, own in BINDING.attributes.items() if name != "blender"}
    names = {"blender": "Blender2000"}
    with pytest.raises(TraceError, match="kind of fixture 'Blender2000' has no row"):
        see(kitchen(1), attributes=kinds, kinds=names)("heated", "pan")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (("on", "cabinet"), "on: 'cabinet' is no appliance"),
        (("hot", "counter"), "hot: 'counter' is no object or appliance"),
        (("heated", "stove"), "heated: 'stove' is no movable object"),
    ],
)
def test_arguments_of_another_kind_are_refused_before_anything_is_judged(call, message):
    with pytest.raises(TraceError, match=message):
        check_call(CATALOGUE[call[0]], call[1:], SCENE, ())


@pytest.mark.parametrize(
    "call", [("heated", "pan"), ("hot", "pan"), ("pre_safe", "turn", "stove")], ids=" ".join
)
def test_a_burner_of_which_nothing_tells_what_it_heats_is_refused(call):
    turned = [dataclasses.replace(SCENE.switches[STOVE], joint="cabinet/hinge")]
    switches = (*turned, *SCENE.switches[1:])
    boxes = tuple(box for box in SCENE.boxes if box.kind != "burner")
    check_call(CATALOGUE[call[0]], call[1:], dataclasses.replace(SCENE, switches=switches), ())
    scene = dataclasses.replace(SCENE, switches=switches, boxes=boxes)
    with pytest.raises(TraceError, match="nothing tells what the burner 'left' of 'stove' heats"):
        check_call(CATALOGUE[call[0]], call[1:], scene, ())
