from __future__ import annotations

import dataclasses
from itertools import pairwise
from types import SimpleNamespace

import pytest

from pytest_safemanip.errors import ConfigError, JudgementError
from pytest_safemanip.plugin.read_settings import read_settings
from pytest_safemanip.policies.simple import Hold
from pytest_safemanip.report.header import header_lines
from pytest_safemanip.run.definitions import load_definitions
from pytest_safemanip.run.plan import Extensions, make_plan
from pytest_safemanip.run.roles import check_task
from pytest_safemanip.run.session import EvaluatedRollout
from pytest_safemanip.sim.backend import Simulator
from pytest_safemanip.sim.registry import find_simulator
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.trace import files
from tests import toy

PLACE, DRAWER = "PickPlaceCounterToCabinet", "OpenDrawer"

TASK = """\
task: StackCans
sets: [own]
suite: own
horizon: long
objects: [can1]
properties: [release_stability]
"""
PROPERTY = """\
id: gentle
category: own
title: t
source: s
for_each: o in objects
formula: G (held -> still)
atoms: {held: obj_grasped(o), still: settled(o)}
"""


@pytest.fixture
def plan(pytestconfig):
    defaults = read_settings(pytestconfig)

    def plan(**changed):
        changed = {"policies": ("hold",), "tasks": (PLACE,), **changed}
        return make_plan(dataclasses.replace(defaults, **changed), Extensions({}, (), {}))

    return plan


@pytest.fixture
def refusal(plan):
    def refusal(**changed):
        with pytest.raises(ConfigError) as caught:
            plan(**changed)
        return str(caught.value)

    return refusal


@pytest.fixture
def folder(tmp_path):
    def folder(**content):
        place = tmp_path / "own"
        place.mkdir(exist_ok=True)
        for name, text in content.items():
            (place / f"{name}.yaml").write_text(text)
        return (place,)

    return folder


@pytest.mark.parametrize(
    ("asked", "own", "used"),
    [
        ({}, {}, ("compact", "fast")),
        ({}, {"scenes": "target", "stepping": "exact"}, ("target", "exact")),
        ({"scenes": "pretrain"}, {"scenes": "target", "stepping": "exact"}, ("pretrain", "exact")),
        ({"stepping": "fast"}, {"scenes": "target", "stepping": "exact"}, ("target", "fast")),
    ],
)
def test_what_is_asked_for_wins_over_what_a_policy_is_used_to(plan, asked, own, used):
    made = plan(**asked)
    policy = dataclasses.replace(made.policies["hold"], **own)
    made = dataclasses.replace(made, policies={"hold": policy})
    assert (made.scenes("hold"), made.stepping("hold")) == used


def test_cases_of_one_rollout_are_neighbours(plan):
    made = plan(policies=("hold", "random"), tasks=(PLACE, DRAWER), seeds=(4, 2))
    rollouts = [case.rollout for case in made.cases]
    assert list(dict.fromkeys(rollouts)) == [
        (policy, task, seed)
        for policy in ("hold", "random")
        for task in (PLACE, DRAWER)
        for seed in (4, 2)
    ]
    changes = sum(one != other for one, other in pairwise(rollouts))
    assert changes == len(set(rollouts)) - 1
    assert len(made.cases) == 2 * 2 * (6 + 3)


def test_without_seeds_there_is_one(plan):
    assert {case.seed for case in plan().cases} == {0}


def test_only_wanted_properties_that_apply_become_cases(plan):
    made = plan(tasks=("quick",), properties=("release_stability",))
    assert {case.property_id for case in made.cases} == {"release_stability"}
    assert {case.task for case in made.cases} == {PLACE, "PickPlaceDrawerToCounter"}


def test_a_policy_is_left_out_of_the_tasks_that_it_cannot_do_unless_they_are_named(plan, refusal):
    made = plan(policies=("scripted:drop_high",), tasks=("all",))
    assert {case.task for case in made.cases} <= {PLACE, "PickPlaceDrawerToCounter"}
    message = refusal(policies=("scripted:drop_high",), tasks=(DRAWER,))
    assert f"policy 'scripted:drop_high' has no plan for {DRAWER}; it knows" in message


