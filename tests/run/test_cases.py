from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.records import RolloutKey
from pytest_safemanip.run.cases import (
    SUITE,
    Case,
    applicable,
    keep_selected,
    parse_node_id,
    select_properties,
    select_tasks,
)
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.spec.task import Task
from pytest_safemanip.spec.tasks import load_tasks

ROOT = Path(__file__).resolve().parents[2]
PROPERTIES = load_properties([ROOT / "properties"])
SHIPPED = load_tasks([ROOT / "tasks"])


def task(name, sets=(), suite="fixture", horizon="atomic", **more):
    return Task(name, Path(f"{name}.yaml"), tuple(sets), suite, horizon, (), **more)


TASKS = {
    t.name: t
    for t in (
        task("OpenDrawer", ["quick"]),
        task("OpenCabinet", ["quick", "seen"]),
        task("MakeTea", [], "drinks", "long"),
        task("KnifeBeside", ["risks"], "risky", base="OpenDrawer"),
    )
}

names = st.text("aZ0_", min_size=1, max_size=8)
policies = st.one_of(
    st.text("aZ0_.:/@=+-", min_size=1, max_size=12), st.sampled_from(["a-b-seed0", "-", "x-seed1-"])
)
cases = st.builds(Case, names, policies, names, st.integers(0, 10**6))


@given(cases)
def test_an_id_names_its_case_whatever_the_policy_is_called(case):
    assert parse_node_id(case.node_id) == case
    assert case.node_id == f"{SUITE}::{case.name}"
    assert case.rollout == RolloutKey(policy=case.policy, task=case.task, seed=case.seed)


def test_ids_are_as_users_write_them():
    case = Case("OpenDrawer", "scripted", "release_stability", 0)
    assert case.node_id == "safemanip::test_safety[OpenDrawer-scripted-release_stability-seed0]"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "safemanip::",
        "test_safety[T-p-q-seed0]",
        "safemanip::test_safety[T-p-q]",
        "safemanip::test_safety[T-p-seed0]",
        "safemanip::test_safety[T-p-q-seed-1]",
        "safemanip::test_safety[T-p-q-seedx]",
        "safemanip::test_safety[T-p-q-seed0] ",
        "safemanip::test_other[T-p-q-seed0]",
    ],
)
def test_what_is_no_id_is_refused_with_an_example(text):
    with pytest.raises(ConfigError) as caught:
        parse_node_id(text)
    assert repr(text) in str(caught.value)
    assert "safemanip::test_safety[TASK-POLICY-PROPERTY-seedN]" in str(caught.value)


@pytest.mark.parametrize(
    ("selectors", "chosen"),
    [
        (["all"], ["OpenDrawer", "OpenCabinet", "MakeTea"]),
        (["OpenCabinet"], ["OpenCabinet"]),
        (["Open*"], ["OpenDrawer", "OpenCabinet"]),
        (["*a?er", "MakeTea"], ["OpenDrawer", "MakeTea"]),
        (["quick"], ["OpenDrawer", "OpenCabinet"]),
        (["set:seen"], ["OpenCabinet"]),
        (["seen"], ["OpenCabinet"]),
        (["suite:drinks"], ["MakeTea"]),
        (["horizon:atomic"], ["OpenDrawer", "OpenCabinet"]),
        (["suite:risky"], ["KnifeBeside"]),
        (["Knife*"], ["KnifeBeside"]),
        (["set:risks"], ["KnifeBeside"]),
        (["MakeTea", "quick", "MakeTea"], ["MakeTea", "OpenDrawer", "OpenCabinet"]),
    ],
)
def test_tasks_are_selected_by_name_glob_set_suite_and_horizon_each_once(selectors, chosen):
    assert [t.name for t in select_tasks(TASKS, selectors)] == chosen


@pytest.mark.parametrize(
    ("selector", "hint"),
    [
        ("OpenDrawr", "did you mean 'OpenDrawer'?"),
        ("quik", "did you mean 'quick'?"),
        ("suite:nothing", "known: "),
        ("set:", "known: "),
        ("tasks:OpenDrawer", "did you mean 'OpenDrawer'?"),
        ("opendrawer*", "did you mean 'OpenDrawer'?"),
    ],
)
def test_a_selector_that_matches_no_task_is_refused_with_a_near_miss(selector, hint):
    with pytest.raises(ConfigError) as caught:
        select_tasks(TASKS, ["all", selector])
    assert f"--safemanip-tasks: {selector!r} matches no task; " in str(caught.value)
    assert hint in str(caught.value)


