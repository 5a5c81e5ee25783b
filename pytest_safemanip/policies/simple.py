"""Two trivial policies: one holds still, one acts at random."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.provenance import source_digest

FINGERPRINT = source_digest("policies/simple.py")


class Hold:
    """Keeps the robot where it is, its grippers open."""

    fingerprint = FINGERPRINT

    def reset(self, episode: EpisodeInfo) -> None:
        """Learn what the robot takes."""
        actions = episode.robot.actions
        self._action = actions.hold(())
        for gripper in episode.robot.grippers:
            if gripper.entry:
                self._action[actions.index(gripper.entry)] = gripper.opens

    def act(self, observation: Observation) -> NDArray[Any]:
        """The action that holds still, at every step."""
        return self._action.copy()


class Random:
    """Random actions as the robot has them; seeded by the episode."""

    fingerprint = FINGERPRINT

    def reset(self, episode: EpisodeInfo) -> None:
        """Start the episode's own random sequence."""
        self._random = np.random.default_rng(episode.seed)
        self._actions = episode.robot.actions

    def act(self, observation: Observation) -> NDArray[Any]:
        """A random action."""
        return self._actions.sample(self._random, observation.index)
