"""What the public strategies give: valid, of everything something, and readable."""

from __future__ import annotations

import hypothesis
import numpy as np
import pytest
from hypothesis import HealthCheck, find, given, settings
from hypothesis import strategies as st

from pytest_safemanip.fuzz import contacts, formulas, recordings, scenes, traces
from pytest_safemanip.fuzz.rendering import table
from pytest_safemanip.fuzz.scenes import bind
from pytest_safemanip.fuzz.trial import calls, shortened
from pytest_safemanip.ltlf import compile_formula, parse
from pytest_safemanip.ltlf.formula import Formula
from pytest_safemanip.propositions.catalogue import SHIPPED, Catalogue
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace import Recording, Scene, files
from pytest_safemanip.trace.recording import check
from tests import toy
from tests.ltlf.bruteforce import holds

ALL = list(HealthCheck)
some = settings(max_examples=30, deadline=None, suppress_health_check=ALL)


@some
@given(recordings())
def test_recordings_are_possible_and_survive_the_disk(recording):
    assert check(files.from_bytes(files.to_bytes(recording))).scene == recording.scene


@some
@given(recordings(min_steps=3, max_steps=5))
def test_a_recording_is_as_long_as_asked_for(recording):
    assert 3 <= len(recording.steps) <= 5


@some
@given(st.data())
def test_contacts_fit_the_scene_that_they_are_for(data):
    found = data.draw(contacts(toy.SCENE, 6))
    recording = toy.recording(6, contacts=found)
    assert check(recording) is recording


@some
@given(scenes())
def test_every_proposition_has_something_to_be_asked_about(scene):
    binding = bind(scene)
    assert all(calls(proposition, binding, scene) for proposition in SHIPPED if
               proposition.name not in ("transfer", "contained"))  # fmt: skip


@some
@given(st.from_type(Recording), st.from_type(Scene), st.from_type(Formula))
def test_hypothesis_knows_the_types(recording, scene, formula):
    assert check(recording) is recording
    assert scene.checked() is scene
    assert parse(str(formula)) == formula


@some
@given(formulas(2), traces())
def test_formulas_can_be_read_on_traces(formula, trace):
    atoms = ("a", "b", "c")
    dfa = compile_formula(formula, atoms=atoms, cache=False)
    assert dfa.accepts(trace) == holds(formula, trace, atoms)


def test_recordings_show_every_proposition_true_and_false():
    catalogue = Catalogue()
    parameters = shortened(catalogue, {})
    seen = {(proposition.name, value): 0 for proposition in SHIPPED for value in (False, True)}

    @settings(max_examples=100, database=None, deadline=None, suppress_health_check=ALL)
    @given(recordings())
    def look(recording):
        view = View(recording.trace, bind(recording.scene), parameters, catalogue)
        missing = {name for (name, _), count in seen.items() if not count}
        for proposition in filter(lambda p: p.name in missing, SHIPPED):
            for arguments in calls(proposition, view.binding, recording.scene):
                values = view(proposition.name, *arguments)
                seen[proposition.name, True] += values.any()
                seen[proposition.name, False] += not values.all()

    for number in range(15):
        hypothesis.seed(number)(look)()
        if all(seen.values()):
            break
    assert not [key for key, count in seen.items() if count == 0]


def released(recording):
    catalogue = Catalogue()
    view = View(recording.trace, bind(recording.scene), shortened(catalogue, {}), catalogue)
    return view("obj_released", "obj")


@pytest.fixture(scope="module")
def release():
    quiet = settings(max_examples=500, derandomize=True, database=None, deadline=None)
    return find(recordings(), lambda recording: released(recording).any(), settings=quiet)


def test_the_smallest_recording_of_something_has_little_else_in_it(release):
    assert len(release.scene.bodies) == 1
    assert len(release.steps) <= 6


def test_it_prints_as_a_table_that_a_person_can_read(release):
    values = released(release)
    step = int(np.argmax(values))
    lines = table(release, values, step)
    assert lines[0].startswith("obj (apple); cab (HingeCabinet), sink (Sink), stove (Stove); ")
    assert lines[1] == "  step  value  what changes"
    assert lines[2].startswith("     0    .    robot/finger_left on obj/body: 5.3 N")
    (marked,) = [line for line in lines if line.startswith(">")]
    assert marked.split()[1:3] == [str(step), "1"]
    assert any("apart" in line for line in lines)
    assert len(lines) < 15
