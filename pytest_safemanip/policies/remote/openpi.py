"""Client of openpi's policy server, pi0's and pi0.5's, and of this package's own.

One msgpack map each way over a WebSocket; the server's first frame describes it. The protocol has
no words for a new episode or a seed: this package's own server adds them, and says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from typing import Any

from pytest_safemanip.decoding.arrays import DecodingError
from pytest_safemanip.errors import PolicyAnswerError, PolicyServerError, printable
from pytest_safemanip.policies.remote import observation as seen
from pytest_safemanip.policies.remote.actions import ActionError, flat, flat_label
from pytest_safemanip.policies.remote.client import Answer, BadAnswer, Beginning, Turn
from pytest_safemanip.policies.remote.embodiment import PANDA_OMRON, Embodiment
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.images import images_of
from pytest_safemanip.policies.remote.naming import OPENPI, Naming
from pytest_safemanip.policies.remote.observation import Observation
from pytest_safemanip.policies.remote.tokens import NO_TOKEN, Token
from pytest_safemanip.policies.remote.wire.packing import from_openpi, openpi_array, pack, unpack
from pytest_safemanip.policies.remote.wire.websocket import WebSocket

STATE = (
    seen.EEF_POSITION,
    seen.EEF_ROTATION,
    seen.BASE_POSITION,
    seen.BASE_ROTATION,
    seen.GRIPPER,
)
"""Order of the state's 16 numbers of RoboCasa's models; the server normalises them."""

RESET = "safemanip/reset"
"""Key of a request that starts an episode instead of asking for actions: this package's server."""
OWN = "safemanip"
"""Key of this package's server in the metadata."""


def request_of(
    observation: Observation, naming: Naming = OPENPI, robot: Embodiment = PANDA_OMRON
) -> dict[str, Any]:
    """The request of openpi's models.

    Returns:
        Images (224, 224, 3), uint8, three of RoboCasa and two of LIBERO; ``observation/state``
        (16,) or (8,), float32; ``prompt``; by other names, and in another size, if the naming says
        so.
    """
    turned = {camera: robot.picture(observation[camera]) for camera in robot.cameras}
    images = images_of(turned, naming)
    instruction = {naming.keys["instruction"]: observation[robot.instruction]}
    return {**images, naming.keys["state"]: robot.flat_state(observation), **instruction}


class OpenpiClient:
    """See :class:`~pytest_safemanip.policies.remote.client.Client`.

    Args:
        endpoint: ``ws`` or ``wss``.
        deadlines: ``start`` and ``open`` are used here.
        start: the command that starts the server; part of errors.
        naming: of what is in its requests.
        token: sent as ``Authorization: Api-Key``; openpi's own server does not look at it.
        robot: whose observations and actions they are about.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        deadlines: Deadlines,
        start: str,
        naming: Naming = OPENPI,
        token: Token = NO_TOKEN,
        robot: Embodiment = PANDA_OMRON,
    ) -> None:
        self._socket = WebSocket(endpoint, deadlines, start, token)
        self._deadlines, self._naming, self._robot = deadlines, naming, robot
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
        except PolicyAnswerError as error:
            raise self._socket.unreachable(
                f"its first frame cannot be openpi's metadata ({error})"
            ) from error
        except PolicyServerError as error:
            raise self._socket.unreachable(
                f"shakes hands, but sends no metadata within {self._deadlines.open:g} s as openpi "
                f"does ({error.__cause__}); vla-eval's servers wait for a word: their name is "
                "vla-eval"
            ) from error
        try:
            if isinstance(first, str):
                raise DecodingError(f"text: {printable(first)}")
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

    def ask(self, observation: Observation, seconds: float, turn: Turn = nullcontext) -> Answer:
        """One inference; ``actions`` (H, A) of the reply."""
        request = request_of(observation, self._naming, self._robot)
        with turn():
            reply = self._exchange(request, seconds)
        try:
            rows = flat(reply, "actions", self._robot)
            return Answer(request, reply, rows, flat_label("actions", self._robot))
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
            last = printable(lines[-1], 2000)
            raise BadAnswer(f"the server failed: {last}\n{frame.strip()}", request, frame)
        try:
            reply = unpack(frame, from_openpi)
            if not isinstance(reply, dict):
                raise DecodingError(f"{type(reply).__name__} instead of a map")
        except DecodingError as error:
            raise BadAnswer(f"the reply is not openpi's: {error}", request, frame) from error
        return reply
