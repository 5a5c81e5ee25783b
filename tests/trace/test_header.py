from __future__ import annotations

import dataclasses
import json

import pytest

from pytest_safemanip.errors import TraceError
from pytest_safemanip.trace.elements import (
    ActionEntry,
    Body,
    Box,
    Camera,
    Entity,
    Liquid,
    Part,
    Surface,
)
from pytest_safemanip.trace.episode import Episode
from pytest_safemanip.trace.hazard import Hazard
from pytest_safemanip.trace.recording import check
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.surfaces import Surfaces
from tests import toy

JSON = toy.episode().to_json()
(HAND,) = toy.SCENE.grippers
HAZARD = {"property_id": "release_stability", "entities": ["mug"], "first": 3, "last": 5}


def test_an_episode_survives_as_json():
    assert Episode.from_json(JSON) == toy.episode()


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"task": 3}, "episode: task must be a string"),
        ({"instruction": None}, "episode: instruction must be a string"),
        ({"assets": ["a"]}, "episode: assets must be a string"),
        ({"seed": -1}, "episode: seed must be an integer from 0 up"),
        ({"seed": True}, "episode: seed must be an integer from 0 up"),
        ({"seed": 1.0}, "episode: seed must be an integer from 0 up"),
        ({"horizon": "5"}, "episode: horizon must be an integer from 0 up"),
        ({"versions": []}, "episode: versions must be a mapping to strings"),
        ({"request": ["OpenDrawer"]}, "episode: request must be a mapping"),
        ({"hashes": {"key": 1}}, "episode: hashes must be a mapping to strings"),
        ({"policy": ""}, "episode: '' is no name of a policy"),
        ({"policy": "a\nb"}, "episode: 'a\\nb' is no name of a policy"),
        ({"policy": "../a b"}, "episode: '../a b' is no name of a policy"),
        ({"extra": 1}, "episode: malformed description"),
        ({"seed": 2**33}, "episode: seed must be an integer from 0 up to"),
        ({"horizon": -1}, "episode: horizon must be an integer from 0 up"),
        (
            {"ended": "x"},
            "episode: ended must be one of success, horizon, policy, violation, stalled, warning, "
            "found 'x'",
        ),
        ({"disturbances": [1]}, "episode: each of its disturbances must be a mapping with a kind"),
        ({"disturbances": [{}] * 101}, "episode: disturbances must be a list of at most 100"),
        ({"repeat": -1}, "episode: repeat must be an integer from 0"),
        ({"served": {"clipped": "-1"}}, "episode: served: clipped must be a count, found '-1'"),
        ({"served": {"protocol": "p"}}, "episode: served: calls must be a count, found 'nothing'"),
        (
            {"served": {"protocol": "p", "calls": "1", "actions": "1", "clipped": "0"}},
            "episode: served: seeded must be yes or no, found 'nothing'",
        ),
    ],
)
def test_a_bad_field_of_an_episode_is_refused_by_name(changed, message):
    with pytest.raises(TraceError) as caught:
        Episode.from_json({**JSON, **changed})
    assert message in str(caught.value)


def test_an_episode_without_hazards_has_none():
    rest = {name: value for name, value in JSON.items() if name != "hazards"}
    assert Episode.from_json(rest).hazards == ()


@pytest.mark.parametrize(
    ("hazards", "message"),
    [
        ("no list", "hazards must be a list of at most 100"),
        ([HAZARD] * 101, "hazards must be a list of at most 100"),
        ([1], "not a hazard: 1"),
        ([{**HAZARD, "extra": 1}], "not a hazard"),
        ([{**HAZARD, "property_id": 1}], "a hazard of what?"),
        ([{**HAZARD, "entities": [1]}], "a hazard of what?"),
        ([{**HAZARD, "first": 6}], "steps 0 <= first <= last"),
        ([{**HAZARD, "first": -1}], "steps 0 <= first <= last"),
        ([{**HAZARD, "last": 5.0}], "steps 0 <= first <= last"),
    ],
)
def test_a_bad_hazard_is_refused(hazards, message):
    with pytest.raises(TraceError) as caught:
        Episode.from_json({**JSON, "hazards": hazards})
    assert message in str(caught.value)


def test_hazards_survive_as_json():
    episode = Episode.from_json({**JSON, "hazards": [HAZARD]})
    assert episode.hazards == (Hazard("release_stability", ("mug",), 3, 5),)
    assert Episode.from_json(json.loads(json.dumps(episode.to_json()))) == episode


OPTIONAL = {
    *("failure", "warned", "hazards", "request", "patches", "binding", "origin"),
    *("disturbances", "repeat"),
}


@pytest.mark.parametrize("field", sorted(set(JSON) - OPTIONAL))
def test_a_missing_field_of_an_episode_is_refused_by_name(field):
    rest = {name: value for name, value in JSON.items() if name != field}
    with pytest.raises(TraceError, match=f"malformed description .*{field}"):
        Episode.from_json(rest)