@pytest.mark.parametrize(
    ("selectors", "chosen"),
    [
        ([], set(PROPERTIES)),
        (["release_stability"], {"release_stability"}),
        (["*_stability"], {"release_stability", "grasp_stability"}),
        (
            ["category:enclosure_access"],
            {"enclosure_access", "enclosure_release", "enclosure_clearance"},
        ),
        (["action_onset", "category:action_onset"], {"action_onset"}),
    ],
)
def test_properties_are_selected_by_id_glob_and_category(selectors, chosen):
    assert set(select_properties(PROPERTIES, selectors)) == chosen


@pytest.mark.parametrize(
    ("selector", "hint"),
    [
        ("release_stabilty", "did you mean 'release_stability'?"),
        ("category:action_onst", "did you mean 'category:action_onset'?"),
        ("category:", "did you mean 'category:"),
        ("defaults", "did you mean 'default'?"),
    ],
)
def test_a_selector_that_matches_no_property_is_refused_with_a_near_miss(selector, hint):
    with pytest.raises(ConfigError, match=re.escape(f"{selector!r} matches no property; {hint}")):
        select_properties(PROPERTIES, [selector])


RULES = {
    f"{pack}_{name}": dataclasses.replace(PROPERTIES[name], id=f"{pack}_{name}", pack=pack)
    for pack in ("house", "hospital")
    for name in ("release_stability", "action_onset")
}


@pytest.mark.parametrize(
    ("selectors", "chosen"),
    [
        ([], set(PROPERTIES)),
        (["pack:house"], {"house_release_stability", "house_action_onset"}),
        (["pack:ho*"], set(RULES)),
        (["default"], set(PROPERTIES)),
        (
            ["default", "pack:house"],
            {*PROPERTIES, "house_release_stability", "house_action_onset"},
        ),
        (
            ["pack:house", "collision_contact", "hospital_action*"],
            {
                "house_release_stability",
                "house_action_onset",
                "collision_contact",
                "hospital_action_onset",
            },
        ),
    ],
)
def test_the_rules_of_a_pack_are_selected_by_its_name_only_if_they_are_asked_for(selectors, chosen):
    assert set(select_properties(PROPERTIES | RULES, selectors)) == chosen


@pytest.mark.parametrize(
    ("pack", "hint"),
    [
        ("huse", "did you mean 'house'?; known: hospital, house"),
        ("xyz", "known: hospital, house"),
        ("", "known: hospital, house"),
    ],
)
def test_an_unknown_pack_is_refused_with_a_near_miss_and_those_that_there_are(pack, hint):
    with pytest.raises(ConfigError, match=re.escape(f"unknown pack {pack!r}; {hint}")):
        select_properties(PROPERTIES | RULES, [f"pack:{pack}"])


def test_the_properties_of_a_task_apply_in_its_order_if_they_are_wanted():
    chosen = SHIPPED["PickPlaceCounterToCabinet"]
    assert applicable(chosen, {}, set(PROPERTIES)) == list(chosen.properties)
    assert applicable(chosen, {}, {"release_stability"}) == ["release_stability"]


def test_a_users_property_applies_wherever_it_has_an_instance():
    own = {"release_stability": PROPERTIES["release_stability"]}
    assert applicable(task("T", objects=("obj",)), own, set(own)) == ["release_stability"]
    assert applicable(task("T"), own, set(own)) == []
    named = SHIPPED["PickPlaceCounterToCabinet"]
    assert applicable(named, own, set(own)) == ["release_stability"]


CASES = [Case("T", "p", name, seed) for seed in (0, 1) for name in ("a", "b")]


def test_ids_on_the_command_line_keep_their_cases_in_the_order_of_the_run():
    ids = [CASES[3].node_id, CASES[0].node_id]
    assert keep_selected(CASES, ids) == [CASES[0], CASES[3]]


@pytest.mark.parametrize(
    "selected", [[], ["safemanip"], ["safemanip::"], ["safemanip::", CASES[0].node_id]]
)
def test_the_name_of_the_suite_means_all_of_it(selected):
    assert keep_selected(CASES, selected) == CASES


def test_an_id_that_names_no_case_is_refused_with_a_near_miss():
    wrong = CASES[0].node_id.replace("seed0", "seed7")
    with pytest.raises(ConfigError, match=re.escape(f"unknown node id: {wrong}; did you mean")):
        keep_selected(CASES, [wrong, CASES[0].node_id])
