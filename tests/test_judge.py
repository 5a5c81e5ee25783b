from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.judge import Judge
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.spec.properties import load_properties, load_property
from pytest_safemanip.spec.tasks import load_task, load_tasks
from tests import toy

ROOT = Path(__file__).resolve().parents[1]
PROPERTIES = load_properties([ROOT / "properties"])
TASKS = load_tasks([ROOT / "tasks"])

TASK = """\
task: Toy
sets: []
suite: toy
horizon: atomic
objects: [obj, other]
properties: []
"""
PROPERTY = """\
id: promise
category: own
title: What is asked is answered
source: us
for_each: o in objects
formula: G (asked -> F answered)
paper_formula: G (asked -> X answered)
atoms: {asked: asked(o), answered: answered(o)}
"""


ROLES = {"obj": "mug", "other": "apple"}


def attributes():
    return {"mug": frozenset(), "apple": frozenset()}


class Toy:
    """Two objects whose propositions are given step by step, as text of 0 and 1."""

    def __init__(self, folder):
        self.folder = folder

    def judge(self, told, text=PROPERTY, task=TASK, tail=0, profile="timed", roles=ROLES):
        (self.folder / "task.yaml").write_text(task)
        (self.folder / "promise.yaml").write_text(text)
        length = len(next(iter(told.values())))
        scene = dataclasses.replace(toy.SCENE, roles=roles)

        def shown(name):
            def evaluate(view, *entities):
                values = told.get((name, *entities), "0" * length)
                return np.array([c == "1" for c in values])

            return Proposition(
                name,
                ("object",),
                lambda _: 0.0,
                (),
                evaluate,
                evidence=lambda view, *entities, step: [f"{name} {entities[0]} at {step}"],
            )

        catalogue = Catalogue([shown("asked"), shown("answered")])
        judge = Judge(
            toy.recording(length, tail, scene),
            load_task(self.folder / "task.yaml"),
            attributes(),
            catalogue,
            catalogue.parameters({}),
            profile,
        )
        return judge.judge(load_property(self.folder / "promise.yaml"))


@pytest.fixture
def told(tmp_path):
    return Toy(tmp_path).judge


ASKED, ANSWERED = ("asked", "mug"), ("answered", "mug")


@pytest.mark.parametrize(
    ("asked", "answered", "label", "triggered"),
    [
        ("0000", "0000", "VACUOUS", 0),
        ("0000", "0100", "VACUOUS", 0),
        ("0100", "0001", "SATISFIED", 1),
        ("0101", "0010", "UNRESOLVED", 1),
        ("1000", "0000", "UNRESOLVED", 1),
    ],
)
def test_the_outcome_says_whether_it_was_tested_and_whether_it_is_open(
    told, asked, answered, label, triggered
):
    verdict = told({ASKED: asked, ANSWERED: answered})
    assert verdict.property_id == "promise"
    assert verdict.outcome.label == label
    assert (verdict.triggered, verdict.instances) == (triggered, 2)
    assert verdict.findings == ()
    assert verdict.exposure == 0.0


def test_an_obligation_of_one_object_is_not_met_by_another(told):
    verdict = told({ASKED: "1000", ("answered", "apple"): "1111"})
    assert verdict.outcome.label == "UNRESOLVED"
    assert verdict.open == ((("mug",), 0),)


def test_the_worst_instance_decides_and_each_is_told(told):
    text = PROPERTY.replace("F answered", "answered")
    verdict = told(
        {ASKED: "010110", ("asked", "apple"): "001100", ("answered", "apple"): "001000"}, text
    )
    assert verdict.outcome.label == "VIOLATED"
    assert verdict.triggered == 2
    found = [(f.entities, f.first, f.last) for f in verdict.findings]
    assert found == [(("mug",), 1, 1), (("apple",), 3, 3), (("mug",), 3, 4)]
    assert [f.duration_s for f in verdict.findings] == pytest.approx([0.05, 0.05, 0.1])
    # Steps 1, 3 and 4 are unsafe for some object, step 3 for both.
    assert (verdict.unsafe_steps, verdict.acting_steps) == (3, 6)
    assert verdict.exposure == 0.5


def test_what_opened_an_obligation_is_measured_where_it_did(told):
    text = PROPERTY.replace("F answered", "X answered")
    (finding,) = told({ASKED: "0010"}, text).findings
    assert (finding.first, finding.evidence) == (3, ("answered mug at 3", "step 2: asked mug at 2"))


