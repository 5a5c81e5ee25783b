"""Servers with TLS, provoked with certificates that are wrong in each way.

``golden/tls`` was made with ``openssl req -x509`` and ``openssl ca``; its key protects nothing.
"""

from __future__ import annotations

import ssl
from pathlib import Path

import pytest

from pytest_safemanip.errors import PolicyUnreachable
from pytest_safemanip.policies.remote.endpoint import Endpoint
from pytest_safemanip.policies.remote.policy import RemotePolicy
from pytest_safemanip.policies.remote.presets import PRESETS
from tests.policies.remote import servers
from tests.policies.remote.conftest import EPISODE, PATIENT

GOLDEN = Path(__file__).parents[1] / "golden" / "tls"


def tls(certificate):
    """An openpi server behind TLS."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(GOLDEN / f"{certificate}.pem", GOLDEN / "key.pem")

    def converse(connection):
        with context.wrap_socket(connection, server_side=True) as wrapped:
            frames = servers.Frames(wrapped)
            frames.send(b"\x80")
            while True:
                frames.receive()
                frames.send(servers.openpi_actions())

    return servers.Raw(converse)


@pytest.fixture
def policy(tmp_path):
    made = []

    def make(scheme, port, host="127.0.0.1"):
        endpoint = Endpoint(scheme, host, port)
        made.append(RemotePolicy(PRESETS["pi05"], endpoint, tmp_path, PATIENT))
        return made[-1]

    yield make
    for one in made:
        one.close()


@pytest.mark.parametrize(
    ("certificate", "trusted"), [("self_signed", "self_signed"), ("signed", "ca")]
)
def test_a_certificate_that_is_trusted_is_no_obstacle(
    policy, observation, monkeypatch, certificate, trusted
):
    monkeypatch.setenv("SSL_CERT_FILE", str(GOLDEN / f"{trusted}.pem"))
    with tls(certificate) as server:
        one = policy("wss", server.port)
        one.reset(EPISODE)
        assert one.act(observation, 0).shape == (5, 12)
        one.close()


@pytest.mark.parametrize(
    ("certificate", "trusted", "says"),
    [
        ("self_signed", "ca", r"its certificate is self-signed \(.*\): SSL_CERT_FILE=FILE\.pem"),
        ("signed", "self_signed", r"an authority that this machine does not trust \(.*SSL_CERT_"),
        ("expired", "expired", r"its certificate has expired \(.*\): renew it on the server"),
        (
            "other_host",
            "other_host",
            r"is for another host than 127\.0\.0\.1 \(.*\): name the host",
        ),
    ],
)
def test_what_is_wrong_with_a_certificate_is_one_line_with_the_remedy(
    policy, monkeypatch, certificate, trusted, says
):
    monkeypatch.setenv("SSL_CERT_FILE", str(GOLDEN / f"{trusted}.pem"))
    with tls(certificate) as server, pytest.raises(PolicyUnreachable, match=says) as error:
        policy("wss", server.port).open()
    assert "stopping" not in str(error.value)
    assert len(str(error.value).splitlines()) == 1


def test_an_address_without_tls_at_a_server_with_it_is_told_apart(policy):
    with (
        tls("self_signed") as server,
        pytest.raises(PolicyUnreachable, match=r"a server with TLS listens.*wss://"),
    ):
        policy("ws", server.port).open()


def refusing(connection):
    """Answers at once what is no request, as websockets and nginx do."""
    connection.recv(65536)
    connection.sendall(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n")


@pytest.mark.parametrize("serve", [servers.openpi, lambda: servers.Raw(refusing)])
def test_an_address_with_tls_at_a_server_without_it_is_told_apart(policy, serve):
    with (
        serve() as server,
        pytest.raises(PolicyUnreachable, match="speaks no TLS: its address begins with ws://"),
    ):
        policy("wss", server.port).open()