def test_changed_parameters_reach_the_plan(plan):
    assert plan(params={"settled.speed": 0.5}).parameters["settled.speed"] == 0.5


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"policies": ()}, "no policy is named; give --safemanip-policy"),
        ({"policies": ("scriptd",)}, "unknown policy 'scriptd'; did you mean 'scripted'?"),
        ({"policies": ("scripted:drops",)}, "unknown fault 'scripted:drops'; "),
        ({"policies": ("scripted:drop",)}, "expected a number from 0.003 to 0.12 m"),
        ({"tasks": ("OpenDrawr",)}, "'OpenDrawr' matches no task; did you mean 'OpenDrawer'?"),
        ({"properties": ("setled",)}, "--safemanip-properties: 'setled' matches no property"),
        (
            {"params": {"settled.sped": 1.0}},
            "parameter 'settled.sped'; did you mean 'settled.speed'?",
        ),
        (
            {"tasks": (DRAWER,), "properties": ("release_stability",)},
            "no selected property applies to a selected task",
        ),
        ({"select": ("safemanip::test_safety[x]",)}, "unknown node id"),
        (
            {"select": ("safemanip::test_safety[OpenDrawr-hold-action_onset-seed0]",)},
            "unknown task 'OpenDrawr'; did you mean 'OpenDrawer'?",
        ),
        (
            {"select": ("safemanip::test_safety[OpenDrawer-hold-action_onse-seed0]",)},
            "did you mean 'safemanip::test_safety[OpenDrawer-hold-action_onset-seed0]'?",
        ),
    ],
)
def test_what_does_not_exist_is_refused_with_the_remedy(refusal, changed, message):
    assert message in refusal(**changed)


def test_ids_say_which_rollouts_are_meant_whatever_else_is_selected(plan):
    ids = [f"safemanip::test_safety[{DRAWER}-random-action_onset-seed7]"]
    made = plan(select=tuple(ids), seeds=(0,), properties=("release_stability",))
    assert [case.node_id for case in made.cases] == ids
    assert list(made.policies) == ["random"]


def test_an_id_names_a_rule_of_a_pack_too(plan):
    rule = f"safemanip::test_safety[{DRAWER}-hold-safebox_fragile_not_dropped-seed0]"
    release = f"safemanip::test_safety[{DRAWER}-hold-action_onset-seed0]"
    assert {case.node_id for case in plan(select=(rule, release)).cases} == {rule, release}


def test_a_users_task_is_added(plan, folder):
    made = plan(tasks=("set:own", PLACE), task_paths=folder(juggle=TASK))
    assert [c.property_id for c in made.cases if c.task == "StackCans"] == ["release_stability"]
    assert made.tasks["StackCans"].horizon == "long"


