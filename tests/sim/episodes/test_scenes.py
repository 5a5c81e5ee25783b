"""The families of scenes, and what says which simulator a recording came from."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.backend import Backend, Options, Request, Start
from pytest_safemanip.sim.robocasa.factory import create

TASK = "OpenDrawer"


@pytest.fixture(scope="module")
def starts(backend: Backend) -> dict[str, Start]:
    return {
        scenes: backend.reset(Request(TASK, 0, scenes))
        for scenes in ("compact", "target", "pretrain")
    }


@pytest.mark.parametrize("scenes", ["compact", "target", "pretrain"])
def test_each_family_has_the_task(starts: dict[str, Start], scenes: str) -> None:
    start = starts[scenes]
    assert "drawer" in start.instruction
    assert start.scene.entity[start.scene.roles["drawer"]].category == "Drawer"
    assert start.scene.control_period == 0.05
    assert np.isfinite(start.step.qpos).all()
    assert not start.step.success


def test_the_families_are_different_kitchens(starts: dict[str, Start]) -> None:
    sizes = {scenes: len(start.scene.entities) for scenes, start in starts.items()}
    assert sizes["compact"] < min(sizes["target"], sizes["pretrain"])
    assert len({start.fingerprint for start in starts.values()}) == 3


def test_the_horizon_is_the_tasks_own_in_every_family(starts: dict[str, Start]) -> None:
    assert {start.horizon for start in starts.values()} == {750}


def test_a_compact_kitchen_is_decided_by_its_seed(
    backend: Backend, starts: dict[str, Start]
) -> None:
    again, other = (backend.reset(Request(TASK, seed, "compact")) for seed in (0, 1))
    assert again.fingerprint == starts["compact"].fingerprint
    assert again.scene == starts["compact"].scene
    assert np.array_equal(again.step.qpos, starts["compact"].step.qpos)
    assert other.fingerprint != again.fingerprint
    assert not np.array_equal(other.step.qpos, again.step.qpos)


def test_objects_are_drawn_from_the_groups_asked_for(backend: Backend) -> None:
    groups = {"obj": ["apple"]}
    start = backend.reset(Request("PickPlaceCounterToCabinet", 0, "compact", groups))
    assert start.scene.entity["obj"].category == "apple"


def test_a_scene_that_is_built_again_has_the_same_names(make_kitchen: Callable[..., Any]) -> None:
    env = make_kitchen("OpenDrawer")
    names = list(env.fixtures)
    env.reset()
    assert list(env.fixtures) == names


@pytest.mark.parametrize(
    ("task", "scenes", "message"),
    [
        ("OpenDrawers", "compact", "did you mean 'OpenDrawer'"),
        (TASK, "compakt", "did you mean 'compact'"),
    ],
)
def test_what_does_not_exist_is_refused_by_name(
    backend: Backend, task: str, scenes: str, message: str
) -> None:
    with pytest.raises(ConfigError, match=message):
        backend.reset(Request(task, 0, scenes))


def test_the_provenance_names_all_that_decides_a_recording(tmp_path: Any) -> None:
    one, two = (create(Options("primitive", tmp_path)).provenance for _ in range(2))
    assert one == two
    assert one.backend == "robocasa"
    assert one.assets == "primitive"
    assert {"mujoco", "numpy", "robosuite"} <= set(one.versions)
    assert set(one.hashes) == {"backend", "simulator", "assets"}
    assert all(len(digest) >= 16 for digest in one.hashes.values())
    assert "primitive" in one.description
