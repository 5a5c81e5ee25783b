"""The interface of clients of policy servers, the same for every protocol."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.policies.remote.observation import Observation

Turn = Callable[[], AbstractContextManager[object]]
"""Gives what is held while a server is asked."""


@dataclass(frozen=True)
class Beginning:
    """What a server gets to know when an episode starts, if its protocol has words for it.

    Attributes:
        task: name of the task.
        seed: for whatever is random in the model.
        instruction: the task's instruction.
    """

    task: str
    seed: int
    instruction: str


@dataclass(frozen=True)
class Answer:
    """One exchange with a server.

    Attributes:
        request: what was sent.
        reply: what came.
        rows: (H, 12), the actions in it, as the model gives them.
        label: names a row and a column of them in the words of the reply.
    """

    request: Mapping[str, Any]
    reply: Any
    rows: NDArray[np.float64]
    label: Callable[[int, int], str]


class BadAnswer(Exception):
    """A reply that is no answer.

    Args:
        what: says so, for people.
        request: what was sent.
        reply: what came, as far as it could be decoded.
    """

    def __init__(self, what: str, request: Mapping[str, Any], reply: Any) -> None:
        super().__init__(what)
        self.request, self.reply = request, reply


class Client(Protocol):
    """Speaks with one server. Not to be shared between threads."""

    @property
    def is_open(self) -> bool:
        """Whether there is a connection that was not seen to break."""

    def open(self) -> Mapping[str, Any]:
        """Connect, and drop an earlier connection.

        Returns:
            What the server says about itself and which protocol was found; plain values.

        Raises:
            PolicyUnreachable: if there is no server that speaks the protocol.
        """

    def begin(self, episode: Beginning, seconds: float) -> bool:
        """Tell the server that an episode starts.

        Returns:
            Whether the server has taken the seed.

        Raises:
            PolicyConnectionLost: if the connection broke, or it took longer than ``seconds``.
            BadAnswer: if the server refuses.
        """

    def ask(self, observation: Observation, seconds: float, turn: Turn = nullcontext) -> Answer:
        """Request one inference.

        Args:
            observation: from :func:`~pytest_safemanip.policies.remote.observation.checked`.
            seconds: until it must have been answered, once it was the request's turn.
            turn: held from sending the request to its reply, not while it is prepared.

        Raises:
            PolicyConnectionLost: if the connection broke, or it took longer.
            BadAnswer: if what came is no answer.
        """

    def close(self) -> None:
        """End the connection. May be called twice."""
