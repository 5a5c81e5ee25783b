"""Rollouts under real physics: each played once, when it is first asked for, for all workers."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import pytest
from filelock import FileLock

from pytest_safemanip.trace.files import load, save
from tests.physics.catalogue import SCENARIOS
from tests.physics.filming import PERIODS
from tests.physics.scenario import Rollout


@pytest.fixture(scope="session")
def play(
    tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config
) -> Callable[[str], Rollout]:
    base = tmp_path_factory.getbasetemp()
    # Workers have folders of their own below the one of the run.
    folder = (base.parent if hasattr(pytestconfig, "workerinput") else base) / "physics"
    folder.mkdir(exist_ok=True)

    @cache
    def played(name: str) -> Rollout:
        paths = {period: folder / f"{name} {period}.rollout" for period in PERIODS}
        with FileLock(folder / f"{name}.lock"):
            if all(path.exists() for path in paths.values()):
                return Rollout(SCENARIOS[name](), {p: load(path) for p, path in paths.items()})
            rollout = Rollout(SCENARIOS[name]())
            for period, path in paths.items():
                save(rollout.recordings[period], path)
        return rollout

    return played