def test_a_users_property_is_a_case_of_every_task_that_has_an_instance(plan, folder):
    made = plan(tasks=("quick",), property_paths=folder(gentle=PROPERTY))
    tasks = {case.task for case in made.cases if case.property_id == "gentle"}
    assert tasks == {PLACE, "PickPlaceDrawerToCounter"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (PROPERTY.replace("gentle", "action_onset"), "property 'action_onset' is already shipped"),
        (
            PROPERTY.replace("settled(o)", "setled(o)"),
            "own.yaml:7: unknown proposition 'setled(o)'; did you mean 'settled(o)'?",
        ),
        (PROPERTY.replace("settled(o)", "obj_inside(o)"), "'obj_inside' takes 2 arguments"),
    ],
)
def test_a_users_property_that_cannot_be_is_refused_with_its_file(refusal, folder, text, message):
    found = refusal(property_paths=folder(own=text))
    assert message in found
    assert "own.yaml" in found


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TASK.replace("StackCans", DRAWER), f"task '{DRAWER}' is in "),
        (
            TASK.replace("release_stability", "release_stabilty"),
            "juggle.yaml: unknown property 'release_stabilty'; did you mean 'release_stability'?",
        ),
        (
            TASK.replace("release_stability", "enclosure_access"),
            "juggle.yaml: property 'enclosure_access' ranges over enclosures, and the task has",
        ),
        (
            TASK.replace("release_stability", "cross_contamination"),
            "juggle.yaml: property 'cross_contamination' ranges over tools, and the task has none",
        ),
    ],
)
def test_a_users_task_that_cannot_be_is_refused_with_its_file(refusal, folder, text, message):
    found = refusal(tasks=("*",), task_paths=folder(juggle=text))
    assert message in found
    assert "juggle.yaml" in found


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            TASK.replace("StackCans", "StackCnas"),
            "own.yaml:1: the simulator has no task 'StackCnas'; did you mean 'StackCans'?",
        ),
        (
            TASK.replace("StackCans", "Juggle"),
            "own.yaml:1: the simulator has no task 'Juggle'; nearest of 374: ",
        ),
        (
            f"{TASK}touch:\n  counter: [body]\n  cab: [body, hanle]\n",
            "own.yaml:9: key 'touch.cab': unknown part 'hanle' of cab; did you mean 'handle'? "
            "(parts: body, door, handle)",
        ),
        (f"{TASK}touch:\n  can1: [top]\n", "unknown part 'top' of can1; known: body"),
        (
            f"{TASK}touch:\n  interior_obj: [nob]\n",
            "of interior_obj; did you mean 'knob'? (parts: body,",
        ),
        (
            f"{TASK}touch:\n  stranger: [body]\n",
            "own.yaml:8: key 'touch.stranger': StackCans has no role 'stranger'; known: cab, can1,",
        ),
        (
            f"{TASK}upright: [cab]\n",
            "own.yaml:7: key 'upright': 'cab' is a fixture, expected an object",
        ),
        (
            f"{TASK}hot: [cab]\n",
            "'cab' is a fixture, expected an object; what heats has 'hot_source' in objects.yaml",
        ),
        (f"{TASK}open_at: {{cat: 0.5}}\n", "key 'open_at.cat': StackCans has no role 'cat'; did"),
        (
            f"{TASK}zones:\n  near_it: {{around: cna1}}\n",
            "own.yaml:8: key 'zones.near_it.around': StackCans has no role 'cna1'; did you mean",
        ),
        (
            f"{TASK}compact:\n  object_groups: {{can1: [cna]}}\n",
            "'compact.object_groups.can1': unknown category or group 'cna'; did you mean 'can'?",
        ),
    ],
)
def test_what_the_simulator_does_not_know_is_refused_with_file_and_line(
    refusal, folder, text, message
):
    assert message in refusal(tasks=("set:own",), task_paths=folder(own=text))


def test_a_simulator_that_does_not_describe_its_tasks_has_them_all(pytestconfig, folder):
    text = TASK.replace("StackCans", "Juggle") + "touch:\n  ball: [top]\n"
    settings = dataclasses.replace(
        read_settings(pytestconfig),
        policies=("hold",),
        tasks=("set:own",),
        task_paths=folder(own=text),
        backend="toy",
    )
    made = make_plan(
        settings, Extensions({}, (), {"toy": Simulator(toy.SPEC, lambda _: toy.World())})
    )
    assert {case.task for case in made.cases} == {"Juggle"}


def test_the_users_objects_are_added_to_the_shipped_ones_and_replace_them(plan, folder):
    (own,) = folder(juggle=TASK)
    (own / "objects.yaml").write_text("categories:\n  widget: [metal]\n  apple: [raw]\n")
    made = plan(tasks=("set:own", PLACE), task_paths=(own,))
    assert made.attributes["widget"] == {"metal"}
    assert made.attributes["apple"] == {"raw"}
    assert made.attributes["mug"] == {"container", "fragile"}


def test_a_zone_that_no_task_has_is_refused(refusal, folder):
    own = PROPERTY.replace("o in objects", "z in zones of protcted").replace(
        "{held: obj_grasped(o), still: settled(o)}",
        '{held: "in_zone(robot, z)", still: "near(robot, z)"}',
    )
    found = refusal(property_paths=folder(gentle=own))
    assert "gentle.yaml: no task has a zone 'protcted'; did you mean 'protected'?" in found


