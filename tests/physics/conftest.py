"""Rollouts under real physics, each played once in a process, when it is first asked for."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import pytest

from tests.physics.catalogue import SCENARIOS
from tests.physics.scenario import Rollout


@pytest.fixture(scope="session")
def play() -> Callable[[str], Rollout]:
    return cache(lambda name: Rollout(SCENARIOS[name]()))