def test_the_patches_of_an_episode_are_names():
    assert Episode.from_json({**JSON, "patches": ["legacy_base"]}).patches == ("legacy_base",)
    with pytest.raises(TraceError, match="episode: patches must be a list of strings"):
        Episode.from_json({**JSON, "patches": [1]})


def test_a_scene_survives_as_json():
    assert Scene.from_json(toy.SCENE.to_json()) == toy.SCENE


@pytest.mark.parametrize("field", [f.name for f in dataclasses.fields(Scene)])
def test_a_missing_field_of_a_scene_is_refused_by_name(field):
    rest = {name: value for name, value in toy.SCENE.to_json().items() if name != field}
    with pytest.raises(TraceError, match=f"scene: malformed description .*{field}"):
        Scene.from_json(rest)


WET = {"entities": (*toy.SCENE.entities, Entity("water", "liquid", "water"))}
HINGE = toy.SCENE.joints[0]
MUG = toy.SCENE.bodies[0]


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"control_period": 0.0}, "control_period must be in [0.0001, 10) s: 0.0"),
        ({"control_period": -0.05}, "control_period must be in [0.0001, 10) s: -0.05"),
        ({"control_period": float("nan")}, "control_period must be in [0.0001, 10) s: nan"),
        ({"control_period": float("inf")}, "control_period must be in [0.0001, 10) s: inf"),
        (
            {"entities": (*toy.SCENE.entities, Entity("mug", "fixture", "x"))},
            "two entities have the same name",
        ),
        (
            {"bodies": (Body("cup", (1, 1, 1), (0, 0, 0), (0, 0, 0), 1.0),)},
            "bodies name an unknown entity 'cup'",
        ),
        ({"parts": (Part("cup", "body"),)}, "parts name an unknown entity 'cup'"),
        (
            {"parts": (Part("cabinet", "door", "cabinet/left"),)},
            "parts name an unknown joint 'cabinet/left'",
        ),
        ({"boxes": (Box("cup", "x", "interior", (1, 1, 1)),)}, "boxes name an unknown entity"),
        (
            {"surfaces": (Surface("counter", "a/b", (1, 1, 1), (0, 0, 0, *toy.UPRIGHT)),)},
            "surfaces name an unknown joint 'a/b'",
        ),
        ({"roles": {"obj": "cup"}}, "role 'obj' names an unknown entity 'cup'"),
        (
            {"bodies": (dataclasses.replace(MUG, half=(1.0, -0.1, 1.0)),)},
            "bodies of 'mug': half is negative: (1.0, -0.1, 1.0)",
        ),
        (
            {"bodies": (dataclasses.replace(MUG, com=(0.0, 0.0)),)},
            "bodies of 'mug': com must be 3 finite numbers: (0.0, 0.0)",
        ),
        (
            {"joints": (dataclasses.replace(HINGE, axis=(0.0, 0.0, 0.0)),)},
            "joints of 'cabinet': axis is not of unit length",
        ),
        (
            {"joints": (dataclasses.replace(HINGE, anchor=(0.0, 0.0, float("nan"))),)},
            "joints of 'cabinet': anchor must be 3 finite numbers",
        ),
        (
            {"surfaces": (Surface("counter", "", (1, 1, 1), (0, 0, 0, 1, 1, 0, 0)),)},
            "surfaces of 'counter': pose is not of unit length: (1, 1, 0, 0)",
        ),
        ({"control_period": 1e-300}, "control_period must be in [0.0001, 10) s: 1e-300"),
        (
            {"bodies": (dataclasses.replace(MUG, half=(1e300, 0.1, 0.1)),)},
            "bodies of 'mug': half is beyond 1e+06: (1e+300, 0.1, 0.1)",
        ),
        (
            {"bodies": (dataclasses.replace(MUG, mass=1e300),)},
            "bodies of 'mug': mass is beyond 1e+06: 1e+300",
        ),
        (
            {"grippers": (dataclasses.replace(HAND, half=(0.1, 0.1)),)},
            "gripper 'hand': half must be 3 finite numbers: (0.1, 0.1)",
        ),
        (
            {"grippers": (dataclasses.replace(HAND, fingers=(("finger_left",),)),)},
            "gripper 'hand' needs two groups of fingers or more",
        ),
        (
            {"grippers": (dataclasses.replace(HAND, fingers=(("finger_left",), ())),)},
            "gripper 'hand' needs two groups of fingers or more",
        ),
        (
            {"grippers": (dataclasses.replace(HAND, palm=("thumb",)),)},
            "gripper 'hand' names a part 'thumb' that the robot does not have",
        ),
        (
            {"grippers": (dataclasses.replace(HAND, palm=("finger_left",)),)},
            "gripper 'hand' names a part 'finger_left' that is named twice",
        ),
        ({"grippers": (HAND, HAND)}, "two grippers have the same name"),
        (
            {"actions": (ActionEntry("close"), ActionEntry("close"))},
            "two entries of the action have the same name",
        ),
        (
            {"actions": (ActionEntry("close", 1.0, -1.0),)},
            "action 'close' must have finite limits, the lower one first: 1.0, -1.0",
        ),
        (
            {"cameras": (Camera("front", 0.8, 1.5), Camera("front", 0.8, 1.5))},
            "two cameras have the same name",
        ),
        (
            {"cameras": (Camera("front", 0.0, 1.5),)},
            "camera 'front': fov must be a number above 0: 0.0",
        ),
        ({"cameras": (Camera("front", 3.2, 1.5),)}, "camera 'front': fov must be below pi"),
        (
            {"cameras": (Camera("front", 0.8, float("nan")),)},
            "camera 'front': aspect must be a number above 0: nan",
        ),
        ({"liquids": (Liquid("water", 3, 0.01),)}, "liquids name an unknown entity 'water'"),
        ({"liquids": (Liquid("mug", 3, 0.01),)}, "liquids: 'mug' is no liquid"),
        ({**WET, "liquids": (Liquid("water", 0, 0.01),)}, "'water' must have 1 to 10000 particles"),
        ({**WET, "liquids": (Liquid("water", 10**9, 0.01),)}, "must have 1 to 10000 particles"),
        ({**WET, "liquids": (Liquid("water", 2.5, 0.01),)}, "liquids[0]: count must be an integer"),
        ({**WET, "liquids": (Liquid("water", 3, -1.0),)}, "liquids of 'water': radius must be"),
        ({**WET, "liquids": (Liquid("water", 3, 0.01),) * 2}, "an entity is named twice"),
        (
            {"actions": (ActionEntry("close", float("nan")),)},
            "action 'close' must have finite limits",
        ),
    ],
)
def test_an_impossible_scene_is_refused_by_field_and_entity(changed, message):
    scene = dataclasses.replace(toy.SCENE, **changed)
    with pytest.raises(TraceError) as caught:
        scene.checked()
    assert str(caught.value).startswith("scene: ")
    assert message in str(caught.value)
    with pytest.raises(TraceError) as again:
        check(toy.recording(scene=scene))
    assert str(again.value) == str(caught.value)


