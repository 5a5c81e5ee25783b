"""RoboCasa itself in the test process: imported once, each kitchen built once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_safemanip.sim.backend import Backend, Options, Request
from pytest_safemanip.sim.robocasa import loading
from pytest_safemanip.sim.robocasa.assets import prepare_assets
from pytest_safemanip.sim.robocasa.factory import create
from pytest_safemanip.spec.tasks import load_tasks

QUICK = (
    "OpenDrawer",
    "OpenCabinet",
    "PickPlaceCounterToCabinet",
    "PickPlaceDrawerToCounter",
    "TurnOnSinkFaucet",
)


@pytest.fixture(scope="session")
def assets_root() -> Path:
    """The assets that RoboCasa was imported with."""
    root = prepare_assets(loading.package_assets(), "primitive").root
    loading.load(root)
    return root


@pytest.fixture(scope="session")
def backend(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Backend]:
    """RoboCasa in its own process, as rollouts have it."""
    made = create(Options("primitive", tmp_path_factory.mktemp("logs")))
    yield made
    made.close()


@pytest.fixture(scope="session")
def object_groups(pytestconfig: pytest.Config) -> Callable[[str], dict[str, list[str]]]:
    """What a task's objects are drawn from in the compact scene, by role."""
    tasks = load_tasks([pytestconfig.rootpath / "tasks"])

    def groups(task: str) -> dict[str, list[str]]:
        return {role: list(names) for role, names in tasks[task].object_groups.items()}

    return groups


@pytest.fixture(scope="session")
def make_kitchen(
    assets_root: Path, object_groups: Callable[[str], dict[str, list[str]]]
) -> Callable[..., Any]:
    """Makes RoboCasa's own environment of a task, after its reset."""
    from pytest_safemanip.sim.robocasa import environment

    def make(task: str, scenes: str = "compact", seed: int = 0) -> Any:
        groups = object_groups(task) if scenes == "compact" and task in QUICK else {}
        return environment.make(Request(task, seed, scenes, groups), assets_root)

    return make


@dataclass(frozen=True)
class Kitchen:
    """An environment that tests share, and what reads it. Tests put it back as it was."""

    env: Any
    reader: Any

    @property
    def scene(self) -> Any:
        return self.reader.description.scene

    def read(self) -> Any:
        from pytest_safemanip.trace.steps import Contacts

        return self.reader.read(False, Contacts.empty())


@pytest.fixture(scope="session")
def _kitchens(make_kitchen: Callable[..., Any]) -> Callable[..., tuple[Kitchen, Any]]:
    from pytest_safemanip.sim.robocasa.description import open_reader

    made: dict[tuple[str, str], tuple[Kitchen, Any]] = {}

    def kitchen(task: str, scenes: str) -> tuple[Kitchen, Any]:
        if (task, scenes) not in made:
            env = make_kitchen(task, scenes)
            start = np.array(env.sim.get_state().flatten())
            made[task, scenes] = Kitchen(env, open_reader(env)), start
        return made[task, scenes]

    return kitchen


@pytest.fixture
def kitchen(_kitchens: Callable[..., tuple[Kitchen, Any]]) -> Callable[..., Kitchen]:
    """The shared kitchen of a task, in the state that its reset left."""

    def get(task: str, scenes: str = "compact") -> Kitchen:
        shared, start = _kitchens(task, scenes)
        shared.env.sim.set_state_from_flattened(start)
        shared.env.sim.forward()
        return shared

    return get
