"""Client of GR00T's inference servers, N1.5's first of all: ZeroMQ, in each of their encodings.

Which encoding a server has shows in how it answers a ping in the newer one, without unpickling.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pytest_safemanip.errors import PolicyConnectionLost
from pytest_safemanip.policies.remote import observation as seen
from pytest_safemanip.policies.remote import torchfile
from pytest_safemanip.policies.remote.actions import ActionError, part_label, parted
from pytest_safemanip.policies.remote.arrays import DecodingError
from pytest_safemanip.policies.remote.client import Answer, BadAnswer, Beginning
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.observation import Observation
from pytest_safemanip.policies.remote.packing import from_groot, groot_array, pack, unpack
from pytest_safemanip.policies.remote.zeromq import RequestSocket


@dataclass(frozen=True)
class Encoding:
    """How maps become messages.

    Attributes:
        name: for reports.
        encode: a map to bytes.
        decode: the inverse; raises DecodingError.
    """

    name: str
    encode: Callable[[Any], bytes]
    decode: Callable[[bytes], Any]


MSGPACK = Encoding("msgpack", lambda v: pack(v, groot_array), lambda d: unpack(d, from_groot))
TORCH = Encoding("torch", torchfile.write, torchfile.read)


def request_of(observation: Observation) -> dict[str, Any]:
    """What N1.5's RoboCasa365 models are asked with: one sample, one moment.

    Returns:
        Images (1, 1, 256, 256, 3), uint8, unscaled: the server crops and scales. State parts
        (1, 1, D), float32. The instruction as a list of one.
    """
    images = {key: observation[key][None, None] for key in seen.CAMERAS}
    state = {key: observation[key][None, None] for key in seen.STATE}
    return {**images, **state, seen.INSTRUCTION: [observation[seen.INSTRUCTION]]}


def nested(request: Mapping[str, Any]) -> dict[str, Any]:
    """A request as N1.6 and later want it: maps of ``video``, ``state`` and ``language``."""
    groups: dict[str, Any] = {"video": {}, "state": {}, "language": {}}
    for key, value in request.items():
        group, _, rest = key.partition(".")
        if group in groups:
            groups[group][rest] = value
        else:
            groups["language"][key] = [value]
    return groups


class GrootClient:
    """See :class:`~pytest_safemanip.policies.remote.client.Client`.

    Args:
        endpoint: ``tcp``.
        deadlines: ``start`` and ``open`` are used here.
        start: the command that starts the server; part of errors.
        steps: actions of a chunk that will be executed; the model must predict as many.
        token: sent as ``api_token``.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        deadlines: Deadlines,
        start: str,
        steps: int,
        token: str | None = None,
    ) -> None:
        self._socket = RequestSocket(endpoint, deadlines, start)
        self._deadlines, self._steps, self._token = deadlines, steps, token
        self._encoding = MSGPACK
        self._nested = False

    @property
    def is_open(self) -> bool:
        """Whether there is a connection that was not seen to break."""
        return self._socket.is_open

    def open(self) -> Mapping[str, Any]:
        """Connect, find out the encoding, and compare the model's modalities with RoboCasa's."""
        self._socket.open()
        try:
            self._encoding = self._detect()
            answer = self._exchange("get_modality_config", None, self._deadlines.open)
        except PolicyConnectionLost as error:
            raise self._socket.unreachable(
                f"listens, but does not answer a ping within {self._deadlines.open:g} s: it is "
                "busy with another client's call, or it hangs"
            ) from error
        except BadAnswer as error:
            raise self._socket.unreachable(str(error)) from error
        config = _modalities(answer)
        self._nested = config.nested
        self._compare(config)
        protocol = f"GR00T {self._encoding.name}{', nested' if self._nested else ''}"
        return {"protocol": protocol, "metadata": {"modalities": config.keys}}

    def begin(self, episode: Beginning, seconds: float) -> bool:
        """Reset the policy, if the server has a word for it; none takes a seed."""
        if self._nested:
            self._exchange("reset", {"options": None}, seconds)
        return False

    def ask(self, observation: Observation, seconds: float) -> Answer:
        """One inference; a part of the action in each entry of the reply."""
        request = request_of(observation)
        prefix = "action."
        if self._nested:
            prefix, request = "", {"observation": nested(request), "options": None}
        reply = self._exchange("get_action", request, seconds)
        if self._nested and isinstance(reply, list) and reply:
            reply = reply[0]
        if not isinstance(reply, dict):
            raise BadAnswer(f"the reply is {type(reply).__name__}, not a map", request, reply)
        try:
            return Answer(request, reply, parted(reply, prefix), part_label(prefix))
        except ActionError as error:
            raise BadAnswer(str(error), request, reply) from error

    def close(self) -> None:
        """End the connection. The server is left running."""
        self._socket.close()

    def _detect(self) -> Encoding:
        first = self._socket.call(MSGPACK.encode(self._message("ping", None)), self._deadlines.open)
        if first.startswith(b"PK\x03\x04") or first == b"ERROR":
            return TORCH
        try:
            _refused(MSGPACK.decode(first), {})
        except DecodingError as error:
            raise BadAnswer(f"does not answer a ping as GR00T does ({error})", {}, first) from error
        return MSGPACK

    def _message(self, name: str, data: Any) -> dict[str, Any]:
        message = {"endpoint": name} if data is None else {"endpoint": name, "data": data}
        return message | ({"api_token": self._token} if self._token else {})

    def _exchange(self, name: str, data: Any, seconds: float) -> Any:
        sent = data or {}
        reply = self._socket.call(self._encoding.encode(self._message(name, data)), seconds)
        if reply == b"ERROR":
            raise BadAnswer("the server failed, and says no more than ERROR: see its log", sent,
                            reply)  # fmt: skip
        try:
            found = self._encoding.decode(reply)
        except DecodingError as error:
            raise BadAnswer(f"the reply is not GR00T's: {error}", sent, reply) from error
        _refused(found, sent)
        return found

    def _compare(self, config: _Modalities) -> None:
        """Refuse a model of another robot, or one that is told its task in another way."""
        if config.language and seen.INSTRUCTION not in config.language:
            raise self._socket.unreachable(
                f"its model reads {', '.join(config.language)}, the presets' models "
                f"{seen.INSTRUCTION}: another data config is being served"
            )
        if config.horizon is not None and config.horizon < self._steps:
            raise self._socket.unreachable(
                f"its model predicts {config.horizon} steps, and {self._steps} are executed "
                "before the next call"
            )