@pytest.mark.parametrize("mass", [-1.0, float("nan")])
def test_an_impossible_mass_is_refused(mass):
    scene = dataclasses.replace(toy.SCENE, bodies=(dataclasses.replace(MUG, mass=mass),))
    with pytest.raises(TraceError, match="bodies of 'mug': mass"):
        scene.checked()


@pytest.mark.parametrize("mass", [10**400, "1.5", None, (1.0,), [1.0, (2.0, 3.0)]])
def test_what_is_no_number_is_refused(mass):
    wrong = dataclasses.replace(toy.SCENE.bodies[1], mass=mass)
    scene = dataclasses.replace(toy.SCENE, bodies=(toy.SCENE.bodies[0], wrong))
    with pytest.raises(TraceError, match=f"bodies of '{wrong.entity}': mass must be a number"):
        scene.checked()


@pytest.mark.parametrize("half", [(1, 1, "1"), (1, 1, (1, 1)), "abc", None, 10**400])
def test_what_is_no_vector_is_refused_and_named_among_others(half):
    wrong = dataclasses.replace(toy.SCENE.bodies[1], half=half)
    scene = dataclasses.replace(toy.SCENE, bodies=(toy.SCENE.bodies[0], wrong))
    with pytest.raises(TraceError, match=f"bodies of '{wrong.entity}': half must be 3 finite num"):
        scene.checked()


@pytest.mark.parametrize(("length", "fits"), [(1.0009, True), (0.9991, True), (1.0011, False)])
@pytest.mark.parametrize("kind", ["joints", "surfaces"])
def test_one_tolerance_says_what_is_of_unit_length(kind, length, fits):
    items = Surfaces.of(toy.SCENE.surfaces) if kind == "surfaces" else toy.SCENE.joints
    pose = (*items[0].pose[:3], length, 0.0, 0.0, 0.0)
    changed = (dataclasses.replace(items[0], pose=pose), *items[1:])
    for form in (changed, Surfaces.of(changed)) if kind == "surfaces" else (changed,):
        scene = dataclasses.replace(toy.SCENE, **{kind: form})
        if fits:
            assert scene.checked() is scene
        else:
            with pytest.raises(TraceError, match="pose is not of unit length"):
                scene.checked()


@pytest.mark.parametrize("travel", [0.0, -1.0, float("inf")])
def test_an_impossible_range_of_a_joint_is_refused(travel):
    scene = dataclasses.replace(toy.SCENE, joints=(dataclasses.replace(HINGE, travel=travel),))
    with pytest.raises(TraceError, match="joints of 'cabinet': travel"):
        scene.checked()


def test_a_derived_binding_is_text_of_a_bounded_length():
    assert Episode.from_json({**JSON, "binding": "task: x"}).binding == "task: x"
    for wrong in ({"task": "x"}, "x" * 50_001):
        with pytest.raises(TraceError, match="episode: binding must be text, at most 50000 long"):
            Episode.from_json({**JSON, "binding": wrong})
