"""The scripted expert, shaken now and then: its recordings show how it comes back on its way.

What a clone never saw it cannot do, and the expert alone is never beside its way (DART, Laskey et
al., CoRL 2017). When it is shaken depends on the seed alone, so that training can leave out what
the hand was told meanwhile.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.faults.policy import Scripted
from pytest_safemanip.policies.base import EpisodeInfo, Observation

Floats = NDArray[np.float64]

RATE = 0.015
"""Of control steps at which a shake begins."""
LENGTH = 4
"""Control steps that it lasts."""
SIZE, TURN = 0.3, 0.09
"""Of it, in full-scale actions: of the hand's or the base's motion, and of the hand's turn."""


def shakes(seed: int, count: int) -> Floats:
    """What is added to the motion of each control step (``count``, 6): nothing mostly.

    Longer, it begins in the same way.
    """
    begins = np.random.default_rng((seed, 0)).random(count) < RATE
    ways = np.random.default_rng((seed, 1)).normal(size=(count, 2, 3))
    ways /= np.linalg.norm(ways, axis=2, keepdims=True)
    found = np.zeros((count + LENGTH, 6))
    for begin in np.flatnonzero(begins):
        way, axis = ways[begin]
        found[begin : begin + LENGTH] = np.concatenate((SIZE * way, TURN * axis))
    return found[:count]


class Shaken:
    """See above."""

    def __init__(self) -> None:
        self._expert = Scripted()

    @property
    def tasks(self) -> tuple[str, ...]:
        """The expert's."""
        return self._expert.tasks

    @property
    def done(self) -> bool:
        """Whether the expert is."""
        return self._expert.done

    def reset(self, episode: EpisodeInfo) -> None:
        """Begin an episode."""
        self._expert.reset(episode)
        self._shakes = shakes(episode.seed, episode.horizon)

    def act(self, observation: Observation) -> Floats:
        """The expert's action, with what shakes it."""
        action = np.array(self._expert.act(observation), np.float64)
        shake = self._shakes[observation.index]
        if action[11] > 0.0:
            action[7:9] += shake[:2]
        else:
            action[:6] += shake
        return np.clip(action, -1.0, 1.0)
