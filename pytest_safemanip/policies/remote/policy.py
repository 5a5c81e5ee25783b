"""A policy behind a server: its protocol, its deadlines, and what is executed of its answers."""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import (
    PolicyAnswerError,
    PolicyMismatch,
    PolicyServerError,
    PolicyUnreachable,
)
from pytest_safemanip.policies.remote.actions import ActionError, chunk_of
from pytest_safemanip.policies.remote.client import BadAnswer, Beginning, Client, Turn
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.groot import GrootClient
from pytest_safemanip.policies.remote.observation import Observation, blank, checked
from pytest_safemanip.policies.remote.openpi import OpenpiClient
from pytest_safemanip.policies.remote.presets import Preset
from pytest_safemanip.policies.remote.probing import RETRY_PERIOD
from pytest_safemanip.policies.remote.tokens import NO_TOKEN, Token
from pytest_safemanip.policies.remote.vlaeval import VlaEvalClient
from pytest_safemanip.policies.remote.wire.dumps import dump


@dataclass
class Counts:
    """Counts of calls and actions in an episode.

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
        token: an API key, where the server wants one.
        turn: held while the server is asked; waiting for it counts against no deadline.
        met: whether another connection has found the server fit: it need not be tried again, and
            is waited for if it is away.
    """

    def __init__(
        self,
        preset: Preset,
        endpoint: Endpoint,
        dumps: Path,
        deadlines: Deadlines | None = None,
        token: Token = NO_TOKEN,
        turn: Turn = nullcontext,
        met: bool = False,
    ) -> None:
        self.endpoint = endpoint
        self.steps = preset.steps
        self.counts = Counts()
        self.seeded = False
        """Whether the server took the episode's seed; if not, its random numbers are unknown."""
        self.protocol = ""
        """Protocol of the server, as found when connecting."""
        self._deadlines = deadlines or Deadlines()
        self._dumps, self._token, self._turn = dumps, token, turn
        self._client = _client(preset, endpoint, self._deadlines, token)
        self._robot = preset.robot
        self._warm, self._known, self._tried = False, met, met
        self.metadata: Mapping[str, Any] = {}
        """What the server says of itself."""

    @property
    def is_open(self) -> bool:
        """Whether there is a connection that was not seen to break."""
        return self._client.is_open

    def open(self) -> Mapping[str, Any]:
        """Connect.

        Returns:
            ``protocol``, as found, and ``metadata``, as the server says; plain values and arrays.

        Raises:
            PolicyUnreachable: if there is no server of this policy.
        """
        self._warm = False
        with self._token.hidden(), self._turn():
            said = self._client.open()
        self._known = True
        self.protocol = self._token.told(str(said["protocol"]))
        self.metadata = self._token.told(said.get("metadata", {}))
        return {**said, "metadata": self.metadata}

    def prepare(self, task: str) -> None:
        """Make the server ready for an episode of a task, before that is set up: connect if there
        is no sound connection, and try the server if it was not yet tried.

        Raises:
            PolicyServerError: if the server cannot be used for this policy.
        """
        self._connect()
        if not self._tried:
            self.probe(task)

    def probe(self, task: str = "") -> None:
        """Try an episode of one call, with images of noise, before anything is simulated.

        It warms the model up. A server that draws random numbers in the order of its calls has
        drawn one more after it.

        Raises:
            PolicyMismatch: if its answer cannot be executed, as no later one could.
            PolicyServerError: if the server cannot be used for this policy.
        """
        self._connect()
        entries = blank(self._robot)
        try:
            self._begin(Beginning(task, 0, entries[self._robot.instruction]))
            self._ask(entries, "trying the server")
        except PolicyAnswerError as error:
            raise PolicyMismatch(str(error)) from error.__cause__
        self._tried = True

    def _connect(self) -> None:
        """Connect if there is no sound connection; a server that was there before is waited for."""
        if self._client.is_open:
            return
        end = time.monotonic() + (self._deadlines.restart if self._known else 0.0)
        while True:
            try:
                self.open()
                return
            except PolicyUnreachable:
                if time.monotonic() >= end:
                    raise
            time.sleep(RETRY_PERIOD)

    def reset(self, episode: Beginning) -> None:
        """A new episode starts; connects, if there is no sound connection.

        Raises:
            PolicyServerError: if the server cannot be reached, or refuses.
        """
        self._connect()
        self.counts = Counts()
        self._begin(episode)

    def _begin(self, episode: Beginning) -> None:
        with self._token.hidden():
            try:
                with self._turn():
                    self.seeded = self._client.begin(episode, self._patience())
            except BadAnswer as bad:
                raise self._refused(bad, f"at the start of {episode.task}") from bad

    def act(self, observation: Observation, index: int) -> NDArray[np.float64]:
        """The next actions.

        Args:
            observation: the backend's entries, by the names of the preset's robot.
            index: control steps so far; for errors.

        Returns:
            (steps, A), in the environment's order, entries in [-1, 1].

        Raises:
            PolicyConnectionLost: if the episode may be run again.
            PolicyAnswerError: if the answer cannot be executed; names the file that has it.
            RolloutError: if the observation lacks something.
        """
        entries = checked(observation, self._robot)
        actions = self._ask(
            entries, f"at step {index}, asked to {entries[self._robot.instruction]!r}"
        )
        self.counts.actions += len(actions)
        return actions

    def close(self) -> None:
        """End the connection. May be called twice."""
        self._client.close()

    def _ask(self, entries: Observation, place: str) -> NDArray[np.float64]:
        with self._token.hidden():
            return self._asked(entries, place)

    def _asked(self, entries: Observation, place: str) -> NDArray[np.float64]:
        self.counts.calls += 1
        try:
            answer = self._client.ask(entries, self._patience(), self._turn)
        except BadAnswer as bad:
            raise self._refused(bad, place) from bad
        except PolicyServerError as error:
            raise type(error)(f"{error} ({place})") from error
        try:
            steps = self.steps or len(answer.rows)
            chunk = chunk_of(answer.rows, steps, answer.label, self._robot)
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
            exchange = (self._token.without(part) for part in (bad.request, bad.reply))
            kept = f"request and reply: {dump(self._dumps, *exchange)}"
        except OSError as failure:
            kept = f"request and reply could not be kept ({failure})"
        first, *more = str(bad).split("\n")
        return PolicyAnswerError(
            "\n".join((f"policy server {self.endpoint}: {place}: {first}; {kept}", *more))
        )


def _client(preset: Preset, endpoint: Endpoint, deadlines: Deadlines, token: Token) -> Client:
    if preset.transport == "groot":
        return GrootClient(endpoint, deadlines, preset, token)
    if preset.transport == "openpi":
        return OpenpiClient(endpoint, deadlines, preset.start, preset.naming, token, preset.robot)
    return VlaEvalClient(endpoint, deadlines, preset.start, preset.naming, token)
