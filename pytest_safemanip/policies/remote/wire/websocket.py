"""One WebSocket connection to a server of a policy: deadlines, bounds, and errors that say why."""

from __future__ import annotations

import contextlib
import socket
import ssl
import struct
import time
from typing import Any

from pytest_safemanip.decoding.arrays import MAX_REPLY
from pytest_safemanip.errors import (
    PolicyAnswerError,
    PolicyConnectionLost,
    PolicyServerError,
    PolicyUnreachable,
    printable,
)
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.library import need
from pytest_safemanip.policies.remote.probing import (
    NO_TLS,
    PROBE_DEADLINE,
    RETRY_PERIOD,
    Peer,
    certificate_fault,
    proxies,
    who_listens,
)
from pytest_safemanip.policies.remote.tokens import Token

CLOSE_DEADLINE = 0.2
_AGAIN = "the episode can be run again from its start"


class WebSocket:
    """A connection that is opened, used by one thread, and dropped at its first failure.

    Args:
        endpoint: where the server is.
        deadlines: ``start`` and ``open`` are used here.
        start: the command that starts the server; part of errors.
        token: sent with the handshake.
    """

    def __init__(self, endpoint: Endpoint, deadlines: Deadlines, start: str, token: Token) -> None:
        self._endpoint, self._deadlines, self._start = endpoint, deadlines, start
        self._token = token
        self._stack = contextlib.ExitStack()
        self._connection: Any = None

    @property
    def is_open(self) -> bool:
        """Whether nothing has failed since it was opened."""
        return self._connection is not None

    def open(self) -> None:
        """Connect and shake hands.

        Raises:
            PolicyUnreachable: if that fails; says what is at the address instead.
        """
        self.close()
        library: Any = need("websockets.sync.client")
        end = time.monotonic() + self._deadlines.start
        while True:
            try:
                connection = self._stack.enter_context(self._connect(library))
                break
            except Exception as error:  # every layer below has its own: DNS, TCP, TLS, proxy, HTTP
                if time.monotonic() >= end or not self._may_come(error):
                    raise self._explained(error) from error
            time.sleep(RETRY_PERIOD)
        self._connection = connection

    def _may_come(self, error: Exception) -> bool:
        """Whether nothing listens, or what did is stopping: another server may be starting."""
        exceptions: Any = need("websockets.exceptions")
        cut_off = (exceptions.InvalidMessage, exceptions.ConnectionClosed, ConnectionError)
        if isinstance(error, ConnectionRefusedError):
            return True
        if isinstance(error, ssl.SSLError):
            return False
        if not isinstance(error, cut_off):
            return False
        peer = who_listens(self._endpoint, min(PROBE_DEADLINE, self._deadlines.open))
        return peer in (Peer.NOBODY, Peer.LEAVING)

    def _connect(self, library: Any) -> Any:
        return library.connect(
            str(self._endpoint),
            additional_headers=(
                {"Authorization": f"Api-Key {self._token.text}"} if self._token else {}
            ),
            # A proxy is for other machines; the library would send 127.0.0.1 through it too.
            proxy=None if self._endpoint.loopback else True,
            # Images do not compress in the time that a loopback or a LAN needs for them.
            compression=None,
            # Servers compute in the thread that would answer pings.
            ping_interval=None,
            open_timeout=self._deadlines.open,
            close_timeout=CLOSE_DEADLINE,
            max_size=MAX_REPLY,
        )

    def send(self, data: bytes, seconds: float) -> None:
        """Send a binary frame.

        Raises:
            PolicyConnectionLost: if the connection broke, or nobody took the data in time.
        """
        try:
            _bound_sending(self._connection, seconds)
            self._connection.send(data)
        except Exception as error:
            raise self._lost(error, f"took no data for {seconds:g} s") from error

    def receive(self, seconds: float) -> bytes | str:
        """The next frame; text is a server's way to say that it failed.

        Raises:
            PolicyConnectionLost: if the connection broke, or nothing came in time.
            PolicyAnswerError: if what came is no WebSocket frame, or too long.
        """
        try:
            return self._connection.recv(timeout=seconds)  # type: ignore[no-any-return]
        except Exception as error:
            raise self._lost(error, f"did not answer within {seconds:g} s") from error

    def close(self) -> None:
        """Drop the connection. May be called twice."""
        self._connection = None
        with contextlib.suppress(Exception):  # whatever it is, the connection is of no more use
            self._stack.close()

    def unreachable(self, what: str) -> PolicyUnreachable:
        """An error about a server that cannot be used at all."""
        self.close()
        return PolicyUnreachable(
            f"policy server {self._endpoint}: {what}; its server is started with: {self._start}"
        )

    def _explained(self, error: Exception) -> PolicyUnreachable:
        exceptions: Any = need("websockets.exceptions")
        said = f"{type(error).__name__}: {error}".rstrip(": ")
        if isinstance(error, socket.gaierror):
            return self.unreachable(f"{self._endpoint.host!r} is no known host ({error})")
        through = proxies() if not self._endpoint.loopback else ""
        proxied = (exceptions.ProxyError, exceptions.InvalidProxy, ImportError, OSError)
        if through and isinstance(error, proxied):
            # The text about an invalid proxy has its URL in it, with the password.
            why = said if not isinstance(error, exceptions.InvalidProxy) else "no valid URL"
            return self.unreachable(
                f"the connection through the proxy of {through} failed ({why}); to go "
                f"directly, add {self._endpoint.host} to NO_PROXY"
            )
        if (fault := certificate_fault(error, self._endpoint)) is not None:
            return self.unreachable(fault)
        if isinstance(error, exceptions.InvalidStatus):
            status = error.response.status_code
            if status in (401, 403):
                refused = "refuses the token" if self._token else "wants a token"
                return self.unreachable(
                    f"{refused} (HTTP {status}): it is read from the environment variable "
                    "SAFEMANIP_TOKEN_POLICY, with the policy's name in capitals"
                )
            return self.unreachable(f"answers HTTP {status}, it is no policy server at this path")
        peer = who_listens(self._endpoint, min(PROBE_DEADLINE, self._deadlines.open))
        if peer is Peer.HTTP and isinstance(error, TimeoutError):
            if "_ssl" in str(error):  # it waits for the end of a request in plain text
                return self.unreachable(NO_TLS)
            peer = Peer.SILENT
        if peer is Peer.SILENT:
            return self.unreachable(
                f"no handshake within {self._deadlines.open:g} s ({said}): the server is busy "
                "with another client's call, which it serves one after the other, or it hangs"
            )
        return self.unreachable(f"{peer.value}, and no WebSocket handshake was made ({said})")

    def _lost(self, error: Exception, late: str) -> PolicyServerError:
        exceptions: Any = need("websockets.exceptions")
        # The library tells of a broken frame only once the server has closed, if it ever does.
        protocol = self._connection.protocol
        broken = None if protocol.close_rcvd_then_sent else protocol.close_sent
        self.close()
        answered = isinstance(error, exceptions.ConnectionClosed) and error.rcvd
        if broken and not answered:
            return PolicyAnswerError(
                f"policy server {self._endpoint}: what it sent is no message of the protocol, or "
                f"over {MAX_REPLY} bytes ({_named(broken)})"
            )
        if isinstance(error, TimeoutError) or isinstance(error.__cause__, BlockingIOError):
            what = f"{late}: it hangs, or other clients keep it busy"
        elif isinstance(error, exceptions.ConnectionClosed):
            what = _why_closed(error)
        else:
            what = f"the connection broke ({type(error).__name__}: {error})"
        return PolicyConnectionLost(f"policy server {self._endpoint}: {what}; {_AGAIN}")


def _why_closed(error: Any) -> str:
    if error.rcvd is None:
        return "died: the connection ended without a closing frame"
    if "keepalive" in error.rcvd.reason:
        return (
            f"its keepalive cut the connection ({_named(error.rcvd)}), since it answers no pings "
            "while it computes: start it with a longer one, or with none"
        )
    return f"closed the connection ({_named(error.rcvd)})"


def _named(frame: Any) -> str:
    return f"{frame.code} {printable(str(frame.reason))}".rstrip()


def _bound_sending(connection: Any, seconds: float) -> None:
    """Give sends a deadline, which the library's own lack."""
    whole, part = divmod(max(seconds, 0.001), 1.0)
    deadline = struct.pack("@ll", int(whole), int(part * 1e6))
    connection.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, deadline)
