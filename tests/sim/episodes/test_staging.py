"""Episodes that begin otherwise than their task and seed say."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pytest_safemanip.errors import CannotStage, TaskError
from pytest_safemanip.sim.backend import Backend, Request, Start
from pytest_safemanip.sim.codec import decode_request, encode_request
from pytest_safemanip.sim.robocasa import environment, task_source
from pytest_safemanip.sim.robocasa.staged import turned_across
from pytest_safemanip.sim.staging import (
    Add,
    Cameras,
    Change,
    Light,
    Move,
    Posture,
    Push,
    Put,
    SetOpen,
    Store,
)
from pytest_safemanip.trace.geometry import about, corners, matrix, multiply, tilt

TASK = "PickPlaceCounterToCabinet"
GROUPS = {"obj": ["can"]}


def begun(backend: Backend, *changes: Change) -> Start:
    return backend.reset(Request(TASK, 0, "compact", GROUPS, "small", changes))


def box(start: Start, role: str) -> Any:
    """Corners of an object's box (8, 3)."""
    index = start.scene.object_index[start.scene.roles[role]]
    body = start.scene.bodies[index]
    return corners(np.asarray(start.step.object_pose[index], np.float64), body.half, body.centre)


def test_a_request_with_changes_survives_a_message() -> None:
    put = Put("obj", "in", "cab", (0.1, 0.0, 0.0), (90.0, 0.0), across=True)
    changes = (put, SetOpen("cab", 0.5))
    request = Request(TASK, 3, "compact", GROUPS, "small", changes)
    assert decode_request(json.loads(json.dumps(encode_request(request)))) == request


def test_an_object_stands_on_another_or_beside_it(backend: Backend) -> None:
    plain = begun(backend)
    beside = begun(backend, Put("obj", "beside", "distr_counter", (0.0, 0.15, 0.0)))
    other = box(beside, "distr_counter").mean(axis=0)
    step = plain.step.base_pose
    assert np.allclose(step[:2], beside.step.base_pose[:2], atol=0.01)
    assert np.linalg.norm(box(beside, "obj").mean(axis=0)[:2] - other[:2]) == pytest.approx(
        0.15, abs=0.01
    )
    assert box(beside, "obj")[:, 2].min() == pytest.approx(box(plain, "obj")[:, 2].min(), abs=0.003)
    assert beside.fingerprint != plain.fingerprint


@pytest.fixture(scope="module")
def plain(backend: Backend) -> Start:
    """The episode as it is."""
    return begun(backend)


def test_an_object_is_moved_on_its_level_and_nothing_else(backend: Backend, plain: Start) -> None:
    moved = begun(backend, Move("obj", (-0.04, 0.03), 90.0))
    way = box(moved, "obj").mean(axis=0) - box(plain, "obj").mean(axis=0)
    forward = matrix(np.asarray(plain.step.base_pose[3:], np.float64))[:, 0]
    left = np.array((-forward[1], forward[0], 0.0))
    assert way == pytest.approx(-0.04 * forward + 0.03 * left, abs=0.003)
    assert box(moved, "distr_counter") == pytest.approx(box(plain, "distr_counter"), abs=0.003)
    heading = [
        np.asarray(s.step.object_pose[s.scene.object_index["obj"]][3:]) for s in (plain, moved)
    ]
    assert abs(heading[0] @ heading[1]) == pytest.approx(np.cos(np.pi / 4), abs=0.02)


@pytest.mark.parametrize(
    "change",
    [Move("obj", (-0.4, 0.0)), Move("obj", (0.221, -0.351)), Add("cup", "obj", (0.0, 0.04))],
)
def test_what_cannot_stand_there_is_no_episode(backend: Backend, change: Change) -> None:
    with pytest.raises(CannotStage, match="does not stay where it should stand"):
        begun(backend, change)


def test_something_more_stands_beside_an_object_and_all_else_where_it_stood(
    backend: Backend, plain: Start
) -> None:
    more = begun(backend, Add("cup", "obj", (0.0, 0.15)))
    assert [e.category for e in more.scene.entities if e.name == "added_1"] == ["cup"]
    apart = box(more, "added_1").mean(axis=0) - box(more, "obj").mean(axis=0)
    assert np.linalg.norm(apart[:2]) == pytest.approx(0.15, abs=0.01)
    for role in ("obj", "distr_counter"):
        assert box(more, role) == pytest.approx(box(plain, role), abs=0.003)


