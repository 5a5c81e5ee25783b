"""What it is that listens at an address, for errors that name the cause."""

from __future__ import annotations

import contextlib
import os
import socket
import time
from enum import Enum

from pytest_safemanip.policies.remote.endpoint import Endpoint

RETRY_PERIOD = 0.1
"""Seconds between two attempts to reach a server that is being started."""

_ZMTP_SIGNATURE = 10  # a ZeroMQ peer begins with FF, eight bytes, 7F, before it was sent anything


class Peer(Enum):
    """What is at an address; the value completes "at ADDRESS ...".

    ZeroMQ answers from a thread of its own: its greeting does not mean that Python still runs.
    """

    NOBODY = "nothing listens"
    UNKNOWN = "is no host that can be reached"
    SILENT = "something accepts connections and says nothing: it is busy or hangs"
    ZMQ = "a ZeroMQ server listens, as GR00T's"
    HTTP = "an HTTP or WebSocket server listens, as openpi's and vla-eval's"
    OTHER = "something listens that is neither a WebSocket nor a ZeroMQ server"


def who_listens(endpoint: Endpoint, seconds: float = 1.0) -> Peer:
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
    greeting = _read(connection, _ZMTP_SIGNATURE, min(seconds, 0.3))
    if not greeting:
        with contextlib.suppress(OSError):
            connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
        greeting = _read(connection, 5, seconds)
    if greeting[:1] == b"\xff" and greeting[9:10] == b"\x7f":
        return Peer.ZMQ
    if greeting[:5] == b"HTTP/":
        return Peer.HTTP
    return Peer.OTHER if greeting else Peer.SILENT


def _read(connection: socket.socket, size: int, seconds: float) -> bytes:
    """Up to ``size`` bytes; what came until the time was over or the other side closed."""
    found, end = b"", time.monotonic() + seconds
    while len(found) < size and (left := end - time.monotonic()) > 0:
        connection.settimeout(left)
        try:
            more = connection.recv(size - len(found))
        except OSError:
            break
        if not more:
            break
        found += more
    return found


def wait_for_listener(endpoint: Endpoint, seconds: float) -> Peer:
    """Like :func:`who_listens`; while nobody does, up to ``seconds`` are given to a start."""
    end = time.monotonic() + seconds
    while (peer := who_listens(endpoint)) is Peer.NOBODY and time.monotonic() < end:
        time.sleep(RETRY_PERIOD)
    return peer


def proxies() -> str:
    """The environment's proxy settings by name, for errors; their values may hold passwords."""
    known = ("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY", "SOCKS_PROXY")
    return ", ".join(name for name in os.environ if name.upper() in known)
