"""A policy that does again what was recorded: the same actions, whatever they lead to."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, RolloutError, TraceError
from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.policies.simple import Hold
from pytest_safemanip.trace import files


class Replay:
    """The recorded actions of a folder's rollouts, by task and seed.

    After the last recorded action it holds still.

    Args:
        folder: has recordings of one policy.

    Raises:
        ConfigError: if it has none, or two of the same task and seed.
    """

    def __init__(self, folder: Path) -> None:
        self._paths: dict[tuple[str, int], Path] = {}
        self._steppings: set[str] = set()
        for path in sorted(folder.rglob(f"*{files.SUFFIX}")):
            try:
                episode = files.load_episode(path)
            except TraceError as error:
                raise ConfigError(str(error)) from error
            key = (episode.task, episode.seed)
            if key in self._paths:
                raise ConfigError(f"{path} and {self._paths[key]} have the same task and seed")
            self._paths[key] = path
            self._steppings.add(episode.stepping)
        if not self._paths:
            raise ConfigError(f"policy recording:{folder}: no *{files.SUFFIX} file is in there")
        self._actions: NDArray[np.float32] = np.zeros((0, 12), np.float32)

    @property
    def tasks(self) -> tuple[str, ...]:
        """The tasks that there are recordings of."""
        return tuple(dict.fromkeys(task for task, _ in self._paths))

    @property
    def stepping(self) -> Literal["exact", "fast"]:
        """How they were simulated: the same actions lead elsewhere in the other way."""
        return "fast" if self._steppings == {"fast"} else "exact"

    def reset(self, episode: EpisodeInfo) -> None:
        """Read the recording of this task and seed.

        Raises:
            RolloutError: if there is none.
            TraceError: if it is broken.
        """
        path = self._paths.get((episode.task, episode.seed))
        if path is None:
            raise RolloutError(f"there is no recording of {episode.task}, seed {episode.seed}")
        steps = files.load(path).steps
        self._actions = steps.action[1:][~steps.tail[1:]]

    def act(self, observation: Observation) -> NDArray[Any]:
        """The recorded action of this step."""
        if observation.index < len(self._actions):
            recorded: NDArray[Any] = self._actions[observation.index]
            return recorded
        action = Hold().act(observation)
        if len(self._actions):
            action[6] = self._actions[-1][6]
        return action
