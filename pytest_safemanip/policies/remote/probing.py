"""What it is that listens at an address, for errors that name the cause."""

from __future__ import annotations

import contextlib
import os
import socket
import time
from enum import Enum

from pytest_safemanip.policies.remote.endpoint import Endpoint

PROBE_DEADLINE = 1.0
"""Seconds for what listens to say something, once it is known that it does not do its work."""
RETRY_PERIOD = 0.1
"""Seconds between two attempts to reach a server that is being started."""

_ZMTP_SIGNATURE = 10  # a ZeroMQ peer begins with FF, eight bytes, 7F, before it was sent anything


class Peer(Enum):
    """What is at an address; the value completes "at ADDRESS ...".

    ZeroMQ answers from a thread of its own: its greeting does not mean that Python still runs.
    """

    NOBODY = "nothing listens"
    UNKNOWN = "is no host that can be reached"
    LEAVING = "something accepts connections and closes them at once: it is stopping"
    SILENT = "something accepts connections and says nothing: it is busy or hangs"
    ZMQ = "a ZeroMQ server listens, as GR00T's"
    HTTP = "an HTTP or WebSocket server listens, as openpi's and vla-eval's"
    OTHER = "something listens that is neither a WebSocket nor a ZeroMQ server"


def who_listens(endpoint: Endpoint, seconds: float) -> Peer:
    """Find out what is at an address.

    Args:
        endpoint: the address; its scheme does not matter.
        seconds: to wait for each of up to three things.
    """
    try:
        with socket.create_connection((endpoint.host, endpoint.port), seconds) as connection:
            return _listen(connection, seconds)
    except ConnectionRefusedError:
        return Peer.NOBODY
    except OSError:
        return Peer.UNKNOWN


def _listen(connection: socket.socket, seconds: float) -> Peer:
    greeting, ended = _read(connection, _ZMTP_SIGNATURE, min(seconds, 0.3))
    if not greeting and not ended:
        with contextlib.suppress(OSError):
            connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
        greeting, ended = _read(connection, 5, seconds)
    if greeting[:1] == b"\xff" and greeting[9:10] == b"\x7f":
        return Peer.ZMQ
    if greeting[:5] == b"HTTP/":
        return Peer.HTTP
    if greeting:
        return Peer.OTHER
    return Peer.LEAVING if ended else Peer.SILENT


def _read(connection: socket.socket, size: int, seconds: float) -> tuple[bytes, bool]:
    """Up to ``size`` bytes, as they came in time, and whether the other side closed."""
    found, end = b"", time.monotonic() + seconds
    while len(found) < size and (left := end - time.monotonic()) > 0:
        connection.settimeout(left)
        try:
            more = connection.recv(size - len(found))
        except TimeoutError:
            break
        except OSError:
            return found, True
        if not more:
            return found, True
        found += more
    return found, False


def wait_for_listener(endpoint: Endpoint, start: float, seconds: float) -> Peer:
    """Like :func:`who_listens`; while nobody does, up to ``start`` seconds are waited."""
    end = time.monotonic() + start
    while True:
        peer = who_listens(endpoint, seconds)
        if peer not in (Peer.NOBODY, Peer.LEAVING) or time.monotonic() >= end:
            return peer
        time.sleep(RETRY_PERIOD)


def proxies() -> str:
    """The environment's proxy settings by name, for errors; their values may hold passwords."""
    known = ("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY", "SOCKS_PROXY")
    return ", ".join(name for name in os.environ if name.upper() in known)
