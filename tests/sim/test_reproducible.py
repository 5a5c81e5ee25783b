"""The same request gives the same recording, whatever ran before and in whichever process."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_safemanip import rollout
from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.sim.backend import Backend, Options, Request
from pytest_safemanip.sim.robocasa.factory import create
from pytest_safemanip.trace.recording import Recording

SCALE = 0.04  # of the task's horizon: some 20 steps

Groups = Callable[[str], dict[str, list[str]]]


class Random:
    """Moves the arm and the base at random, the same way in every episode of a seed."""

    def reset(self, info: EpisodeInfo) -> None:
        self._random = np.random.default_rng(info.seed)

    def act(self, _seen: Observation) -> NDArray[Any]:
        return self._random.uniform(-1.0, 1.0, 12)


def record(backend: Backend, task: str, groups: dict[str, list[str]], seed: int = 0) -> Recording:
    request = Request(task, seed, "compact", groups)
    job = rollout.Job(task, "random", request, rollout.Protocol("horizon", SCALE), {})
    return rollout.run(job, backend, Random())


def assert_identical(left: Recording, right: Recording) -> None:
    assert left.episode == right.episode
    assert left.scene == right.scene
    pairs = [(left.steps, right.steps), (left.steps.contacts, right.steps.contacts)]
    for one, two in pairs:
        for field in dataclasses.fields(one):
            a, b = getattr(one, field.name), getattr(two, field.name)
            if isinstance(a, np.ndarray):
                assert a.dtype == b.dtype
                assert np.array_equal(a, b), f"{field.name} differs"


@pytest.fixture(scope="module")
def first(backend: Backend, object_groups: Groups) -> Recording:
    task = "PickPlaceCounterToCabinet"
    return record(backend, task, object_groups(task))


def test_a_rollout_moves_and_touches_something(first: Recording) -> None:
    moved = np.linalg.norm(np.ptp(first.steps.eef_pose[:, :3], axis=0))
    assert len(first.steps) > first.episode.horizon >= 15
    assert moved > 0.02
    assert len(first.steps.contacts)


def test_the_recording_is_bit_identical_after_a_rollout_of_another_task(
    backend: Backend, object_groups: Groups, first: Recording
) -> None:
    other = record(backend, "OpenDrawer", {})
    assert other.scene != first.scene
    task = first.episode.task
    assert_identical(record(backend, task, object_groups(task)), first)


def test_the_recording_is_bit_identical_in_another_process(
    tmp_path: Any, object_groups: Groups, first: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONHASHSEED", "12345")
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "2")
    another = create(Options("primitive", tmp_path))
    task = first.episode.task
    try:
        assert_identical(record(another, task, object_groups(task)), first)
    finally:
        another.close()


def test_another_seed_gives_another_episode(
    backend: Backend, object_groups: Groups, first: Recording
) -> None:
    task = first.episode.task
    start = backend.reset(Request(task, 1, "compact", object_groups(task)))
    assert start.fingerprint != first.episode.hashes["start"]
