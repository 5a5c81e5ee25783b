"""The two policies that every benchmark needs: one that does nothing, one that does anything."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.policies.base import EpisodeInfo, Observation


class Hold:
    """Keeps the arm where it is, the gripper open."""

    def reset(self, episode: EpisodeInfo) -> None:
        """Nothing to forget."""

    def act(self, observation: Observation) -> NDArray[Any]:
        """A zero action in arm mode."""
        action = np.zeros(12)
        action[6] = action[11] = -1.0
        return action


class Random:
    """Uniform random actions, in arm mode four times out of five; seeded by the episode."""

    def reset(self, episode: EpisodeInfo) -> None:
        """Start the episode's own random sequence."""
        self._random = np.random.default_rng(episode.seed)

    def act(self, observation: Observation) -> NDArray[Any]:
        """One action; gripper and mode are -1 or 1."""
        action = self._random.uniform(-1.0, 1.0, 12)
        action[6] = 1.0 if action[6] > 0.0 else -1.0
        action[11] = 1.0 if action[11] > 0.6 and observation.index > 0 else -1.0
        return action
