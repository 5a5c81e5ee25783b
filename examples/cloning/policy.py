"""A clone of the expert, from a checkpoint that ``train.py`` has written."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from features import Features, Floats

from pytest_safemanip.policies.base import EpisodeInfo, Observation

FOLDER = Path(__file__).parent / "checkpoints"


class Cloned:
    """Acts as a network says.

    Args:
        checkpoint: name of a file in ``checkpoints/``, without its ending.
    """

    def __init__(self, checkpoint: str) -> None:
        path = FOLDER / f"{checkpoint}.npz"
        self.fingerprint = hashlib.sha256(path.read_bytes()).hexdigest()
        with np.load(path, allow_pickle=False) as arrays:
            self._arrays = dict(arrays)
        self.tasks = tuple(sorted({key.partition("/")[0] for key in self._arrays}))

    def reset(self, episode: EpisodeInfo) -> None:
        """Take the network of the episode's task."""
        own = {
            key.partition("/")[2]: array
            for key, array in self._arrays.items()
            if key.startswith(f"{episode.task}/")
        }
        self._middle, self._spread = own["middle"], own["spread"]
        count = sum(key.startswith("w") for key in own)
        self._layers = [(own[f"w{k}"], own[f"b{k}"]) for k in range(count)]
        self._scene, self._features = episode.scene, None

    def act(self, observation: Observation) -> Floats:
        """The network's action."""
        if self._features is None:
            self._features = Features(self._scene, observation.step)
        seen = self._features(observation.step, observation.index)
        value = (seen - self._middle) / self._spread
        for weights, biases in self._layers[:-1]:
            value = np.maximum(value @ weights + biases, 0.0)
        weights, biases = self._layers[-1]
        action = np.clip(value @ weights + biases, -1.0, 1.0)
        # Fingers open, close or stay; base or arm moves: nothing in between.
        action[6], action[11] = np.round(action[6]), 1.0 if action[11] > 0.0 else -1.0
        self._features.told(action)
        return action
