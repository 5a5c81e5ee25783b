"""A clone of the expert, from a checkpoint that ``train.py`` has written."""

from __future__ import annotations

import hashlib
import itertools
import zipfile
from pathlib import Path

import numpy as np
from features import GRIPPER, MODE, Features, Floats, scaled

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.expert.robot.base import (
    BASE_DEAD_BAND,
    TURN_DEAD_BAND,
    TURN_RISE,
    TURN_SPEED,
)
from pytest_safemanip.policies.base import EpisodeInfo, Observation

FOLDER = Path(__file__).parent / "checkpoints"
NETWORKS = ("arm", "base", "switch")
SAVED = ("middle", "spread", "longest")
"""Beside its networks, of each task."""
SHORTEST = 6
"""Control steps between two switches of fingers or mode: the expert hardly makes one sooner."""

NEAR, TURNED = 0.02, 1.5
"""The base has arrived when it is so near, m and degrees."""
FAST = 0.7
"""The largest command of the base."""
HALF = 0.7
"""Odds of a switch that add up to this mean that half of the demonstrations would have switched."""
DOUBT = 0.02
"""A switch that is less likely than this at a step is none that begins to be due."""


class Cloned:
    """Acts as networks say: one how the arm moves, one where the base will stand, one which of them
    moves and what fingers do.

    Args:
        checkpoint: name of a file in ``checkpoints/``, without its ending.

    Attributes:
        done: whether it has acted for longer than any demonstration by a third.

    Raises:
        ConfigError: if there is no such checkpoint, or the file is none.
    """

    def __init__(self, checkpoint: str) -> None:
        path = FOLDER / f"{checkpoint}.npz"
        if not path.is_file():
            there = ", ".join(sorted(other.stem for other in FOLDER.glob("*.npz")))
            raise ConfigError(f"{path} is not there; checkpoints: {there or 'none, see train.py'}")
        self.fingerprint = hashlib.sha256(path.read_bytes()).hexdigest()
        try:
            with zipfile.ZipFile(path), np.load(path, allow_pickle=False) as arrays:
                self._arrays = dict(arrays)
        except (OSError, ValueError, zipfile.BadZipFile) as error:
            raise ConfigError(f"{path} is no checkpoint: {error}; train again") from error
        self.tasks = tuple(sorted({key.partition("/")[0] for key in self._arrays}))
        for task, name in itertools.product(self.tasks, SAVED):
            if f"{task}/{name}" not in self._arrays:
                raise ConfigError(f"{path} has no {task}/{name}; train again")
        self.done = False

    def reset(self, episode: EpisodeInfo) -> None:
        """Take the networks of the episode's task."""
        self._own = {
            key.partition("/")[2]: array
            for key, array in self._arrays.items()
            if key.startswith(f"{episode.task}/")
        }
        self._scene, self._features, self.done = episode.scene, None, False
        self._due = 0.0

    def act(self, observation: Observation) -> Floats:
        """The networks' action."""
        if self._features is None:
            self._features = Features(self._scene, observation.step)
        memory = self._features.memory
        seen = scaled(self._features(observation.step), self._own["middle"], self._own["spread"])
        switched = self._switched(seen)
        action = np.zeros(12)
        action[GRIPPER], action[MODE] = switched % 3 - 1, 1.0 if switched >= 3 else -1.0
        if action[MODE] > 0.0:
            action[7:10] = self._driven(self._output("base", seen))
        else:
            action[:6] = self._output("arm", seen)
        memory.told(action)
        self.done = observation.index > 4 / 3 * self._own["longest"]
        return np.clip(action, -1.0, 1.0)

    def _driven(self, goal: Floats) -> Floats:
        """The base's command (3,) on its way to a goal: forward and left, m, and degrees to the
        left; where it has arrived, a switch is due.
        """
        action, longer = np.zeros(3), float(np.abs(goal[:2]).max())
        if longer > NEAR:
            above = min(1.5 * longer, FAST - BASE_DEAD_BAND) * goal[:2] / longer
            moves = np.abs(goal[:2]) > NEAR
            action[:2] = moves * (np.copysign(BASE_DEAD_BAND, goal[:2]) + above)
        elif abs(goal[2]) > TURNED:
            action[2] = np.copysign(
                min(TURN_DEAD_BAND + TURN_RISE * abs(goal[2]), TURN_SPEED), goal[2]
            )
        else:
            self._due = 1.0
        return action

    def _switched(self, seen: Floats) -> int:
        """What fingers and mode are now: others than before as soon as demonstrations would have
        switched them by now, however unsure it is at which step.
        """
        scores = self._output("switch", seen)
        odds = np.exp(scores - scores.max())
        odds /= odds.sum()
        memory = self._features.memory
        begins = memory.switches == memory.since == 0
        self._due = (memory.since > 0) * self._due + max(1.0 - odds[memory.last] - DOUBT, 0.0)
        if not begins and (memory.since < SHORTEST or self._due < 1.0):
            return memory.last
        odds[memory.last] *= begins
        return int(np.argmax(odds))

    def _output(self, network: str, value: Floats) -> Floats:
        last = sum(key.startswith(f"{network}/w") for key in self._own) - 1
        for layer in range(last):
            weights, biases = self._own[f"{network}/w{layer}"], self._own[f"{network}/b{layer}"]
            value = np.maximum(value @ weights + biases, 0.0)
        return value @ self._own[f"{network}/w{last}"] + self._own[f"{network}/b{last}"]
