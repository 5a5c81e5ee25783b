"""The scripted expert with a disturbance that nobody planned: it fails as policies do, by itself.

- ``jitter@0.3``: noise on the motions of hand and base, correlated over 0.2 s, of this standard
  deviation in full-scale actions.
- ``opens@0.02``: at each step at which the fingers are told to close, with this probability they
  are told to open for the next half second.
- ``stalls@0.02``: with this probability per step the last action is repeated for half a second, as
  by a policy that waits for its server.
- ``mixed@0.02``: all of them, with ten times as much jitter.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.faults.policy import Scripted
from pytest_safemanip.policies.base import EpisodeInfo, Observation

KINDS = ("jitter", "opens", "stalls", "mixed")
MEMORY = 0.75
"""Share of the noise that is left in the next control step."""
SPELL = 10
"""Control steps for which fingers stay open, or the last action is repeated."""
GRIPPER, MODE = 6, 11


class Disturbed:
    """See above; what is random is drawn from the episode's seed.

    Args:
        text: ``KIND@STRENGTH``.

    Raises:
        ConfigError: if it is none.
    """

    def __init__(self, text: str) -> None:
        self._kind, _, strength = text.partition("@")
        if self._kind not in KINDS or not strength.replace(".", "", 1).isdigit():
            kinds = ", ".join(KINDS)
            raise ConfigError(
                f"disturbed:{text}: expected KIND@STRENGTH: one of {kinds}, and a number from 0 on"
            )
        self._strength = float(strength)
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
        self._random = np.random.default_rng((episode.seed, KINDS.index(self._kind)))
        self._noise, self._opens, self._stalls = np.zeros(12), 0, 0
        self._last = np.zeros(12)

    def act(self, observation: Observation) -> NDArray[Any]:
        """The expert's action, disturbed."""
        action = self._expert.act(observation).copy()
        if self._kind in ("jitter", "mixed"):
            self._jitter(action, 1.0 if self._kind == "jitter" else 10.0)
        if self._kind in ("opens", "mixed"):
            self._open(action)
        if self._kind in ("stalls", "mixed"):
            action = self._stall(action)
        self._last = action
        return action

    def _jitter(self, action: NDArray[Any], scale: float) -> None:
        fresh = self._random.normal(0.0, self._strength * scale, 12) * np.sqrt(1.0 - MEMORY**2)
        self._noise = MEMORY * self._noise + fresh
        moved = slice(0, 6) if action[MODE] <= 0.0 else slice(7, 10)
        action[moved] += self._noise[moved]

    def _open(self, action: NDArray[Any]) -> None:
        if action[GRIPPER] > 0.0 and self._random.random() < self._strength:
            self._opens = SPELL
        if self._opens:
            self._opens -= 1
            action[GRIPPER] = -1.0

    def _stall(self, action: NDArray[Any]) -> NDArray[Any]:
        if not self._stalls and self._random.random() < self._strength:
            self._stalls = SPELL
        if self._stalls:
            self._stalls -= 1
            return self._last.copy()
        return action
