"""Addresses and deadlines of policy servers."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from urllib.parse import urlsplit

from pytest_safemanip.errors import ConfigError

TLS_PORT = 443


@dataclass(frozen=True)
class Deadlines:
    """Deadlines of a server, in seconds.

    Attributes:
        start: until something listens at the endpoint; a server that is being started gets this.
        open: until it has answered the handshake.
        warm_up: for the first call of a connection: models are compiled on it.
        call: for every other call.
        restart: until a server that was lost can be asked again: a restart loads its model.
    """

    start: float = 10.0
    open: float = 10.0
    warm_up: float = 600.0
    call: float = 30.0
    restart: float = 120.0

    def __post_init__(self) -> None:
        for name, seconds in vars(self).items():
            if not 0.0 <= seconds < float("inf") or (
                seconds == 0.0 and name not in ("start", "restart")
            ):
                raise ConfigError(f"deadline {name!r}: {seconds} s; expected seconds above 0")


@dataclass(frozen=True)
class Endpoint:
    """The address of a server.

    Attributes:
        scheme: ``ws``, ``wss`` or ``tcp``.
        host: name or address, without brackets.
        port: TCP port.
        path: of the URL; empty, or begins with ``/``.
    """

    scheme: str
    host: str
    port: int
    path: str = ""

    @property
    def loopback(self) -> bool:
        """Whether it is on this machine, by its address or by the name ``localhost``."""
        if self.host == "localhost":
            return True
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return False

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}{self.path}"


def parse_endpoint(text: str, schemes: tuple[str, ...], port: int) -> Endpoint:
    """Read an address.

    Args:
        text: ``ws://host:8000``, ``host:8000`` or ``host``.
        schemes: those that the transport knows; the first is the one that may be left out.
        port: where none is given; an address with ``wss://`` has 443 then.

    Raises:
        ConfigError: if it is no address, or one of another transport.
    """
    example = f"{schemes[0]}://127.0.0.1:{port}"
    try:
        parts = urlsplit(text if "://" in text else f"{schemes[0]}://{text}")
        given, host = parts.port, parts.hostname
    except ValueError as error:
        raise ConfigError(f"policy server {text!r}: {error}; expected e.g. {example}") from error
    if parts.scheme not in schemes:
        raise ConfigError(
            f"policy server {text!r}: this policy is reached over {' or '.join(schemes)}, "
            f"not {parts.scheme}; expected e.g. {example}"
        )
    if not host or parts.username is not None or parts.query or parts.fragment:
        raise ConfigError(f"policy server {text!r}: not an address; expected e.g. {example}")
    path = parts.path.rstrip("/")
    if path and parts.scheme == "tcp":
        raise ConfigError(f"policy server {text!r}: tcp has no path; expected e.g. {example}")
    usual = TLS_PORT if parts.scheme == "wss" else port
    return Endpoint(parts.scheme, host, given if given is not None else usual, path)