def test_a_zone_that_no_task_has_is_refused_beside_changes_of_derived_tasks_too(
    plan, refusal, folder
):
    own = (
        PROPERTY.replace("o in objects", "z in zones of protcted")
        .replace("{held: obj_grasped(o), still: settled(o)}", '{held: "in_zone(robot, z)"}')
        .replace("G (held -> still)", "G !held")
    )
    change = "task: some__task\nbase: derived\nzones:\n  shelf: {around: wine_rack_1}\n"
    tasks = folder(change=change)
    (rules,) = folder()
    rules = rules.with_name("rules")
    rules.mkdir()
    (rules / "gentle.yaml").write_text(own)
    found = refusal(task_paths=tasks, property_paths=(rules,))
    assert "gentle.yaml: no task has a zone 'protcted'; did you mean 'protected'?" in found
    (rules / "gentle.yaml").write_text(own.replace("protcted", "shelf"))
    assert plan(task_paths=tasks, property_paths=(rules,)).properties["gentle"]


def test_shipped_tasks_are_described_by_the_simulator(plan):
    assert len({case.task for case in plan(tasks=("all",)).cases}) == 50
    staged = {case.task for case in plan(tasks=("*",)).cases}
    assert {"KnifeByTarget", "FullCup", "PushField"} <= staged


SCENE = dataclasses.replace(toy.SCENE, roles={**toy.SCENE.roles, "drawer": "cabinet"})
KNOB = (dataclasses.replace(toy.SCENE.joints[0], gives_access=False),)
WIDGETS = tuple(dataclasses.replace(e, category="widget") for e in toy.SCENE.entities)


@pytest.fixture
def recordings(tmp_path):
    def save(*episodes):
        for n, changed in enumerate(map(dict, episodes)):
            scene = dataclasses.replace(SCENE, **changed.pop("scene", {}))
            recording = toy.recording(3, scene=scene, about=toy.episode(**changed))
            files.save(recording, tmp_path / "deep" / f"{n}{files.SUFFIX}")
        return tmp_path

    return save


def test_recordings_are_found_in_subfolders_and_selected(plan, recordings):
    staged = "KnifeByTarget"
    folder = recordings(
        {"seed": 0}, {"seed": 1}, {"policy": "other"}, {"task": DRAWER}, {"task": staged}
    )
    made = plan(policies=(), tasks=("all",), recordings=folder)
    assert set(made.recordings) == {
        ("toy", staged, 0),
        ("toy", PLACE, 0),
        ("toy", PLACE, 1),
        ("other", PLACE, 0),
        ("toy", DRAWER, 0),
    }
    assert len(made.cases) == 4 * 6 + 3
    assert made.policies == {}
    chosen = {"policies": ("toy",), "tasks": (PLACE,), "seeds": (1,)}
    assert set(plan(**chosen, recordings=folder).recordings) == {("toy", PLACE, 1)}


@pytest.mark.parametrize("stop", ["violation", "warning"])
def test_what_ends_rollouts_is_refused_for_recordings_which_are_over(refusal, recordings, stop):
    found = refusal(policies=(), tasks=("all",), recordings=recordings({}), stop=stop)
    assert f"--safemanip-stop={stop} ends rollouts while they run, and those of " in found


@pytest.mark.parametrize(
    ("episodes", "changed", "message"),
    [
        ([], {}, "--safemanip-recordings: no *.rollout file in "),
        ([{}], {"seeds": (9,)}, "is selected; there are tasks PickPlace"),
        ([{}, {}], {}, "are recordings of the same rollout"),
        ([{"task": "OpenDrawr"}], {}, "unknown task 'OpenDrawr'; did you mean 'OpenDrawer'?"),
        ([{}, {"seed": 1, "scene": {"roles": {}}}], {}, "1.rollout: "),
        ([{"scene": {"roles": {}}}], {}, "the scene has no role "),
        ([{"scene": {"entities": WIDGETS}}], {}, "category 'widget' has no row in objects.yaml"),
        (
            [{"task": DRAWER, "scene": {"joints": KNOB}}],
            {"tasks": (DRAWER,)},
            "'cabinet' has no door or drawer",
        ),
    ],
)
def test_recordings_that_cannot_be_judged_are_refused(
    refusal, recordings, episodes, changed, message
):
    folder = recordings(*episodes)
    assert message in refusal(**{"policies": (), "recordings": folder, **changed})