def test_something_more_stands_out_of_a_fixture(backend: Backend) -> None:
    more = begun(backend, Store("can", "cab", out=0.02, left=-0.1))
    scene = more.scene
    [inside] = scene.boxes_of(scene.roles["cab"], "interior")[:1]
    pose = np.asarray(more.step.box_pose[inside], np.float64)
    space, can = corners(pose, scene.boxes[inside].half), box(more, "added_1")
    ahead, left = matrix(np.asarray(more.step.base_pose[3:], np.float64))[:, :2].T
    assert (space @ ahead).min() - (can @ ahead).min() == pytest.approx(0.02, abs=0.005)
    assert (can - pose[:3]).mean(axis=0) @ left == pytest.approx(-0.1, abs=0.005)
    with pytest.raises(CannotStage, match="does not stay where it should stand"):
        begun(backend, Store("can", "cab", out=0.06))


def test_the_arm_begins_a_little_elsewhere_as_the_seed_says(backend: Backend, plain: Start) -> None:
    turned = begun(backend, Posture(0.05))
    way = float(np.linalg.norm(turned.step.eef_pose[:3] - plain.step.eef_pose[:3]))
    assert 0.005 < way < 0.1
    assert begun(backend, Posture(0.05)).fingerprint == turned.fingerprint


def test_what_cameras_see_changes_no_bit_of_the_physics(backend: Backend, plain: Start) -> None:
    for change in (Cameras((0.02, 0.0, 0.0), 3.0), Light(0.4)):
        assert begun(backend, change).fingerprint == plain.fingerprint


def test_a_ball_that_is_pushed_rolls_while_all_else_is_at_rest(backend: Backend) -> None:
    groups = {"obj": ["can"], "distr_counter": ["orange"]}
    put = Put("distr_counter", "in", "cab", (-0.1, 0.4, -0.56))
    changes = (put, Push("distr_counter", (0.0, -1.5)))
    start = backend.reset(Request(TASK, 0, "compact", groups, "small", changes))
    ball = start.scene.object_index[start.scene.roles["distr_counter"]]
    moving = np.linalg.norm(start.step.object_twist[:, :3], axis=1)
    assert moving[ball] == pytest.approx(1.5, abs=0.05)
    assert np.delete(moving, ball).max() < 0.05
    for _ in range(10):
        step = backend.step(np.zeros(12))
    way = step.object_pose[ball, :3] - start.step.object_pose[ball, :3]
    assert way[0] > 0.2  # to the right of a robot that faces along y
    assert abs(way[1]) < 0.02
    assert abs(way[2]) < 0.01


def test_a_door_stands_half_open_and_what_was_put_in_lies_on_its_side(backend: Backend) -> None:
    start = begun(backend, SetOpen("cab", 0.5), Put("obj", "in", "cab", turn=(90.0, 0.0)))
    cabinet = start.scene.roles["cab"]
    doors = [k for k in start.scene.joints_of(cabinet) if start.scene.joints[k].gives_access]
    assert start.step.joint[doors, 0] == pytest.approx(0.5, abs=0.02)
    inside = min(start.scene.boxes_of(cabinet, "interior"), key=lambda k: start.step.box_pose[k][2])
    region = corners(np.asarray(start.step.box_pose[inside]), start.scene.boxes[inside].half)
    middle = box(start, "obj").mean(axis=0)
    assert (region.min(axis=0) < middle).all()
    assert (middle < region.max(axis=0)).all()
    index = start.scene.object_index["obj"]
    assert tilt(np.asarray(start.step.object_pose[index][3:])) == pytest.approx(np.pi / 2, abs=0.1)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 100.0, -170.0])
def test_the_longer_side_is_turned_across_however_it_lay(degrees: float) -> None:
    axes = np.array(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))  # faces along y
    lying = multiply(about((0.0, 0.0, 1.0), np.radians(degrees)), about((1.0, 0.0, 0.0), np.pi / 2))
    half = np.array((0.05, 0.3, 0.1))  # its longest side stands upright
    turned = turned_across(lying, half, axes)
    extents = np.ptp(corners(np.append(np.zeros(3), turned), half), axis=0)
    assert extents == pytest.approx((0.2, 0.1, 0.6))


def test_it_stands_on_the_shelf_that_was_named(backend: Backend) -> None:
    plain = begun(backend)
    scene = plain.scene
    levels = [scene.boxes[k].name for k in scene.boxes_of(scene.roles["cab"], "interior")]
    floors = {}
    for level in levels:
        start = begun(backend, SetOpen("cab", 1.0), Put("obj", "in", "cab", interior=level))
        floors[level] = float(box(start, "obj")[:, 2].min())
    assert len(levels) > 1
    assert sorted(floors, key=lambda level: floors[level]) == sorted(levels)
    assert len({round(floor, 2) for floor in floors.values()}) == len(levels)
    start = begun(backend, SetOpen("cab", 1.0), Put("obj", "in", "cab", interior="level*"))
    reachable = min(floors.values(), key=lambda floor: abs(floor - 1.25))
    assert float(box(start, "obj")[:, 2].min()) == pytest.approx(reachable, abs=0.005)


