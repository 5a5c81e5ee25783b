"""Client of openpi's policy server, pi0's and pi0.5's, and of this package's own.

One msgpack map each way over a WebSocket; the server's first frame describes it. The protocol has
no words for a new episode or a seed: this package's own server adds them, and says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pytest_safemanip.errors import PolicyServerError
from pytest_safemanip.policies.remote import observation as seen
from pytest_safemanip.policies.remote.actions import ActionError, flat, flat_label
from pytest_safemanip.policies.remote.arrays import DecodingError
from pytest_safemanip.policies.remote.client import Answer, BadAnswer, Beginning
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.images import resize_with_pad
from pytest_safemanip.policies.remote.observation import Observation
from pytest_safemanip.policies.remote.packing import from_openpi, openpi_array, pack, unpack
from pytest_safemanip.policies.remote.websocket import WebSocket

IMAGE_SIZE = 224
IMAGES = {
    "observation/image": seen.LEFT,
    "observation/wrist_image": seen.WRIST,
    "observation/right_image": seen.RIGHT,
}
"""pi0 ignores the right image, pi0.5 insists on it."""
STATE = (
    seen.EEF_POSITION,
    seen.EEF_ROTATION,
    seen.BASE_POSITION,
    seen.BASE_ROTATION,
    seen.GRIPPER,
)
"""Order of the state's 16 numbers; the server normalises them."""

RESET = "safemanip/reset"
"""Key of a request that starts an episode instead of asking for actions: this package's server."""
OWN = "safemanip"
"""Key of this package's server in the metadata."""


def request_of(observation: Observation) -> dict[str, Any]:
    """What openpi's RoboCasa365 models are asked with.

    Returns:
        Three images (224, 224, 3), uint8; ``observation/state`` (16,), float32; ``prompt``.
    """
    images = {key: resize_with_pad(observation[name], IMAGE_SIZE) for key, name in IMAGES.items()}
    state = np.concatenate([observation[key] for key in STATE]).astype(np.float32)
    return {**images, "observation/state": state, "prompt": observation[seen.INSTRUCTION]}


class OpenpiClient:
    """See :class:`~pytest_safemanip.policies.remote.client.Client`.

    Args:
        endpoint: ``ws`` or ``wss``.
        deadlines: ``start`` and ``open`` are used here.
        start: the command that starts the server; part of errors.
        token: sent as ``Authorization: Api-Key``; openpi's own server does not look at it.
    """

    def __init__(
        self, endpoint: Endpoint, deadlines: Deadlines, start: str, token: str | None = None
    ) -> None:
        headers = {"Authorization": f"Api-Key {token}"} if token else {}
        self._socket = WebSocket(endpoint, deadlines, start, headers)
        self._deadlines = deadlines
        self._resets = False

    @property
    def is_open(self) -> bool:
        """Whether there is a connection that was not seen to break."""
        return self._socket.is_open

    def open(self) -> Mapping[str, Any]:
        """Connect and read what the server says about itself."""
        self._socket.open()
        try:
            first = self._socket.receive(self._deadlines.open)
        except PolicyServerError as error:
            raise self._socket.unreachable(
                f"shakes hands, but sends no metadata within {self._deadlines.open:g} s as openpi "
                f"does ({error.__cause__}); vla-eval's servers wait for a word: their name is "
                "vla-eval"
            ) from error
        try:
            if isinstance(first, str):
                raise DecodingError(f"text: {first:.200}")
            metadata = unpack(first, from_openpi)
            if not isinstance(metadata, dict):
                raise DecodingError(f"{type(metadata).__name__} instead of a map")
        except DecodingError as error:
            raise self._socket.unreachable(
                f"its first frame is not openpi's metadata ({error})"
            ) from error
        own = metadata.get(OWN)
        self._resets = isinstance(own, dict) and own.get("reset") is True
        return {"protocol": "openpi", "metadata": metadata}

    def begin(self, episode: Beginning, seconds: float) -> bool:
        """Reset and seed the policy, if the server is this package's own."""
        if not self._resets:
            return False
        request = {RESET: vars(episode)}
        reply = self._exchange(request, seconds)
        if reply.get(RESET) is not True:
            raise BadAnswer("the server did not confirm the reset", request, reply)
        return True

    def ask(self, observation: Observation, seconds: float) -> Answer:
        """One inference; ``actions`` (H, 12) of the reply."""
        request = request_of(observation)
        reply = self._exchange(request, seconds)
        try:
            return Answer(request, reply, flat(reply, "actions"), flat_label("actions"))
        except ActionError as error:
            raise BadAnswer(str(error), request, reply) from error

    def close(self) -> None:
        """End the connection."""
        self._socket.close()

    def _exchange(self, request: Mapping[str, Any], seconds: float) -> dict[Any, Any]:
        self._socket.send(pack(request, openpi_array), seconds)
        frame = self._socket.receive(seconds)
        if isinstance(frame, str):
            lines = frame.strip().splitlines() or ["nothing"]
            raise BadAnswer(f"the server failed: {lines[-1]}\n{frame.strip()}", request, frame)
        try:
            reply = unpack(frame, from_openpi)
            if not isinstance(reply, dict):
                raise DecodingError(f"{type(reply).__name__} instead of a map")
        except DecodingError as error:
            raise BadAnswer(f"the reply is not openpi's: {error}", request, frame) from error
        return reply
