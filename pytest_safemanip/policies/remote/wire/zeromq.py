"""One ZeroMQ request socket to a server of a policy: deadlines, bounds, errors that say why."""

from __future__ import annotations

import time
from typing import Any

from pytest_safemanip.decoding.arrays import MAX_REPLY
from pytest_safemanip.errors import PolicyConnectionLost, PolicyUnreachable
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.library import need
from pytest_safemanip.policies.remote.probing import PROBE_DEADLINE, Peer, wait_for_listener

_AGAIN = "the episode can be run again from its start"


class RequestSocket:
    """A socket that is opened, used by one thread, and dropped at its first failure.

    ZeroMQ itself never says that a server is missing, gone or hanging: it goes on waiting. The
    connection is watched beside the reply, and both within a deadline.

    Args:
        endpoint: where the server is.
        deadlines: ``start`` and ``open`` are used here.
        start: the command that starts the server; part of errors.
    """

    def __init__(self, endpoint: Endpoint, deadlines: Deadlines, start: str) -> None:
        self._endpoint, self._deadlines, self._start = endpoint, deadlines, start
        self._context: Any = None
        self._socket: Any = None
        self._monitor: Any = None

    @property
    def is_open(self) -> bool:
        """Whether nothing has failed since it was opened."""
        return self._socket is not None

    def open(self) -> None:
        """Make sure that a ZeroMQ server listens, and connect to it.

        Raises:
            PolicyUnreachable: if none does; says what does.
        """
        self.close()
        zmq = need("zmq")
        seconds = min(PROBE_DEADLINE, self._deadlines.open)
        peer = wait_for_listener(self._endpoint, self._deadlines.start, seconds)
        if peer is not Peer.ZMQ:
            raise self.unreachable(
                f"{peer.value}; a GR00T server speaks ZeroMQ"
                + (": an openpi server's policies are openpi, pi0 and pi05, at ws://"
                   if peer is Peer.HTTP else "")
            )  # fmt: skip
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.REQ)
        for option, value in (
            (zmq.REQ_RELAXED, 1),
            (zmq.REQ_CORRELATE, 1),
            (zmq.LINGER, 0),
            (zmq.MAXMSGSIZE, MAX_REPLY),
            (zmq.IPV6, int(":" in self._endpoint.host)),
        ):
            self._socket.setsockopt(option, value)
        self._monitor = self._socket.get_monitor_socket(zmq.EVENT_DISCONNECTED)
        self._socket.connect(str(self._endpoint))

    def call(self, request: bytes, seconds: float) -> bytes:
        """Send a request and wait for its reply.

        Raises:
            PolicyConnectionLost: if the connection broke, or nothing came in time.
        """
        zmq = need("zmq")
        end = time.monotonic() + seconds
        for option in (zmq.SNDTIMEO, zmq.RCVTIMEO):
            self._socket.setsockopt(option, max(1, int(seconds * 1000)))
        try:
            self._socket.send(request)
        except zmq.ZMQError as error:
            raise self._lost(f"took no data for {seconds:g} s") from error
        poller = zmq.Poller()
        poller.register(self._socket, zmq.POLLIN)
        poller.register(self._monitor, zmq.POLLIN)
        ready = dict(poller.poll(max(0, int((end - time.monotonic()) * 1000))))
        if self._socket in ready:
            return bytes(self._socket.recv())
        if ready:
            raise self._lost(f"died or refused the request ({len(request)} bytes), or its reply "
                             f"is over {MAX_REPLY} bytes")  # fmt: skip
        raise self._lost(f"did not answer within {seconds:g} s: it hangs, or other clients keep "
                         "it busy")  # fmt: skip

    def close(self) -> None:
        """Drop the connection. May be called twice."""
        if self._context is None:
            return
        self._socket.disable_monitor()
        self._monitor.close()
        self._socket.close()
        self._context.destroy(linger=0)
        self._context = self._socket = self._monitor = None

    def unreachable(self, what: str) -> PolicyUnreachable:
        """An error about a server that cannot be used at all."""
        self.close()
        return PolicyUnreachable(
            f"policy server {self._endpoint}: {what}; its server is started with: {self._start}"
        )

    def _lost(self, what: str) -> PolicyConnectionLost:
        self.close()
        return PolicyConnectionLost(f"policy server {self._endpoint}: {what}; {_AGAIN}")