def test_it_stands_so_far_behind_the_edge_of_the_floor(backend: Backend) -> None:
    put = Put("obj", "in", "cab", (0.12, 0.0, 0.0), from_edge=True)
    start = begun(backend, SetOpen("cab", 1.0), put)
    number = start.scene.boxes_of(start.scene.roles["cab"], "interior")[0]
    forward = matrix(np.asarray(start.step.base_pose[3:], np.float64))[:, 0]
    shelf = np.asarray(start.step.box_pose[number], np.float64)
    floor = corners(shelf, start.scene.boxes[number].half) @ forward
    ahead = box(start, "obj") @ forward
    assert ahead.min() + np.ptp(ahead) / 2.0 - floor.min() == pytest.approx(0.12, abs=0.01)


def test_the_same_changes_give_the_same_episode(backend: Backend) -> None:
    changes = (SetOpen("cab", 0.5), Put("obj", "in", "cab"))
    first, second = begun(backend, *changes), begun(backend, *changes)
    assert first.fingerprint == second.fingerprint
    assert np.array_equal(first.step.qpos, second.step.qpos)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (Put("objj", "in", "cab"), "no role 'objj'; did you mean 'obj'"),
        (Put("cab", "in", "cab"), "'cab' is a fixture; only objects can be put elsewhere"),
        (Put("obj", "on", "cab"), "is no object that something is put on"),
        (SetOpen("cab", 1.0, "lid"), "cab has no joint 'lid'"),
        (Put("obj", "in", "distr_counter"), "distr_counter has no interior"),
        (Put("obj", "in", "cab", interior="level"), "has no interior 'level'; did you mean 'level"),
        (
            Put("obj", "beside", "distr_counter", (0.0, 5.0, 0.0)),
            "'obj' has no room beside 'distr_counter': it fell ",
        ),
    ],
)
def test_what_the_scene_lacks_is_said(backend: Backend, change: Change, message: str) -> None:
    with pytest.raises(TaskError) as caught:
        begun(backend, change)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("task", "drawn", "wanted"),
    [
        (TASK, "pizza", "graspable"),
        ("PickPlaceToasterToCounter", "baguette", "rotate_upright"),
    ],
)
def test_what_a_task_cannot_use_is_not_drawn(
    backend: Backend, task: str, drawn: str, wanted: str
) -> None:
    with pytest.raises(TaskError) as caught:
        backend.reset(Request(task, 0, "compact", {"obj": [drawn]}, "full"))
    assert str(caught.value) == (
        f"obj: nothing in {drawn} is as the task asks ({wanted}); draw it from others"
    )


@pytest.mark.parametrize(
    ("task", "role"), [("OpenDishwasher", "fxtr"), ("OpenToasterOvenDoor", "toaster_oven")]
)
def test_a_kitchen_without_the_fixture_of_a_task_is_an_error_of_its_task(
    backend: Backend, task: str, role: str
) -> None:
    with pytest.raises(TaskError) as caught:
        backend.reset(Request(task, 0, "compact", {}, "small"))
    assert str(caught.value) == (
        f"the compact kitchen 'small' has no fixture for {role!r}; 'compact: {{kitchen: full}}' in "
        "the task's file asks for more, --safemanip-scenes=target has RoboCasa's own kitchens"
    )


def test_what_finds_no_place_is_an_error_of_its_task(monkeypatch: pytest.MonkeyPatch) -> None:
    says = "Ran _load_model() 50 times but could not initialize task!"
    source = task_source.environments()
    assert source is not None
    assert says in (source / "kitchen" / "kitchen.py").read_text(encoding="utf-8")

    def reset() -> None:
        raise RuntimeError(says)

    full = SimpleNamespace(reset=reset, _pre_action=None, _get_obj_cfgs=None, sample_object=None)
    monkeypatch.setattr(environment, "unset", lambda *_, **__: full)
    monkeypatch.setattr(environment.scenes, "arguments", lambda *_: {})
    with pytest.raises(TaskError) as caught:
        environment.make(Request(TASK, 0, "compact", GROUPS, "small"), Path("assets"))
    assert str(caught.value) == (
        "seed 0: RoboCasa finds no place for the task's objects; draw smaller ones than obj (can)"
    )
