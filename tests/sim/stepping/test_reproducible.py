"""The same request gives the same episode, whatever ran before and in whichever process."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from pytest_safemanip.sim.backend import Backend, Options, Request, Start
from pytest_safemanip.sim.robocasa.factory import create
from pytest_safemanip.trace.steps import Steps

TASK, LENGTH = "PickPlaceCounterToCabinet", 20

Groups = Callable[[str], dict[str, list[str]]]
Episode = tuple[Start, Steps]


def run(backend: Backend, task: str, groups: dict[str, list[str]], stepping: str) -> Episode:
    """An episode with random actions, the same ones each time."""
    start = backend.reset(Request(task, 0, "compact", groups, stepping=stepping))
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (LENGTH, 12))
    steps = [start.step, *(backend.step(action) for action in actions)]
    recorded = [np.zeros(12, np.float32), *actions.astype(np.float32)]
    return start, Steps.stack(steps, recorded, len(steps))


def assert_identical(left: Episode, right: Episode) -> None:
    (start, steps), (other_start, other_steps) = left, right
    assert start.scene == other_start.scene
    assert start.instruction == other_start.instruction
    assert start.fingerprint == other_start.fingerprint
    pairs = [(steps, other_steps), (steps.contacts, other_steps.contacts)]
    for one, two in pairs:
        for field in dataclasses.fields(one):
            a, b = getattr(one, field.name), getattr(two, field.name)
            if isinstance(a, np.ndarray):
                assert a.dtype == b.dtype
                assert np.array_equal(a, b), f"{field.name} differs"


@pytest.fixture(scope="module", params=["exact", "fast"])
def stepping(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def first(backend: Backend, object_groups: Groups, stepping: str) -> Episode:
    return run(backend, TASK, object_groups(TASK), stepping)


def test_the_robot_moves_and_something_touches(first: Episode) -> None:
    _, steps = first
    assert np.linalg.norm(np.ptp(steps.eef_pose[:, :3], axis=0)) > 0.02
    assert len(np.unique(steps.contacts.step)) == LENGTH + 1


def test_an_episode_is_bit_identical_after_one_of_another_task(
    backend: Backend, object_groups: Groups, first: Episode, stepping: str
) -> None:
    other, _ = run(backend, "OpenDrawer", {}, stepping)
    assert other.scene != first[0].scene
    assert_identical(run(backend, TASK, object_groups(TASK), stepping), first)


def test_an_episode_is_bit_identical_in_another_process(
    tmp_path: Any,
    object_groups: Groups,
    first: Episode,
    stepping: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("PYTHONHASHSEED", "12345")
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "2")
    another = create(Options("primitive", tmp_path))
    try:
        assert_identical(run(another, TASK, object_groups(TASK), stepping), first)
    finally:
        another.close()


def test_another_seed_gives_another_episode(
    backend: Backend, object_groups: Groups, first: Episode
) -> None:
    start = backend.reset(Request(TASK, 1, "compact", object_groups(TASK)))
    assert start.fingerprint != first[0].fingerprint
