"""Answers from memory against robosuite's own."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pytest_safemanip.sim.robocasa.patches import environments
from pytest_safemanip.sim.robocasa.patches.memo import ContactCheck
from pytest_safemanip.sim.robocasa.stepping.exact import Stepper
from tests.sim.stepping.test_stepping import assert_identical, random_actions

Make = Callable[..., Any]


@pytest.fixture
def original(assets_root: Any) -> Callable[[str, str], tuple[Any, Any]]:
    """What RoboCasa calls, and robosuite's function behind it."""

    def get(module: str, name: str) -> tuple[Any, Any]:
        answer = getattr(__import__(module, fromlist=[name]), name)
        return answer, answer.__wrapped__

    return get


@pytest.mark.parametrize("text", ["0 1 2", " -0.0 1e-3", "0.1", "None 1", "7"])
def test_texts_become_the_same_numbers(original: Any, text: str) -> None:
    answer, function = original("robocasa.models.fixtures.cabinets", "s2a")
    first = answer(text)
    assert np.array_equal(first, function(text))
    first[:] = 5.0  # nobody else sees this
    assert np.array_equal(answer(text), function(text))


def test_a_text_that_is_no_number_is_refused_as_before(original: Any) -> None:
    answer, function = original("robocasa.models.fixtures.cabinets", "s2a")
    for parse in (answer, function):
        with pytest.raises(ValueError, match="could not convert"):
            parse("here")


def test_angles_become_the_same_bits(original: Any) -> None:
    answer, function = original("robosuite.utils.transform_utils", "euler2mat")
    random = np.random.default_rng(0).uniform(-4, 4, (20, 3))
    zeros = [list(signs) for signs in itertools.product((0.0, -0.0), repeat=3)]
    for angles in [*random, *random, *zeros, [0, 0, 1], random]:
        found = answer(angles)
        assert found.tobytes() == function(angles).tobytes()
        found[:] = 5.0


@pytest.mark.parametrize("name", ["mat2euler", "mat2quat", "quat2mat"])
def test_turns_become_the_same_bits(original: Any, name: str) -> None:
    answer, function = original("robosuite.utils.transform_utils", name)
    turns = Rotation.random(20, random_state=0)
    inputs = turns.as_quat() if name == "quat2mat" else turns.as_matrix()
    for turn in [*inputs, *inputs, inputs[0].astype(np.float32), inputs[1].tolist()]:
        found, expected = answer(turn), function(turn)
        assert (found.tobytes(), found.dtype) == (expected.tobytes(), expected.dtype)
        found[:] = 5.0
    if name == "mat2euler":
        assert np.array_equal(answer(inputs[0], "rzyx"), function(inputs[0], "rzyx"))


def test_placements_are_refused_as_robocasa_refuses_them(original: Any, make_kitchen: Make) -> None:
    answer, function = original("robocasa.utils.placement_samplers", "objs_intersect")
    env = make_kitchen("PickPlaceCounterToCabinet")
    random, answers = np.random.default_rng(0), set()
    things = [*env.objects.values(), env.counter]
    for _ in range(60):
        places = [
            (
                things[k],
                random.uniform(-0.2, 0.2, 3),
                Rotation.random(random_state=random).as_quat(),
            )
            for k in random.integers(len(things), size=2)
        ]
        asked = [value for place in places for value in place]
        expected = function(*asked)
        assert answer(*asked) == expected
        answers.add(expected)
    assert answers == {False, True}


def test_corners_are_those_of_the_place_that_was_asked_for(make_kitchen: Make) -> None:
    env = make_kitchen("PickPlaceCounterToCabinet")
    thing = env.objects["obj"]
    own = type(thing).get_bbox_points
    Stepper(env, lambda _: None)
    turn = np.array((0.0, 0.0, 0.6, 0.8))
    for place in (np.zeros(3), np.ones(3), np.ones(3), None):
        for rotation in (None, turn):
            found, expected = thing.get_bbox_points(place, rotation), own(thing, place, rotation)
            assert np.array_equal(found, expected)
            found[0][:] = 5.0