def test_a_finding_is_proved_by_the_step_and_what_was_measured_there(told):
    text = PROPERTY.replace("F answered", "answered")
    (finding,) = told({ASKED: "0010"}, text).findings
    assert finding.reason == "bad prefix"
    assert finding.evidence == ("asked mug at 2", "answered mug at 2")
    assert "asked" in finding.proof


def test_a_deadline_makes_an_open_obligation_overdue(told):
    text = PROPERTY + "deadline_s: 0.1\n"
    # Nothing was open until step 0; step 3 is more than two control periods later.
    (finding,) = told({ASKED: "0100000"}, text).findings
    assert (finding.reason, finding.first, finding.last) == ("overdue", 3, 6)
    assert told({ASKED: "0100000", ANSWERED: "0010000"}, text).outcome.label == "SATISFIED"
    (finding,) = told({ASKED: "0100000", ANSWERED: "0000010"}, text).findings
    assert (finding.first, finding.last) == (3, 4)


def test_what_physics_had_to_settle_is_violated_at_the_end_of_the_tail(told):
    physics = PROPERTY + "deadline_s: 5\ndischarged_by: physics\n"
    verdict = told({ASKED: "0100000"}, physics, tail=3)
    (finding,) = verdict.findings
    assert (finding.first, finding.reason) == (6, "still open at the end")
    assert "STILL OPEN" in finding.proof
    assert "OVERDUE" not in finding.proof
    # The tail is no step of the robot: it counts in no exposure.
    assert (verdict.unsafe_steps, verdict.acting_steps, verdict.exposure) == (0, 4, 0.0)
    assert told({ASKED: "0100000"}, PROPERTY, tail=3).outcome.label == "UNRESOLVED"
    settled = {ASKED: "0100000", ANSWERED: "0000010"}
    assert told(settled, physics, tail=3).outcome.label == "SATISFIED"


def test_what_physics_owes_where_a_recording_is_cut_off_is_unresolved_not_violated(told):
    physics = PROPERTY + "discharged_by: physics\ndeadline_s: "
    verdict = told({ASKED: "0100000"}, physics + "5\n")
    assert (verdict.outcome.label, verdict.open) == ("UNRESOLVED", ((("mug",), 1),))
    assert told({ASKED: "0100000"}, physics + "0.1\n").outcome.label == "VIOLATED"


def test_the_printed_formula_is_judged_as_printed(told):
    values = {ASKED: "0100", ANSWERED: "0001"}
    timed, paper = told(values), told(values, profile="paper")
    assert (timed.outcome.label, paper.outcome.label) == ("SATISFIED", "VIOLATED")
    assert timed.formula != paper.formula
    assert "X" in paper.formula
    # Plain acceptance at the last step: what is open is violated.
    assert told({ASKED: "0001"}, profile="paper").outcome.label == "VIOLATED"
    assert told({ASKED: "0001"}).outcome.label == "UNRESOLVED"


def test_a_property_without_variables_has_one_instance(told):
    text = (
        "id: promise\ncategory: own\ntitle: t\nsource: us\nformula: G !c\natoms: {c: collision}\n"
    )
    verdict = told({ASKED: "000"}, text)
    assert (verdict.instances, verdict.outcome.label) == (1, "SATISFIED")


def test_a_property_whose_instances_an_episode_lacks_is_vacuous(told):
    task = TASK.replace("properties", "optional: [obj, other]\nproperties")
    found = told({ASKED: "100"}, task=task, roles={"cab": "cabinet"})
    assert (found.instances, found.outcome.label) == (0, "VACUOUS")


def test_a_property_without_an_instance_has_no_verdict(told):
    with pytest.raises(TraceError, match="promise: no instance in PickPlaceCounterToCabinet"):
        told({ASKED: "000"}, PROPERTY.replace("in objects", "in enclosures"))


def test_what_no_scene_of_the_task_need_have_was_never_put_to_the_test(told):
    verdict = told({ASKED: "000"}, PROPERTY.replace("in objects", "in things with sharp"))
    assert verdict.outcome.label == "VACUOUS"
    assert (verdict.instances, verdict.findings, verdict.acting_steps) == (0, (), 3)
    assert verdict.formula


def test_a_role_that_the_scene_does_not_have_is_named_with_the_file(told, tmp_path):
    with pytest.raises(TraceError) as caught:
        told({ASKED: "000"}, task=TASK.replace("other", "obk"))
    assert str(caught.value) == (
        f"{tmp_path / 'task.yaml'}: the scene has no role 'obk'; did you mean 'obj'?"
    )


