"""Real rollouts, run once and shared by all tests, also between workers."""

from __future__ import annotations

import dataclasses
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings as hypothesis_settings

from pytest_safemanip.metrics.records import RolloutKey
from pytest_safemanip.plugin.read_settings import read_settings
from pytest_safemanip.policies.simple import Hold
from pytest_safemanip.rollouts.store import Store
from pytest_safemanip.run.plan import Extensions, Plan, make_plan
from pytest_safemanip.run.session import EvaluatedRollout, SafetySession
from pytest_safemanip.run.settings import Settings
from pytest_safemanip.sim.backend import Backend, Options
from pytest_safemanip.sim.robocasa.factory import create
from tests.warm import Warm

# How fast a machine is, is no subject of a test.
hypothesis_settings.register_profile("any machine", deadline=None)
hypothesis_settings.load_profile("any machine")


class Rollouts:
    """Rollouts in the compact scene, on demand."""

    def __init__(self, folder: Path, run: str, defaults: Settings, backend: Backend) -> None:
        self._defaults, self.backend, self._run = defaults, backend, run
        self._store = Store(folder, run)
        self._evaluated: dict[RolloutKey, EvaluatedRollout] = {}

    def plan(self, task: str, policy: str = "scripted", seed: int = 0, **changed: Any) -> Plan:
        settings = dataclasses.replace(
            self._defaults, policies=(policy,), tasks=(task,), seeds=(seed,), **changed
        )
        return make_plan(settings, Extensions({}, (), {}))

    def get(
        self, task: str, policy: str = "scripted", seed: int = 0, **changed: Any
    ) -> EvaluatedRollout:
        """A rollout of a task; the settings may be changed that say what the task is."""
        key = RolloutKey(policy, task, seed)
        if key not in self._evaluated:
            plan = self.plan(task, policy, seed, **changed)
            session = SafetySession(plan, self.backend, self._store, self._run)
            self._evaluated[key] = session.evaluate(plan.cases[0])
        return self._evaluated[key]

    def put_into(self, out: Path, *wanted: tuple[str, str]) -> None:
        """Make these recordings, task and policy each, those of an earlier run in ``out``."""
        (out / "recordings").mkdir(parents=True, exist_ok=True)
        for task, policy in wanted:
            path = self.get(task, policy).path
            target = out / "recordings" / path.name
            if not target.exists():
                os.link(path, target)


@pytest.fixture(scope="session")
def rollouts(
    tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config
) -> Iterator[Rollouts]:
    worker = getattr(pytestconfig, "workerinput", None)
    base = tmp_path_factory.getbasetemp()
    # Workers have folders of their own below the one of the run.
    shared = base.parent if worker else base
    backend = create(Options("primitive", shared / "logs"))
    run = worker["testrunuid"] if worker else "alone"
    yield Rollouts(shared / "rollouts", run, read_settings(pytestconfig), backend)
    backend.close()


@pytest.fixture
def make(pytestconfig: pytest.Config, tmp_path: Path) -> Callable[..., Plan]:
    """Plans of a task with policies that come from a hook."""
    defaults = read_settings(pytestconfig)

    def make(policies: tuple[str, ...] = ("hold",), **changed: Any) -> Plan:
        changed = {"tasks": ("PickPlaceCounterToCabinet",), "out": tmp_path / "out", **changed}
        settings = dataclasses.replace(defaults, policies=policies, **changed)
        return make_plan(settings, Extensions({"mine": Hold}, (), {}))

    return make


@pytest.fixture(scope="session")
def warm() -> Iterator[Warm]:
    """What starts Python, runs and simulators."""
    with tempfile.TemporaryDirectory() as folder:
        made = Warm(Path(folder))
        yield made
        made.close()
