"""Finds out what listens at an address, for errors that name the cause."""

from __future__ import annotations

import contextlib
import os
import socket
import ssl
import time
from enum import Enum

from pytest_safemanip.policies.remote.endpoint import Endpoint

PROBE_DEADLINE = 1.0
"""Seconds for what listens to say something, once it is known that it does not do its work."""
RETRY_PERIOD = 0.1
"""Seconds between two attempts to reach a server that is being started."""

NO_TLS = "speaks no TLS: its address begins with ws://"
_OWN = "FILE.pem in the environment names the certificates that are trusted"
_CERTIFICATES = (
    ((18,), f"its certificate is self-signed: SSL_CERT_FILE={_OWN}; give it this one"),
    (
        (19, 20, 21),
        "its certificate is signed by an authority that this machine does not trust: "
        f"SSL_CERT_FILE={_OWN}; give it the authority's",
    ),
    ((9,), "its certificate is not valid yet: set the clock of this machine, or of the server's"),
    ((10,), "its certificate has expired: renew it on the server, and check this machine's clock"),
    (
        (62, 64),
        "its certificate is for another host than {host}: name the host in the address as the "
        "certificate does",
    ),
)
"""What OpenSSL's codes of X.509 errors mean, and what helps."""

_ZMTP_SIGNATURE = 10  # a ZeroMQ peer begins with FF, eight bytes, 7F, before it was sent anything


class Peer(Enum):
    """Kinds of listeners; the value completes "at ADDRESS ...".

    ZeroMQ answers from a thread of its own: its greeting does not mean that Python still runs.
    """

    NOBODY = "nothing listens"
    UNKNOWN = "is no host that can be reached"
    LEAVING = "something accepts connections and closes them at once: it is stopping"
    SILENT = "something accepts connections and says nothing: it is busy or hangs"
    ZMQ = "a ZeroMQ server listens, as GR00T's"
    HTTP = "an HTTP or WebSocket server listens, as openpi's and vla-eval's"
    TLS = "a server with TLS listens: its address begins with wss://"
    OTHER = "something listens that is neither a WebSocket nor a ZeroMQ server"


def who_listens(endpoint: Endpoint, seconds: float) -> Peer:
    """Find out what is at an address.

    Args:
        endpoint: the address; its scheme does not matter.
        seconds: to wait for each of up to three things.
    """
    try:
        with socket.create_connection((endpoint.host, endpoint.port), seconds) as connection:
            peer = _listen(connection, seconds)
        # Told in plain text, most servers with TLS hang up, like one that is stopping.
        if peer is Peer.LEAVING and endpoint.scheme != "wss" and _speaks_tls(endpoint, seconds):
            return Peer.TLS
        return peer
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
    if greeting[:2] == b"\x15\x03":  # an alert
        return Peer.TLS
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


def _speaks_tls(endpoint: Endpoint, seconds: float) -> bool:
    """Whether a TLS handshake can be made, with whatever certificate; nothing is sent over it."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    try:
        with (
            socket.create_connection((endpoint.host, endpoint.port), seconds) as connection,
            context.wrap_socket(connection, server_hostname=endpoint.host),
        ):
            return True
    except OSError:
        return False


def certificate_fault(error: BaseException, endpoint: Endpoint) -> str | None:
    """What is wrong with the TLS of a server, and the remedy, in one line; None if nothing is."""
    if not isinstance(error, ssl.SSLError):
        return None
    if not isinstance(error, ssl.SSLCertVerificationError):
        if error.reason in ("WRONG_VERSION_NUMBER", "RECORD_LAYER_FAILURE"):
            return NO_TLS
        return f"the TLS handshake failed ({error.reason or error})"
    found = next((says for codes, says in _CERTIFICATES if error.verify_code in codes), "")
    what, _, remedy = found.partition(": ")
    said = what.format(host=endpoint.host) or "its certificate cannot be verified"
    remedy = remedy or f"SSL_CERT_FILE={_OWN}"
    return f"{said} ({error.verify_message}): {remedy}"


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