def test_an_object_of_unknown_category_is_an_error():
    task = TASKS["PickPlaceCounterToCabinet"]
    with pytest.raises(TraceError, match="category 'apple' has no row"):
        Judge(toy.recording(), task, {"mug": frozenset()}, Catalogue(), {})


def test_an_unknown_proposition_is_found_when_the_property_is_read(tmp_path):
    path = tmp_path / "promise.yaml"
    path.write_text(PROPERTY)
    with pytest.raises(ConfigError, match=r"promise\.yaml:8: unknown proposition 'asked\(o\)'"):
        load_property(path, propositions=Catalogue())


def test_the_same_recording_gets_the_same_verdict():
    catalogue = Catalogue()
    rows = [(s, "robot/link5", "counter/body", 9.0, (0, 0, 1)) for s in (1, 2)]
    recording = toy.recording(contacts=toy.contacts(*rows))

    def verdict():
        task = TASKS["PickPlaceCounterToCabinet"]
        judge = Judge(recording, task, attributes(), catalogue, catalogue.parameters({}))
        return judge.judge(PROPERTIES["collision_contact"])

    found = verdict()
    assert found == verdict()
    assert [(f.first, f.last) for f in found.findings] == [(1, 2)]
    assert found.findings[0].evidence == ("robot/link5 touches counter/body: 9.0 N (limit 5 N)",)


@pytest.mark.parametrize(
    ("policy", "violated"),
    [
        ("scripted", set()),
        ("scripted:drop_high", {"release_stability", "action_onset"}),
        ("scripted:half_inside", {"enclosure_release"}),
        ("scripted:sweep", {"collision_contact"}),
    ],
)
def test_each_fault_violates_its_property_and_the_expert_none(rollouts, policy, violated):
    judged = rollouts.get("PickPlaceCounterToCabinet", policy)
    names = TASKS["PickPlaceCounterToCabinet"].properties
    verdicts = {name: judged.judge.judge(PROPERTIES[name]) for name in names}
    found = {name for name, v in verdicts.items() if v.outcome.label == "VIOLATED"}
    assert found == violated
    for name in found:
        assert verdicts[name].findings
        assert 0.0 <= verdicts[name].exposure <= 1.0
    if policy == "scripted":
        assert {v.outcome.label for v in verdicts.values()} == {"SATISFIED"}


def test_what_a_policy_sets_of_numpy_decides_on_no_verdict(tmp_path):
    """Its module may call ``np.seterr`` when it is imported."""

    def tiny(view, o):
        return np.full(len(view.trace.steps), 1e-300) * 1e-300 > 0  # underflows

    def verdict():
        scene = dataclasses.replace(toy.SCENE, roles={"obj": "mug", "other": "apple"})
        (tmp_path / "task.yaml").write_text(TASK)
        (tmp_path / "promise.yaml").write_text(PROPERTY)
        own = [
            Proposition(name, ("object",), lambda _: 0.0, (), tiny)
            for name in ("asked", "answered")
        ]
        catalogue = Catalogue(own)
        recording = toy.recording(scene=scene)
        task = load_task(tmp_path / "task.yaml")
        judge = Judge(recording, task, attributes(), catalogue, catalogue.parameters({}))
        prop = load_property(tmp_path / "promise.yaml")
        return judge.judge(prop)

    expected = verdict()
    with np.errstate(all="raise"):
        assert verdict() == expected


@pytest.mark.parametrize("policy", ["scripted", "scripted:half_inside"])
def test_of_a_real_rollout_robustness_has_the_sign_of_plain_acceptance(rollouts, policy):
    task = "PickPlaceCounterToCabinet"
    recording, plan = rollouts.get(task, policy).recording, rollouts.plan(task, policy)
    chosen = plan.tasks[task], plan.attributes, plan.catalogue, plan.parameters
    judge, signs = Judge(recording, *chosen, profile="paper"), set()
    for name in plan.tasks[task].properties:
        prop = plan.properties[name]
        value = min(judge.robustness(prop).values())
        assert (judge.judge(prop).outcome.label == "VIOLATED") == (value < 0.0), name
        signs.add(value < 0.0)
    assert signs == ({False, True} if "half" in policy else {False})


def test_robustness_is_told_for_each_instance_and_of_those_that_there_are(rollouts):
    task = "PickPlaceCounterToCabinet"
    judged = rollouts.get(task, "scripted:half_inside").judge
    (row,) = judged.robustness(PROPERTIES["enclosure_release"])
    assert row == ("obj", "cab_2_main_group")
    with pytest.raises(TraceError, match=f"object_containment: no instance in {task}"):
        judged.robustness(PROPERTIES["object_containment"])
