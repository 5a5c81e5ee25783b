"""Client of GR00T's inference servers, N1.5's first of all: ZeroMQ, in each of their encodings.

Which encoding a server has shows in how it answers a ping in the newer one, without unpickling.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any

from pytest_safemanip.decoding import torchfile
from pytest_safemanip.decoding.arrays import DecodingError
from pytest_safemanip.errors import PolicyConnectionLost, PolicyMismatch, printable
from pytest_safemanip.policies.remote import observation as seen
from pytest_safemanip.policies.remote.actions import ActionError, part_label, parted
from pytest_safemanip.policies.remote.client import Answer, BadAnswer, Beginning, Turn
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.groot_modalities import fitted, modalities
from pytest_safemanip.policies.remote.images import images_of
from pytest_safemanip.policies.remote.naming import PARTS, ROBOCASA, Naming
from pytest_safemanip.policies.remote.observation import Observation
from pytest_safemanip.policies.remote.presets import Layout, Preset
from pytest_safemanip.policies.remote.tokens import NO_TOKEN, Token
from pytest_safemanip.policies.remote.wire.packing import from_groot, groot_array, pack, unpack
from pytest_safemanip.policies.remote.wire.zeromq import RequestSocket


@dataclass(frozen=True)
class Encoding:
    """An encoding of messages.

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


def request_of(observation: Observation, naming: Naming = ROBOCASA) -> dict[str, Any]:
    """The request of N1.5's RoboCasa365 models: one sample, one time step.

    Args:
        observation: checked.
        naming: of its entries.

    Returns:
        Images (1, 1, 256, 256, 3), uint8, unscaled: the server crops and scales. State parts
        (1, 1, D), float32. The instruction as a list of one.
    """
    images = {k: image[None, None] for k, image in images_of(observation, naming).items()}
    state = {naming.keys[part]: observation[key][None, None] for part, key in PARTS.items()}
    return {**images, **state, naming.keys["instruction"]: [observation[seen.INSTRUCTION]]}


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
        preset: how the policy is served.
        token: sent as ``api_token``.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        deadlines: Deadlines,
        preset: Preset,
        token: Token = NO_TOKEN,
    ) -> None:
        self._socket = RequestSocket(endpoint, deadlines, preset.start)
        self._deadlines, self._preset, self._token = deadlines, preset, token
        self._encoding = MSGPACK
        self._later = False
        self._layout: Layout = preset.layout
        self._naming = preset.naming

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
        config = modalities(answer)
        self._later = config.later
        self._layout = self._preset.layout if config.later else "flat"
        try:
            self._naming = fitted(self._preset, config)
        except ValueError as error:
            raise PolicyMismatch(str(self._socket.unreachable(str(error)))) from None
        protocol = f"GR00T {self._encoding.name}{', N1.6 or later' if self._later else ''}"
        return {"protocol": protocol, "metadata": {"modalities": config.keys}}

    def begin(self, episode: Beginning, seconds: float) -> bool:
        """Reset the policy, if the server has a word for it; none takes a seed."""
        if self._later:
            self._exchange("reset", {"options": None}, seconds)
        return False

    def ask(self, observation: Observation, seconds: float, turn: Turn = nullcontext) -> Answer:
        """One inference; a part of the action in each entry of the reply."""
        flat = request_of(observation, self._naming)
        with turn():
            if self._later:
                request, reply = self._ask_later(flat, seconds)
            else:
                request, reply = flat, self._exchange("get_action", flat, seconds)
        if not isinstance(reply, dict):
            raise BadAnswer(f"the reply is {type(reply).__name__}, not a map", request, reply)
        prefix = "" if self._later and not any(_is_flat(key) for key in reply) else "action."
        try:
            return Answer(request, reply, parted(reply, prefix), part_label(prefix))
        except ActionError as error:
            raise BadAnswer(str(error), request, reply) from error

    def _ask_later(self, flat: dict[str, Any], seconds: float) -> tuple[dict[str, Any], Any]:
        """One inference of N1.6 or later, whose wrapper for simulators wants flat maps and says so
        only by refusing others: the layout that is not refused is kept.
        """
        layouts: dict[str, dict[str, Any]] = {"nested": nested(flat), "flat": flat}
        refused: list[BadAnswer] = []
        for layout in ("nested", "flat") if self._layout == "auto" else (self._layout,):
            request = {"observation": layouts[layout], "options": None}
            try:
                reply = self._exchange("get_action", request, seconds)
            except BadAnswer as bad:
                refused.append(bad)
                continue
            self._layout = "flat" if layout == "flat" else "nested"
            return request, reply[0] if isinstance(reply, list) and reply else reply
        if len(refused) == 1:
            raise refused[0]
        first, second = (str(bad).replace("\n", " ") for bad in refused)
        both = f"asked in nested maps, {first}; asked in a flat one, {second}"
        raise BadAnswer(both, refused[0].request, refused[0].reply)

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
        return message | ({"api_token": self._token.text} if self._token else {})

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


def _refused(reply: Any, sent: Mapping[str, Any]) -> None:
    """Raise what the server says that went wrong."""
    if isinstance(reply, dict) and "error" in reply:
        raise BadAnswer(
            f"the server failed: {printable(str(reply['error']), 2000, lines=True)}", sent, reply
        )


def _is_flat(key: Any) -> bool:
    return isinstance(key, str) and key.startswith("action.")