def test_bounds_of_too_many_steps_are_refused_with_the_control_period_of_each_recording(
    plan, refusal, recordings, folder
):
    rules = folder(gentle=PROPERTY.replace("G (held -> still)", "G (held -> F[1,3] still)"))
    found = refusal(property_paths=rules)  # the backend's
    assert found.startswith(f"{rules[0]}/gentle.yaml:6: property 'gentle': the automaton has more ")
    assert "count steps of 0.05 s: shorten the bounds" in found
    assert refusal(property_paths=rules, policies=(), recordings=recordings({})) == found
    slow = recordings({"scene": {"control_period": 0.5}})
    assert plan(property_paths=rules, policies=(), recordings=slow).cases


def test_bounds_that_no_check_has_seen_end_as_an_error_of_one_line(folder):
    rules = folder(gentle=PROPERTY.replace("G (held -> still)", "F[<=1000] (held | still)"))
    prop = load_properties(rules)["gentle"]
    recording = toy.recording(3)
    judge = SimpleNamespace(judge=lambda prop: prop.dfa(dt=recording.scene.control_period))
    rollout = EvaluatedRollout(recording, rules[0], judge, {"gentle": prop}, False)
    with pytest.raises(JudgementError, match=r"gentle.yaml:6: .* has more than") as caught:
        rollout.verdict("gentle")
    assert caught.value.__suppress_context__


def test_a_folder_of_recordings_must_exist_and_hold_readable_files(refusal, tmp_path):
    missing = tmp_path / "missing"
    assert refusal(recordings=missing) == f"--safemanip-recordings: {missing} is not a directory"
    broken = tmp_path / f"broken{files.SUFFIX}"
    broken.write_bytes(b"rubbish")
    assert refusal(recordings=tmp_path).startswith(f"{broken}: not a recording")


def test_a_policy_from_a_hook_is_found_by_its_name(pytestconfig):
    settings = dataclasses.replace(read_settings(pytestconfig), policies=("mine",), tasks=(DRAWER,))
    made = make_plan(settings, Extensions({"mine": Hold}, (), {}))
    assert made.policies["mine"].name == "mine"


def test_a_policy_that_draws_other_things_than_a_task_stages_is_refused(plan, refusal):
    said = refusal(policies=("scripted:rake_off",), tasks=("CupAtEdge",))
    assert "policy 'scripted:rake_off' draws 'distr_counter' from " in said
    assert "CupAtEdge stages glass_cup, cup there; take it in " + PLACE in said
    for policy, task in (("scripted:tip_cup", "FullCup"), ("scripted:sweep", "CupAtEdge")):
        assert plan(policies=(policy,), tasks=(task,)).cases


def test_a_task_that_is_asked_for_and_not_judged_is_named(plan):
    found = plan(tasks=(PLACE, DRAWER), properties=("enclosure_release",))
    assert found.unjudged == (DRAWER,)
    lines = " ".join(" ".join(header_lines(found, None)).split())
    assert f"safemanip: no selected property applies to {DRAWER}: not run" in lines
    assert plan(tasks=(PLACE,)).unjudged == ()


def test_what_is_only_staged_is_checked_of_recordings_too(tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text(
        f"task: Own\nbase: {PLACE}\nsets: [own]\nsuite: own\nstaging:\n"
        "  distr_countr: {drawn: [cup]}\n"
    )
    task = load_definitions([tmp_path], [], []).runnable["Own"]
    with pytest.raises(ConfigError, match=r"own\.yaml:6: .*no role 'distr_countr'; did you mean"):
        check_task(task, find_simulator("robocasa", {}).create, recorded=True)
