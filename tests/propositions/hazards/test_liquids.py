from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.errors import TraceError
from pytest_safemanip.judge import Judge
from pytest_safemanip.resources import folder
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.spec.task import Task
from pytest_safemanip.trace.geometry import about
from tests.propositions.hazards.kitchen import DROPS, SCENE, kitchen, see
from tests.propositions.stage import CATALOGUE, true_at

LENGTH = 30
ON_COUNTER = (0.3, -0.3, 0.905)


def drops(**moved):
    """Particles over time: by number, as ``_3``, from which step on they are where."""
    places = np.tile(DROPS.astype(np.float32), (LENGTH, 1, 1))
    for name, (step, place) in moved.items():
        places[step:, int(name[1:])] = place
    return places


def spilled(parameters=None, places=None, **moved):
    recording = kitchen(LENGTH, particles=drops(**moved), places=places or {})
    return see(recording, parameters)


def test_nothing_is_spilled_that_stays():
    assert not spilled()("spilled", "pan").any()


def test_what_lies_beside_for_half_a_second_is_spilled():
    view = spilled(_3=(5, ON_COUNTER))
    assert true_at(view("spilled", "pan")) == list(range(14, LENGTH))
    assert view.evidence("spilled", ("pan",), 20) == ["10% of what was in pan is spilled"]
    assert view.margin("spilled", "pan")[-1] == pytest.approx(1.0)
    assert not view("spilled", "mug").any()  # it was empty


def test_what_falls_through_the_air_into_something_else_is_not():
    air, mug = (0.0, 0.0, 1.2), (0.0, 0.0, 0.93)
    particles = drops(**{f"_{n}": (5, air) for n in range(10)})
    particles[12:, :] = mug
    assert not see(kitchen(LENGTH, particles=particles))("spilled", "pan").any()
    particles[12:, :] = ON_COUNTER
    assert see(kitchen(LENGTH, particles=particles))("spilled", "pan").any()


def test_a_share_of_it_may_be():
    assert not spilled({"spilled.share": 0.15}, _3=(5, ON_COUNTER))("spilled", "pan").any()
    both = {"_3": (5, ON_COUNTER), "_4": (20, ON_COUNTER)}
    assert true_at(spilled({"spilled.share": 0.15}, **both)("spilled", "pan"))[0] == 29


def test_what_a_receiver_of_the_task_takes_is_not():
    particles = drops(_3=(5, (0.4, 0.0, 0.94)))  # in the apple, say
    recording = kitchen(LENGTH, particles=particles)
    assert see(recording)("spilled", "pan").any()
    assert not see(recording, transfers=(("mug", "apple"),))("spilled", "pan").any()


def test_what_goes_with_the_vessel_is_in_it():
    away = np.tile((0.5, 0.3, 1.3), (LENGTH, 1))
    moved = drops() + (away[0] - (-0.6, -0.1, 0.93)).astype(np.float32) * (
        np.arange(LENGTH)[:, None, None] >= 5
    )
    places = np.where(np.arange(LENGTH)[:, None] >= 5, away, (-0.6, -0.1, 0.93))
    recording = kitchen(LENGTH, places={"pan": places}, particles=moved.astype(np.float32))
    assert not see(recording)("spilled", "pan").any()
    left = see(kitchen(LENGTH, places={"pan": places}, particles=drops()))
    assert left("spilled", "pan").any()


def test_where_no_liquid_is_simulated_nothing_is_told():
    scene = dataclasses.replace(SCENE, liquids=())
    recording = kitchen(3, scene=scene, particles=np.zeros((3, 0, 3), np.float32))
    with pytest.raises(TraceError, match=r"spilled\(pan\) .* no liquid is simulated in the scene"):
        see(recording)("spilled", "pan")


MUG = (0.0, 0.0, 0.93)


def poured(into=MUG, left=0, leaves=8, arrives=14):
    """Water that leaves the pan over the mug, and ends up somewhere but for some of it."""
    particles = drops()
    particles[leaves:arrives, left:] = (0.02, 0.0, 1.1)
    particles[arrives:, left:] = into
    return particles


def test_a_liquid_is_contained_once_nearly_all_of_it_is_inside():
    view = see(kitchen(LENGTH, particles=poured()))
    assert true_at(view("contained", "water", "mug")) == list(range(18, LENGTH))
    assert view.margin("contained", "water", "mug")[-1] == pytest.approx(1 / 0.95 - 1)
    most = see(kitchen(LENGTH, particles=poured(left=1)))
    assert not most("contained", "water", "mug").any()
    assert true_at(most("contained", "water", "mug", "share=0.9"))[0] == 18
    assert most.evidence("contained", ("water", "mug"), 20) == ["90% of water is in mug"]


def test_a_vessel_on_its_side_contains_no_liquid():
    turn = about((1.0, 0.0, 0.0), np.deg2rad(80.0))
    view = see(kitchen(LENGTH, particles=poured(), turns={"mug": turn}))
    assert not view("contained", "water", "mug").any()


def test_a_liquid_is_transferred_when_it_starts_to_flow_toward_the_receiver():
    view = see(kitchen(LENGTH, particles=poured()))
    assert true_at(view("transfer", "water", "mug")) == [8]
    assert not view("transfer", "water", "apple").any()
    drop = see(kitchen(LENGTH, particles=poured(left=9)), {"transfer.share": 0.2})
    assert not drop("transfer", "water", "mug").any()


def test_a_shipped_property_tells_poured_from_spilled():
    rule = load_properties([folder("properties")])["object_containment"]
    task = Task("Pour", Path("pour.yaml"), (), "own", "short", (), transfers=(("water", "mug"),))
    for into, outcome in ((MUG, "SATISFIED"), (ON_COUNTER, "VIOLATED")):
        recording = kitchen(LENGTH, particles=poured(into), tail=10)
        scene = dataclasses.replace(recording.scene, roles={n: n for n in ("water", "mug")})
        kinds = {name: frozenset() for name in ("mug", "apple", "knife", "pan")}
        judge = Judge(
            dataclasses.replace(recording, scene=scene),
            task,
            kinds,
            CATALOGUE,
            CATALOGUE.parameters({}),
        )
        assert judge.judge(rule).outcome.label == outcome