def _refused(reply: Any, sent: Mapping[str, Any]) -> None:
    """Raise what the server says that went wrong."""
    if isinstance(reply, dict) and "error" in reply:
        raise BadAnswer(f"the server failed: {reply['error']!s:.2000}", sent, reply)


@dataclass(frozen=True)
class _Modalities:
    """What a model reads and predicts, as far as its server says so.

    Attributes:
        keys: names by modality.
        language: those of the instruction.
        horizon: steps of a prediction; None if unknown.
        nested: whether the server is N1.6 or later.
    """

    keys: Mapping[str, list[str]]
    language: tuple[str, ...]
    horizon: int | None
    nested: bool


def _modalities(answer: Any) -> _Modalities:
    """Read a modality config in any of its forms; what is not understood is left out."""
    found: dict[str, Mapping[str, Any]] = {}
    later = False
    for name, config in answer.items() if isinstance(answer, dict) else ():
        inner = config
        if isinstance(inner, dict) and "as_json" in inner:
            later = later or isinstance(inner["as_json"], dict)
            inner = _json(inner["as_json"])
        if isinstance(inner, dict):
            found[str(name)] = inner.get("__dict__", inner)
    keys = {name: _texts(config.get("modality_keys")) for name, config in found.items()}
    deltas = found.get("action", {}).get("delta_indices")
    horizon = int(np.size(deltas)) if isinstance(deltas, (list, np.ndarray)) else None
    return _Modalities(keys, tuple(keys.get("language", ())), horizon, later)


def _json(value: Any) -> Any:
    try:
        return json.loads(value) if isinstance(value, str) else value
    except (ValueError, RecursionError):
        return None


def _texts(value: Any) -> list[str]:
    return [str(item)[:100] for item in value] if isinstance(value, list) else []
