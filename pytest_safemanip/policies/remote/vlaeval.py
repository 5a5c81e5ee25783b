"""Client of vla-eval's model servers: one adapter for some fifteen families of models.

Messages with a type and a number over a WebSocket; the server keeps its chunks to itself and gives
one action for each observation. It is told when an episode starts and ends.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Mapping
from typing import Any

from pytest_safemanip.decoding.arrays import DecodingError
from pytest_safemanip.errors import PolicyConnectionLost, PolicyServerError, printable
from pytest_safemanip.policies.remote import observation as seen
from pytest_safemanip.policies.remote.actions import ActionError, flat, flat_label
from pytest_safemanip.policies.remote.client import Answer, BadAnswer, Beginning, Turn
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.images import images_of
from pytest_safemanip.policies.remote.naming import PARTS, VLA_EVAL, Naming
from pytest_safemanip.policies.remote.observation import Observation
from pytest_safemanip.policies.remote.tokens import NO_TOKEN, Token
from pytest_safemanip.policies.remote.wire.packing import from_vlaeval, pack, unpack, vlaeval_array
from pytest_safemanip.policies.remote.wire.websocket import WebSocket

PROTOCOL_VERSION = 1


def payload_of(observation: Observation, naming: Naming = VLA_EVAL) -> dict[str, Any]:
    """The observation of vla-eval's RoboCasa365 benchmark, images unscaled."""
    return {
        "images": images_of(observation, naming),
        "state": {naming.keys[part]: observation[key] for part, key in PARTS.items()},
        naming.keys["instruction"]: observation[seen.INSTRUCTION],
    }


class VlaEvalClient:
    """See :class:`~pytest_safemanip.policies.remote.client.Client`.

    Args:
        endpoint: ``ws`` or ``wss``.
        deadlines: ``start`` and ``open`` are used here.
        start: the command that starts the server; part of errors.
        naming: of what is in its requests.
        token: sent as ``Authorization: Api-Key``, for a proxy before the server.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        deadlines: Deadlines,
        start: str,
        naming: Naming = VLA_EVAL,
        token: Token = NO_TOKEN,
    ) -> None:
        self._socket = WebSocket(endpoint, deadlines, start, token)
        self._deadlines, self._naming = deadlines, naming
        self._number = 0
        self._started: tuple[int, Mapping[str, Any]] | None = None

    @property
    def is_open(self) -> bool:
        """Whether there is a connection that was not seen to break."""
        return self._socket.is_open

    def open(self) -> Mapping[str, Any]:
        """Connect and exchange greetings."""
        self._socket.open()
        self._number, self._started = 0, None
        hello = {"harness_version": "0.8.0", "protocol_version": PROTOCOL_VERSION}
        try:
            self._send("hello", hello, self._deadlines.open)
            frame = self._socket.receive(self._deadlines.open)
            kind, _, payload = _read(frame)
        except PolicyServerError as error:
            raise self._socket.unreachable(
                f"shakes hands, but does not answer vla-eval's greeting ({error.__cause__})"
            ) from error
        except DecodingError as error:
            raise self._socket.unreachable(
                f"does not speak vla-eval's protocol ({error}); openpi's servers are named openpi, "
                "pi0 or pi05"
            ) from error
        version = payload.get("protocol_version")
        if kind != "hello" or version != PROTOCOL_VERSION:
            raise self._socket.unreachable(
                f"answers {kind!r} with protocol version {version!r}, this is version "
                f"{PROTOCOL_VERSION}"
            )
        return {"protocol": f"vla-eval {version}", "metadata": payload}

    def begin(self, episode: Beginning, seconds: float) -> bool:
        """Announce the episode. Servers do not answer, and do not say if they use the seed."""
        if self._started is not None:
            with contextlib.suppress(PolicyConnectionLost):
                self._send("episode_end", {}, seconds)
            if not self._socket.is_open:
                self.open()
        payload = {"task": {"name": episode.task, "seed": episode.seed}}
        self._started = self._send("episode_start", payload, seconds), payload
        return False

    def ask(
        self, observation: Observation, seconds: float, turn: Turn = contextlib.nullcontext
    ) -> Answer:
        """One inference; ``actions`` (12,) of the reply."""
        payload = payload_of(observation, self._naming)
        with turn():
            number = self._send("observation", payload, seconds)
            reply = self._reply(number, payload, seconds)
        key = "actions" if "actions" in reply else "action"
        try:
            return Answer(payload, reply, flat(reply, key), flat_label(key))
        except ActionError as error:
            raise BadAnswer(str(error), payload, reply) from error

    def close(self) -> None:
        """End the episode and the connection."""
        if self._socket.is_open and self._started is not None:
            with contextlib.suppress(PolicyConnectionLost):
                self._send("episode_end", {}, self._deadlines.open)
        self._started = None
        self._socket.close()

    def _send(self, kind: str, payload: Mapping[str, Any], seconds: float) -> int:
        self._number += 1
        message = {
            "type": kind,
            "payload": payload,
            "seq": self._number,
            "timestamp": time.time(),
        }
        self._socket.send(pack(message, vlaeval_array), seconds)
        return self._number

    def _reply(self, number: int, payload: Mapping[str, Any], seconds: float) -> dict[Any, Any]:
        """The action that answers an observation; every other message is an error."""
        frame = self._socket.receive(seconds)
        try:
            kind, answered, reply = _read(frame)
        except DecodingError as error:
            raise BadAnswer(f"the reply is not vla-eval's: {error}", payload, frame) from error
        if kind == "error":
            # A failed start of the episode is reported only now, as nothing waited for it.
            started = self._started
            about = started[1] if started and answered == started[0] else payload
            said = reply.get("error", reply)
            raise BadAnswer(
                f"the server failed: {printable(str(said), 2000, lines=True)}", about, reply
            )
        if kind != "action" or answered != number:
            raise BadAnswer(
                f"the reply is {kind!r} number {answered}, expected 'action' number {number}: the "
                "server mixes up its clients",
                payload,
                reply,
            )
        return reply


def _read(frame: bytes | str) -> tuple[str, int, dict[Any, Any]]:
    """Type, number and content of a message."""
    if isinstance(frame, str):
        raise DecodingError(f"text: {printable(frame)}")
    message = unpack(frame, from_vlaeval)
    if not isinstance(message, dict):
        raise DecodingError(f"{type(message).__name__} instead of a map")
    kind, number, payload = (message.get(key) for key in ("type", "seq", "payload"))
    if not isinstance(kind, str) or type(number) is not int or not isinstance(payload, dict):
        keys = printable(", ".join(map(str, list(message)[:8])))
        raise DecodingError(f"no message: it has {keys}")
    return kind, number, payload