def test_fixtures_that_moved_are_as_robocasa_would_have_them(make_kitchen: Make) -> None:
    from robocasa.models import fixtures

    kinds = [getattr(fixtures, name) for name in ("Sink", "Stove", "Oven", "Dishwasher", "Fridge")]
    env = make_kitchen("PickPlaceCounterToCabinet", "target")
    stepper = Stepper(env, lambda _: None)
    drawer = next(f for f in env.fixtures.values() if isinstance(f, fixtures.Drawer))
    watched = [drawer, *(f for f in env.fixtures.values() if isinstance(f, tuple(kinds)))]
    assert all(any(isinstance(f, kind) for f in watched) for kind in kinds)
    model, random, seen = env.sim.model._model, np.random.default_rng(0), []
    for moved in (False, True, False, True, True):
        for fixture in watched if moved else ():
            for joint in map(model.joint, env.sim.model.joint_names):
                if joint.name.startswith(fixture.naming_prefix):
                    env.sim.data.qpos[joint.qposadr[0]] = random.uniform(*joint.range)
        stepper.step(np.zeros(12))
        found = [state(env, fixture) for fixture in watched]
        for fixture in watched:
            type(fixture).update_state(fixture, env)
        assert found == [state(env, fixture) for fixture in watched]
        for fixture in watched:
            for name in ("get_handle_state", "get_knobs_state"):
                if hasattr(fixture, name):
                    expected = getattr(type(fixture), name)(fixture, env)
                    assert getattr(fixture, name)(env=env) == expected
            answer, expected = (
                ask(relative=False)
                for ask in (fixture.get_int_sites, type(fixture).get_int_sites.__get__(fixture))
            )
            assert {key: np.array(points).tobytes() for key, points in answer.items()} == {
                key: np.array(points).tobytes() for key, points in expected.items()
            }
            for points in answer.values():
                points[0][:] = 5.0  # nobody else sees this
        seen.append(found)
    for states in zip(*seen, strict=True):
        assert any(states[0] != later for later in states[1:])


def test_what_lies_on_a_rack_is_known_when_it_is_put_there_and_taken_away(
    make_kitchen: Make,
) -> None:
    from robocasa.models import fixtures

    env = make_kitchen("PickPlaceCounterToCabinet", "target")
    Stepper(env, lambda _: None)
    racks = [
        fixture
        for fixture in env.fixtures.values()
        if isinstance(fixture, (fixtures.Dishwasher, fixtures.Oven))
    ]
    assert len({type(fixture) for fixture in racks}) == 2
    model, data = env.sim.model._model, env.sim.data._data
    (joint,) = env.objects["obj"].joints
    place = data.joint(joint).qpos
    away = place.copy()
    for fixture in racks:
        own = [n for n in range(model.ngeom) if model.geom_contype[n]]
        own = [n for n in own if f"{fixture.name}_rack" in model.body(model.geom_bodyid[n]).name]
        answers = set()
        for geom in (None, *own, None, *own[:1]):
            place[:] = away
            if geom is not None:
                place[:3] = data.geom_xpos[geom]
            env.sim.forward()
            found = fixture.check_rack_contact(env, "obj")
            assert found == type(fixture).check_rack_contact(fixture, env, "obj")
            answers.add((geom is not None, found))
        assert {(False, False), (True, True)} <= answers


def state(env: Any, fixture: Any) -> list[Any]:
    """What ``update_state`` of a fixture writes: its state, its interiors, its sites."""
    points = [
        (name, region[key].tobytes())
        for name, region in fixture._regions.items()
        for key in ("p0", "px", "py", "pz")
    ]
    own = {key: value for key, value in vars(fixture).items() if isinstance(value, (float, dict))}
    own = {key: dict(value) if isinstance(value, dict) else value for key, value in own.items()}
    own.pop("_regions")
    model = env.sim.model._model
    sites = [n for n in range(model.nsite) if model.site(n).name.startswith(fixture.naming_prefix)]
    return [points, own, model.site_rgba[sites].tobytes(), model.site_size[sites].tobytes()]


@pytest.mark.parametrize(("task", "scenes"), [("OpenDrawer", "compact"), ("OpenCabinet", "target")])
def test_a_scene_settles_to_the_same_bits(
    make_kitchen: Make, monkeypatch: pytest.MonkeyPatch, task: str, scenes: str
) -> None:
    def same(env: Any, controls: Any) -> contextlib.AbstractContextManager[None]:
        return contextlib.nullcontext()

    ours = make_kitchen(task, scenes)
    monkeypatch.setattr(environments, "quick_settling", same)
    stock = make_kitchen(task, scenes)
    assert_identical(ours, stock, "after the reset")
    for action in random_actions(2):
        ours.step(action.copy())
        stock.step(action.copy())
        assert_identical(ours, stock, "after robosuite's own step")


def test_contacts_are_found_as_robosuite_finds_them(make_kitchen: Make) -> None:
    from robosuite.utils.sim_utils import check_contact

    env = make_kitchen("PickPlaceCounterToCabinet")
    stepper = Stepper(env, lambda _: None)
    for action in random_actions(4):
        stepper.step(action)
    names = list(env.sim.model._geom_name2id)
    touching = {env.sim.model.geom_id2name(n) for n in env.sim.data._data.contact.geom.flat}
    gripper, thing = env.robots[0].gripper["right"], env.objects["obj"]
    groups = [gripper, thing, [], ["no such geom"], names[:40], sorted(touching - {None})[:3]]
    groups += sorted(touching - {None})
    check, answers = ContactCheck(env.sim), set()
    for one, other in itertools.product(groups, [None, *groups]):
        expected = check_contact(env.sim, one, other)
        assert check(one, other) == expected == env.check_contact(one, other)
        answers.add((other is None, expected))
    assert len(answers) == 4
