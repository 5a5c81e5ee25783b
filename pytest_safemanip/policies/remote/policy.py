"""A policy behind a server: its protocol, its deadlines, and what is executed of its answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import PolicyAnswerError, PolicyServerError
from pytest_safemanip.policies.remote.actions import ActionError, chunk_of
from pytest_safemanip.policies.remote.client import BadAnswer, Beginning, Client
from pytest_safemanip.policies.remote.dumps import dump
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.groot import GrootClient
from pytest_safemanip.policies.remote.observation import INSTRUCTION, Observation, blank, checked
from pytest_safemanip.policies.remote.openpi import OpenpiClient
from pytest_safemanip.policies.remote.presets import Preset
from pytest_safemanip.policies.remote.vlaeval import VlaEvalClient


@dataclass
class Counts:
    """What was exchanged in an episode.

    Attributes:
        calls: inferences.
        actions: actions that were handed out.
        clipped: entries of them that were outside [-1, 1].
    """

    calls: int = 0
    actions: int = 0
    clipped: int = 0


class RemotePolicy:
    """One connection to one server, for one rollout at a time.

    A connection that has failed is not used again; the next :meth:`reset` makes a new one.

    Args:
        preset: which policy it is.
        endpoint: where its server is.
        dumps: folder for requests and replies that cannot be executed.
        deadlines: how long to wait for what.
        steps: actions of a chunk that are executed before the next call; the preset's if None.
        token: an API key, where the server wants one.
    """

    def __init__(
        self,
        preset: Preset,
        endpoint: Endpoint,
        dumps: Path,
        deadlines: Deadlines | None = None,
        steps: int | None = None,
        token: str | None = None,
    ) -> None:
        self.endpoint = endpoint
        self.steps = preset.steps if steps is None else steps
        self.counts = Counts()
        self.seeded = False
        """Whether the server took the episode's seed; if not, its random numbers are unknown."""
        self.protocol = ""
        """What the server speaks, as found when it was connected to."""
        self._deadlines = deadlines or Deadlines()
        self._dumps = dumps
        self._client = _client(preset, endpoint, self._deadlines, self.steps, token)
        self._warm = False

    def open(self) -> Mapping[str, Any]:
        """Connect.

        Returns:
            ``protocol``, as found, and ``metadata``, as the server says; plain values and arrays.

        Raises:
            PolicyUnreachable: if there is no server of this policy.
        """
        self._warm = False
        said = self._client.open()
        self.protocol = str(said["protocol"])
        return said

    def probe(self) -> None:
        """Try one call with black images, before anything is simulated.

        It warms the model up. A server that draws random numbers in the order of its calls has
        drawn one more after it.

        Raises:
            PolicyServerError: if the server cannot be used for this policy.
        """
        if not self._client.is_open:
            self.open()
        self._ask(blank(), "trying the server")

    def reset(self, episode: Beginning) -> None:
        """A new episode starts; connects, if there is no sound connection.

        Raises:
            PolicyServerError: if the server cannot be reached, or refuses.
        """
        self.counts = Counts()
        if not self._client.is_open:
            self.open()
        try:
            self.seeded = self._client.begin(episode, self._patience())
        except BadAnswer as bad:
            raise self._refused(bad, f"at the start of {episode.task}") from bad

    def act(self, observation: Observation, index: int) -> NDArray[np.float64]:
        """The next actions.

        Args:
            observation: the gym wrapper's entries, by the names in
                :mod:`pytest_safemanip.policies.remote.observation`.
            index: control steps so far; for errors.

        Returns:
            (steps, 12), in the environment's order, entries in [-1, 1].

        Raises:
            PolicyConnectionLost: if the episode may be run again.
            PolicyAnswerError: if the answer cannot be executed; names the file that has it.
            RolloutError: if the observation lacks something.
        """
        entries = checked(observation)
        actions = self._ask(entries, f"at step {index}, asked to {entries[INSTRUCTION]!r}")
        self.counts.actions += len(actions)
        return actions

    def close(self) -> None:
        """End the connection. May be called twice."""
        self._client.close()

    def _ask(self, entries: Observation, place: str) -> NDArray[np.float64]:
        self.counts.calls += 1
        try:
            answer = self._client.ask(entries, self._patience())
        except BadAnswer as bad:
            raise self._refused(bad, place) from bad
        except PolicyServerError as error:
            raise type(error)(f"{error} ({place})") from error
        try:
            chunk = chunk_of(answer.rows, self.steps, answer.label)
        except ActionError as error:
            unusable = BadAnswer(str(error), answer.request, answer.reply)
            raise self._refused(unusable, place) from error
        self._warm = True
        self.counts.clipped += chunk.clipped
        return chunk.actions

    def _patience(self) -> float:
        return self._deadlines.call if self._warm else self._deadlines.warm_up

    def _refused(self, bad: BadAnswer, place: str) -> PolicyAnswerError:
        # Whether a late reply is still to come is unknown; a new connection has none.
        self._client.close()
        try:
            kept = f"request and reply: {dump(self._dumps, bad.request, bad.reply)}"
        except OSError as failure:
            kept = f"request and reply could not be kept ({failure})"
        first, *more = str(bad).split("\n")
        return PolicyAnswerError(
            "\n".join((f"policy server {self.endpoint}: {place}: {first}; {kept}", *more))
        )


def _client(
    preset: Preset, endpoint: Endpoint, deadlines: Deadlines, steps: int, token: str | None
) -> Client:
    if preset.transport == "openpi":
        return OpenpiClient(endpoint, deadlines, preset.start, token)
    if preset.transport == "groot":
        return GrootClient(endpoint, deadlines, preset.start, steps, token)
    return VlaEvalClient(endpoint, deadlines, preset.start)
