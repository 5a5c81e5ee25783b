"""Spaces in YAML: what they declare, and what is refused."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_safemanip import resources
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.rollouts.disturbances.of_actions import Latency
from pytest_safemanip.search.dimension import Deviation
from pytest_safemanip.search.kinds.catalogue import Kinds
from pytest_safemanip.search.kinds.definition import Kind, Setting
from pytest_safemanip.search.space import (
    applicable,
    check_applicable,
    check_drawn,
    load_space,
)
from pytest_safemanip.sim.robocasa.robot import SPEC
from pytest_safemanip.spec.tasks import load_tasks
from tests.search.pure import EVERYTHING, TASK, dimensions_of, space_of

EXAMPLE = Path(__file__).parents[2] / "examples" / "cloning" / "doors.yaml"
HALVED = Kind(
    "halved",
    "Half of what the policy asks for is done late.",
    "s",
    lambda situation, about, setting: situation.disturbed(Latency(0.5 * setting.amount)),
    lambda about, setting, named: f"half is {setting.amount:g} s late",
    high=1.0,
    price=0.5,
    step=0.1,
)


def test_the_shipped_space_is_whole_for_a_policy_that_senses_everything():
    space = load_space(resources.folder("searches") / "default.yaml", Kinds())
    found = applicable(space, TASK, SPEC, "compact", EVERYTHING)
    assert found.left_out == ()
    names = {dimension.name for dimension in found.dimensions.own}
    assert {"left[obj]", "left[other]", "light", "wording", "push_hand", "kitchen"} <= names


def test_what_a_policy_does_not_sense_and_a_backend_cannot_change_is_left_out():
    space = load_space(resources.folder("searches") / "default.yaml", Kinds())
    found = applicable(space, TASK, SPEC, "compact", {"hand"})
    assert "images" not in {dimension.kind.senses for dimension in found.dimensions.own}
    assert any(line.endswith("light: the policy does not look") for line in found.left_out)
    stiff = dataclasses.replace(SPEC, can=frozenset({"move"}))
    found = applicable(space, TASK, stiff, "compact", EVERYTHING)
    assert {dimension.kind.needs for dimension in found.dimensions.own} == {"", "move"}
    assert any("the backend has no 'forces'" in line for line in found.left_out)


def test_what_a_backend_cannot_change_and_a_task_does_not_have_is_refused_of_kept_failures():
    stiff, kinds = dataclasses.replace(SPEC, can=frozenset({"move"})), Kinds()
    check_applicable(kinds["move"], {"move": "obj", "along": "left"}, TASK, stiff, "a.yaml")
    with pytest.raises(ConfigError, match=r"a.yaml: light: the backend has no 'light'"):
        check_applicable(kinds["light"], {"light": "all"}, TASK, stiff, "a.yaml")
    with pytest.raises(ConfigError, match=r"a.yaml: Toy has no 'objj' to change; did you mean"):
        check_applicable(kinds["move"], {"move": "objj", "along": "left"}, TASK, stiff, "a.yaml")


def test_what_a_task_operates_may_begin_otherwise_too(tmp_path):
    task = dataclasses.replace(TASK, skills=(("pick", "obj"), ("press", "microwave")))
    space = space_of(tmp_path, "dimensions: {ajar: {open: operated, limits: [0 %, 50 %]}}", Kinds())
    (ajar,) = applicable(space, task, SPEC, "compact", ()).dimensions.own
    assert ajar.about == {"open": "microwave"}
    with pytest.raises(ConfigError, match="the task has none"):
        applicable(space, TASK, SPEC, "compact", ())


@pytest.mark.parametrize(
    ("name", "door"),
    [
        ("TurnOnMicrowave", "ajar"),
        ("SlideDishwasherRack", "shut"),
        ("CloseFridge", "pot"),
    ],
)
def test_the_example_looks_at_each_door_that_clones_meet(name, door):
    space = load_space(EXAMPLE, Kinds())
    task = load_tasks([resources.folder("tasks")])[name]
    found = applicable(space, task, SPEC, "compact", {"hand"}).dimensions
    assert set(found.by_name) == {door, "latency", "noise"}


@pytest.mark.parametrize(
    ("declared", "category"),
    [
        ("{obstacle: mechanisms, category: pott}", "pott"),
        ("{distractor: any, beside: obj, choices: [can, cupp]}", "cupp"),
    ],
)
def test_a_category_that_there_is_not_is_refused(tmp_path, declared, category):
    (own,) = space_of(tmp_path, f"dimensions: {{a: {declared}}}", Kinds()).declared
    one = own.dimension
    check_drawn(one.kind, one.about, one.choices, {category, "can"}, own.place)
    with pytest.raises(ConfigError, match=rf"unknown category '{category}'; did you mean"):
        check_drawn(one.kind, one.about, one.choices, {"pot", "can", "cup"}, own.place)


def test_sizes_have_any_unit_of_their_quantity(tmp_path):
    text = "dimensions: {near: {move: obj, along: left, limits: [-0.02 m, 40 mm], price: 1 cm}}"
    (dimension,) = dimensions_of(tmp_path, text).own
    assert (dimension.low, dimension.high, dimension.price) == (-2.0, 4.0, 1.0)


def test_a_kind_of_the_users_is_one_like_the_others(tmp_path):
    space = space_of(
        tmp_path, "dimensions: {h: {halved: all, limits: [0 ms, 400 ms]}}", Kinds([HALVED])
    )
    dimensions = applicable(space, TASK, SPEC, "compact", ()).dimensions
    deviation = Deviation((("h", Setting(0.4)),))
    assert dimensions.situation(deviation).disturbances == (Latency(0.2),)
    assert dimensions.say(deviation, str) == "half is 0.4 s late"


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("a text", "gives a str, expected"),
        (dataclasses.replace(HALVED, name="push"), "'push' exist already; rename it"),
        (dataclasses.replace(HALVED, unit="feet"), "unknown unit 'feet'"),
        (dataclasses.replace(HALVED, step=0.0), "expected a step of more than 0"),
        (dataclasses.replace(HALVED, low=0.2), "expected low <= 0 <= high"),
    ],
)
def test_what_is_no_kind_is_refused(kind, message):
    with pytest.raises(ConfigError, match=message):
        Kinds([kind])


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ("{mvoe: obj}", "did you mean 'move'"),
        ("{move: obj, push: obj}", "expected one key that is a kind, found 'move' and 'push'"),
        ("{move: obj, along: down}", "unknown direction 'down'"),
        ("{move: obj, along: left, limits: [1 cm, 4 cm]}", "a size of at most 0"),
        ("{latency: actions, limits: [-1 s, 1 s]}", "expected 0 first, then one above 0"),
        ("{latency: actions, limits: [0 s, 1000 s]}", "expected 0 ms to 40000 ms for 'latency'"),
        ("{dropped: frames, limits: [0 %, 101 %]}", "expected 0 % to 100 % for 'dropped'"),
        ("{noise: actions, limits: [0 %, 0.001 %]}", "limits.*expected 1 to 1,000,000 steps"),
        ("{noise: actions, step: 0.0000001 %}", "step.*expected 1 to 1,000,000 steps"),
        ("{latency: actions, limits: [0 s, 4 cm]}", "expected a number and a unit"),
        ("{latency: actions, limits: [0 s]}", "expected two sizes, found 1"),
        ("{latency: actions, limits: [0 s, .nan s]}", "a number and a unit, found"),
        ("{latency: actions, choices: [a]}", "has a size, and no choices"),
        ("{object: obj}", "needs 'choices'"),
        ("{object: obj, choices: [a, a]}", "given twice"),
        ("{object: obj, choices: [a], limits: [0 cm, 1 cm]}", "has choices, and no size"),
        ("{latency: actions, price: 0 s}", "a size above 0"),
        ("{latency: actions, colour: red}", "colour"),
        ("{latency: observations}", "expected 'actions', found 'observations'"),
        ("{shut: operatd}", "unknown 'operatd'; did you mean 'operated'"),
        ("{obstacle: mechanisms, category: pot, beside: obj}", "beside"),
        ("{obstacle: mechanisms}", "category"),
    ],
)
def test_what_is_no_dimension_is_refused_with_its_place(tmp_path, declared, message):
    with pytest.raises(ConfigError, match=rf"space.yaml:\d+: .*{message}"):
        space_of(tmp_path, f"dimensions:\n  own: {declared}")


def test_a_role_that_the_task_lacks_is_refused_where_the_space_is_for_it_alone(tmp_path):
    text = "tasks: [Toy]\ndimensions:\n  own: {move: mug, along: left}"
    with pytest.raises(ConfigError, match=r"space.yaml:3: Toy has no 'mug' to change; .*obj"):
        dimensions_of(tmp_path, text)


def test_two_spaces_have_no_dimension_twice(tmp_path):
    one = space_of(tmp_path)
    with pytest.raises(ConfigError, match=r"dimension 'left' is declared twice, first in .*:3"):
        one.joined(one)
