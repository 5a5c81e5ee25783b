"""A policy that replays the actions of recordings."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, RolloutError, TraceError
from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.trace import files


class Replay:
    """The recorded actions of a folder's rollouts, by task and seed.

    After the last recorded action it holds still.

    Args:
        folder: has recordings of one policy.

    Raises:
        ConfigError: if it has none, or two of the same task and seed.
    """

    def __init__(self, folder: str | Path) -> None:
        found = sorted(Path(folder).expanduser().rglob(f"*{files.SUFFIX}"))
        if not found:
            raise ConfigError(f"policy recording:{folder}: no *{files.SUFFIX} file is in there")
        states = [(path, path.stat()) for path in found]
        index = _index(tuple((path, s.st_mtime_ns, s.st_size, s.st_ino) for path, s in states))
        self._paths, self._steppings = index

    @property
    def tasks(self) -> tuple[str, ...]:
        """The tasks that there are recordings of."""
        return tuple(dict.fromkeys(task for task, _ in self._paths))

    @property
    def stepping(self) -> Literal["exact", "fast"]:
        """The stepping with which they were simulated."""
        return "fast" if self._steppings == {"fast"} else "exact"

    def reset(self, episode: EpisodeInfo) -> None:
        """Read the recording of this task and seed.

        Raises:
            RolloutError: if there is none, or it is another robot's.
            TraceError: if it is broken.
        """
        path = self._paths.get((episode.task, episode.seed))
        if path is None:
            raise RolloutError(f"there is no recording of {episode.task}, seed {episode.seed}")
        recording, robot = files.load(path), episode.robot
        if recording.scene.actions != robot.actions.entries:
            raise RolloutError(f"{path}: its actions are not those of the robot {robot.name}")
        steps = recording.steps
        self._actions: NDArray[np.float32] = steps.action[1:][~steps.tail[1:]]
        self._still = robot.actions.hold([*self._actions.astype(np.float64)])

    def act(self, observation: Observation) -> NDArray[Any]:
        """The recorded action of this step."""
        if observation.index < len(self._actions):
            recorded: NDArray[Any] = self._actions[observation.index]
            return recorded
        return self._still


@lru_cache(maxsize=8)
def _index(
    found: tuple[tuple[Path, int, int, int], ...],
) -> tuple[dict[tuple[str, int], Path], frozenset[str]]:
    """Recordings by task and seed, and how they were stepped; read again when a file changes.

    A fresh policy is made for every rollout, and a folder can have thousands of recordings.
    """
    paths: dict[tuple[str, int], Path] = {}
    steppings = set()
    for path, *_ in found:
        try:
            episode = files.load_episode(path)
        except TraceError as error:
            raise ConfigError(str(error)) from error
        key = (episode.task, episode.seed)
        if key in paths:
            raise ConfigError(f"{path} and {paths[key]} have the same task and seed")
        paths[key] = path
        steppings.add(episode.stepping)
    return paths, frozenset(steppings)
