"""Serves a policy that runs here to any client of openpi's protocol; see ``safemanip serve``.

Beyond what openpi's own server does, an episode can be started with a seed, the metadata say what
is served, and nobody but this machine is answered unless a host is given.
"""

from __future__ import annotations

import inspect
import pkgutil
import sys
import threading
import traceback
from collections.abc import Callable, Mapping
from http import HTTPStatus
from typing import Any

import numpy as np

import pytest_safemanip
from pytest_safemanip.decoding.arrays import DecodingError
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.policies.remote.library import need
from pytest_safemanip.policies.remote.openpi import OWN, RESET
from pytest_safemanip.policies.remote.wire.packing import from_openpi, openpi_array, pack, unpack
from pytest_safemanip.provenance import closure_digest, file_of

MAX_REQUEST = 16 * 2**20
"""Bytes of a request; three images of 1024 x 1024 are 9 MiB."""

Infer = Callable[[dict[Any, Any]], Any]


class ServedPolicy:
    """A policy behind the server; calls are serialised across clients.

    Args:
        name: ``module:attribute``.
        target: an object with ``infer(request)`` or ``act(request)``, a class or factory of one,
            or a function of the request. It gives ``{"actions": (H, 12)}``, or the array alone.
            If it has ``reset``, that is called with the episode's seed, or with nothing if it
            takes nothing.

    Raises:
        ConfigError: if it is no policy.
    """

    def __init__(self, name: str, target: Any) -> None:
        if inspect.isclass(target) or (inspect.isfunction(target) and not _takes(target)):
            target = target()
        methods = (getattr(target, method, None) for method in ("infer", "act"))
        infer = next((m for m in methods if callable(m)), target)
        if not callable(infer):
            raise ConfigError(f"policy {name!r}: has no 'infer(request)' and cannot be called")
        self._infer: Infer = infer
        self._reset: Callable[..., Any] | None = getattr(target, "reset", None)
        self._turn = threading.Lock()
        self.clients: set[Any] = set()
        self.metadata = _metadata(name, target, self._reset)

    def answer(self, request: dict[Any, Any]) -> dict[Any, Any]:
        """Call the policy, or restart it for an episode."""
        with self._turn:
            if RESET in request:
                return {RESET: self._restart(request[RESET])}
            answer = self._infer(request)
        return dict(answer) if isinstance(answer, Mapping) else {"actions": np.asarray(answer)}

    def _restart(self, episode: Mapping[str, Any]) -> bool:
        if self._reset is None:
            return False
        self._reset(*([episode["seed"]] if _takes(self._reset) else []))
        return True


def load(name: str) -> ServedPolicy:
    """Import a policy.

    Args:
        name: ``module:attribute``; the module is installed, or in the current folder.

    Raises:
        ConfigError: if it cannot be imported, or is no policy.
    """
    if ":" not in name:
        raise ConfigError(f"policy {name!r}: expected MODULE:ATTRIBUTE")
    try:
        target = pkgutil.resolve_name(name)
    except Exception as error:  # the user's module may raise anything
        what = f"{type(error).__name__}: {error}"
        raise ConfigError(f"policy {name!r}: cannot be imported ({what})") from error
    return ServedPolicy(name, target)


def make_server(served: ServedPolicy, host: str, port: int) -> Any:
    """A server that listens, and answers once its ``serve_forever`` runs.

    Raises:
        ConfigError: if the address cannot be listened at.
    """
    library: Any = need("websockets.sync.server")
    try:
        return library.serve(
            lambda connection: _converse(connection, served),
            host,
            port,
            process_request=_health,
            compression=None,
            max_size=MAX_REQUEST,
            # A client that is simulating answers no pings.
            ping_interval=None,
            close_timeout=1.0,
        )
    except (OSError, OverflowError) as error:
        raise ConfigError(
            f"cannot listen at {host}:{port} ({error}); try another --port"
        ) from error


def _converse(connection: Any, served: ServedPolicy) -> None:
    """Serve one client until it leaves."""
    closed: Any = need("websockets.exceptions").ConnectionClosed
    served.clients.add(connection)
    try:
        connection.send(pack(served.metadata, openpi_array))
        while True:
            frame = connection.recv()
            try:
                reply = pack(served.answer(_request(frame)), openpi_array)
            except Exception:  # the policy may raise anything; the client is told, as by openpi
                connection.send(traceback.format_exc())
                connection.close(1011, "the policy failed, see the frame before")
                return
            connection.send(reply)
    except closed:
        return
    finally:
        served.clients.discard(connection)


def _request(frame: bytes | str) -> dict[Any, Any]:
    if isinstance(frame, str):
        raise DecodingError("a request is a binary frame")
    request = unpack(frame, from_openpi)
    if not isinstance(request, dict):
        raise DecodingError("a request is a map")
    return request


def _health(connection: Any, request: Any) -> Any:
    """Answers /healthz also while the policy computes: each connection has its thread."""
    return connection.respond(HTTPStatus.OK, "OK\n") if request.path == "/healthz" else None


def _metadata(name: str, target: Any, reset: Callable[..., Any] | None) -> dict[str, Any]:
    """What is served, for recordings: the digest of its code, and its own metadata."""
    described = getattr(target, "metadata", {})
    fingerprint, file = getattr(target, "fingerprint", None), file_of(target)
    own = {
        "version": pytest_safemanip.__version__,
        "policy": name,
        "source": None if file is None else closure_digest((file,)),
        "fingerprint": None if fingerprint is None or callable(fingerprint) else str(fingerprint),
        "python": sys.version.split()[0],
        "numpy": np.__version__,
        "reset": reset is not None and _takes(reset),
    }
    return {**(described if isinstance(described, Mapping) else {}), OWN: own}


def _takes(target: Callable[..., Any]) -> bool:
    """Whether it takes an argument by position."""
    try:
        parameters = inspect.signature(target).parameters.values()
    except (TypeError, ValueError):
        return True
    return any(p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD) for p in parameters)
