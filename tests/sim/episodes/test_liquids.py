"""Vessels that are filled with small balls before an episode begins."""

from __future__ import annotations

import json

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, TaskError
from pytest_safemanip.sim.backend import Backend, Request, Start
from pytest_safemanip.sim.codec import decode_request, encode_request
from pytest_safemanip.sim.staging import MOST_PARTICLES, Change, Fill, Put, from_plain, to_plain
from pytest_safemanip.trace.elements import Liquid
from pytest_safemanip.trace.geometry import centred, to_local
from pytest_safemanip.trace.steps import Step

TASK = "PickPlaceCounterToCabinet"
WATER = Fill("water", "obj", 20)


def begun(backend: Backend, *changes: Change) -> Start:
    return backend.reset(Request(TASK, 0, "compact", {"obj": ["cup"]}, "small", changes, "fast"))


def inside(start: Start, step: Step) -> float:
    """Share of the particles in the box of the cup."""
    index = start.scene.object_index["obj"]
    body = start.scene.bodies[index]
    pose = centred(np.asarray(step.object_pose[index], float), body.centre)
    local = to_local(pose, step.particles)
    return float((np.abs(local) <= body.half).all(axis=1).mean())


def test_a_cup_is_filled_and_the_water_stays_in_it(backend: Backend) -> None:
    start = begun(backend, Put("obj", "beside", "distr_counter", (0.0, 0.2, 0.0)), WATER)
    assert start.scene.liquids == (Liquid("water", 20, 0.006),)
    assert start.scene.entity["water"].kind == "liquid"
    assert start.scene.roles["water"] == "water"
    assert not any(part.entity == "water" for part in start.scene.parts)
    assert inside(start, start.step) == 1.0
    for _ in range(10):
        step = backend.step(np.zeros(len(start.scene.actions)))
    assert inside(start, step) == 1.0
    assert np.abs(step.particles - start.step.particles).max() < 1e-3


def test_the_same_filling_gives_the_same_episode(backend: Backend) -> None:
    first, second = begun(backend, WATER), begun(backend, WATER)
    assert first.fingerprint == second.fingerprint != begun(backend).fingerprint
    assert np.array_equal(first.step.particles, second.step.particles)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ((Fill("water", "objj"),), "the scene has no role 'objj'; did you mean 'obj'"),
        ((Fill("water", "cab"),), "'cab' is a fixture"),
        ((WATER, Fill("water", "distr_counter")), "two vessels are filled with the liquid 'water'"),
        ((Fill("water", "obj", 200),), "'obj' holds "),
        ((Fill("water", "distr_counter"),), "'distr_counter' is not hollow"),
    ],
)
def test_what_cannot_be_filled_is_said(
    backend: Backend, changes: tuple[Change, ...], message: str
) -> None:
    with pytest.raises(TaskError) as caught:
        begun(backend, *changes)
    assert message in str(caught.value)


def test_a_filling_survives_a_message() -> None:
    request = Request(TASK, 3, "compact", {}, "small", (WATER, Fill("milk", "other", 3, 0.01)))
    assert decode_request(json.loads(json.dumps(encode_request(request)))) == request


@pytest.mark.parametrize(
    "wrong",
    [
        {"count": 0},
        {"count": MOST_PARTICLES + 1},
        {"count": 2.5},
        {"radius": 0.0},
        {"radius": float("nan")},
        {"liquid": "../water"},
        {"liquid": 3},
        {"role": 1},
    ],
)
def test_what_is_no_filling_is_refused(wrong: dict[str, object]) -> None:
    (plain,) = to_plain([WATER])
    with pytest.raises(ConfigError, match=f"{next(iter(wrong))} of"):
        from_plain([{**plain, **wrong}])
