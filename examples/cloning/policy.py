"""A clone of the expert, from a checkpoint that ``train.py`` has written."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from features import GRIPPER, MODE, Features, Floats

from pytest_safemanip.policies.base import EpisodeInfo, Observation

FOLDER = Path(__file__).parent / "checkpoints"
NETWORKS = ("arm", "base", "switch")
SHORTEST = 6
"""Control steps between two switches of fingers or mode: the expert makes none sooner."""


class Cloned:
    """Acts as networks say: one moves the arm, one the base, one says which and what fingers do.

    Args:
        checkpoint: name of a file in ``checkpoints/``, without its ending.

    Attributes:
        done: whether it has acted for longer than any demonstration by a third.
    """

    def __init__(self, checkpoint: str) -> None:
        path = FOLDER / f"{checkpoint}.npz"
        self.fingerprint = hashlib.sha256(path.read_bytes()).hexdigest()
        with np.load(path, allow_pickle=False) as arrays:
            self._arrays = dict(arrays)
        self.tasks = tuple(sorted({key.partition("/")[0] for key in self._arrays}))
        self.done = False

    def reset(self, episode: EpisodeInfo) -> None:
        """Take the networks of the episode's task."""
        self._own = {
            key.partition("/")[2]: array
            for key, array in self._arrays.items()
            if key.startswith(f"{episode.task}/")
        }
        self._scene, self._features, self.done = episode.scene, None, False

    def act(self, observation: Observation) -> Floats:
        """The networks' action."""
        if self._features is None:
            self._features = Features(self._scene, observation.step)
        memory = self._features.memory
        seen = (self._features(observation.step) - self._own["middle"]) / self._own["spread"]
        switched = memory.last
        if observation.index == 0 or memory.since >= SHORTEST:
            switched = int(np.argmax(self._output("switch", seen)))
        action = np.zeros(12)
        action[GRIPPER], action[MODE] = switched % 3 - 1, 1.0 if switched >= 3 else -1.0
        if action[MODE] > 0.0:
            action[7:10] = self._output("base", seen)
        else:
            action[:6] = self._output("arm", seen)
        memory.told(action)
        self.done = observation.index > 4 / 3 * self._own["longest"]
        return np.clip(action, -1.0, 1.0)

    def _output(self, network: str, value: Floats) -> Floats:
        last = sum(key.startswith(f"{network}/w") for key in self._own) - 1
        for layer in range(last):
            weights, biases = self._own[f"{network}/w{layer}"], self._own[f"{network}/b{layer}"]
            value = np.maximum(value @ weights + biases, 0.0)
        return value @ self._own[f"{network}/w{last}"] + self._own[f"{network}/b{last}"]
