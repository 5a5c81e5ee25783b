"""Tokens: from the environment to the server, and to nowhere else."""

from __future__ import annotations

import msgpack
import pytest

from pytest_safemanip.errors import (
    ConfigError,
    PolicyAnswerError,
    PolicyServerError,
    PolicyUnreachable,
)
from pytest_safemanip.policies.remote.tokens import Token, check_variables
from tests.policies.remote import servers
from tests.policies.remote.conftest import EPISODE, PATIENT

SECRET = "-".join(["not", "to", "be", "seen"])


def nowhere(folder, error):
    """Neither in what is said, nor in a file."""
    chain = [error]
    while chain[-1].__cause__ is not None:
        chain.append(chain[-1].__cause__)
    assert SECRET not in "".join(map(str, chain))
    for path in folder.rglob("*"):
        assert not path.is_file() or SECRET.encode() not in path.read_bytes()


def test_a_token_is_named_after_its_policy():
    environment = {"SAFEMANIP_TOKEN_GROOT_TO": f" {SECRET}\n"}
    assert Token.of("groot-to", environment).text == SECRET
    assert not Token.of("groot", environment)


@pytest.mark.parametrize("text", ["two words", "line\nbreak", "naïve"])
def test_a_token_that_cannot_be_sent_is_refused_without_being_shown(text):
    with pytest.raises(ConfigError, match="SAFEMANIP_TOKEN_PI05") as error:
        Token.of("pi05", {"SAFEMANIP_TOKEN_PI05": text})
    assert text not in str(error.value)


def test_a_token_of_no_policy_is_refused_rather_than_not_sent():
    check_variables(["pi05", "groot-to"], {"SAFEMANIP_TOKEN_GROOT_TO": SECRET, "HOME": "/root"})
    with pytest.raises(ConfigError, match="did you mean 'SAFEMANIP_TOKEN_PI05'") as error:
        check_variables(["pi05", "groot-to"], {"SAFEMANIP_TOKEN_PI5": SECRET})
    assert SECRET not in str(error.value)


def test_a_token_does_not_print():
    assert SECRET not in f"{Token(SECRET)!r} {Token(SECRET)}"


def test_a_server_that_echoes_the_token_does_not_get_it_printed_or_kept(
    connect, observation, tmp_path
):
    def echoes(frames, request):
        frames.send(msgpack.packb({SECRET: SECRET.encode(), "actions": [SECRET]}))

    with servers.openpi(echoes) as server:
        policy = connect("pi05", server.port, token=SECRET)
        policy.reset(EPISODE)
        with pytest.raises(PolicyAnswerError) as error:
            policy.act(observation, 0)
    nowhere(tmp_path, error.value)
    (kept,) = (tmp_path / "dumps").glob("*.npz")
    assert b"(token)" in kept.read_bytes()


def test_a_traceback_with_the_token_in_it_does_not_show_it(connect, observation, tmp_path):
    def fails(frames, request):
        frames.text(f"Traceback\n  headers = {SECRET}\nPermissionError: {SECRET}")

    with servers.openpi(fails) as server:
        policy = connect("pi05", server.port, token=SECRET)
        policy.reset(EPISODE)
        with pytest.raises(PolicyAnswerError, match=r"PermissionError: \(token\)") as error:
            policy.act(observation, 0)
    nowhere(tmp_path, error.value)


def test_groots_refusal_does_not_show_it(connect, tmp_path):
    refused = msgpack.packb({"error": f"Unauthorized: {SECRET}"})
    with servers.Zmq(lambda _: refused) as server, pytest.raises(PolicyUnreachable) as error:
        connect("groot", server.port, token=SECRET).open()
    assert "Unauthorized: (token)" in str(error.value)
    nowhere(tmp_path, error.value)


@pytest.mark.parametrize("length", [186, 188, 190, 195, 197])
@pytest.mark.parametrize("name", ["pi05", "vla-eval"])
def test_a_greeting_that_is_cut_within_the_token_shows_no_part_of_it(
    connect, tmp_path, name, length
):
    def echoes(frames):
        if name == "vla-eval":
            frames.receive()
        frames.text("x" * length + SECRET + " and more")

    with servers.websocket(echoes) as server, pytest.raises(PolicyUnreachable) as error:
        connect(name, server.port, token=SECRET).open()
    assert f"x{SECRET[:3]}" not in str(error.value)
    nowhere(tmp_path, error.value)


@pytest.mark.parametrize("length", [1990, 1997])
def test_a_refusal_that_is_cut_within_the_token_shows_no_part_of_it(connect, tmp_path, length):
    refused = msgpack.packb({"error": "x" * length + SECRET + "y" * 30})
    with servers.Zmq(lambda _: refused) as server, pytest.raises(PolicyUnreachable) as error:
        connect("groot", server.port, token=SECRET).open()
    assert f"x{SECRET[:3]}" not in str(error.value)
    nowhere(tmp_path, error.value)


@pytest.mark.parametrize(("token", "says"), [("", "wants a token"), (SECRET, "refuses the token")])
def test_a_server_that_wants_a_token_is_named_with_where_it_is_put(connect, token, says):
    def converse(connection):
        connection.recv(65536)
        connection.sendall(b"HTTP/1.1 401 Unauthorized\r\nContent-Length: 0\r\n\r\n")

    with (
        servers.Raw(converse) as server,
        pytest.raises(PolicyUnreachable, match=f"{says}.*SAFEMANIP_TOKEN_"),
    ):
        connect("pi05", server.port, PATIENT, token=token).open()


STRANGE = "red \x1b[31m back \x08 bell \x07 left \u202e C1 \x9b2J"
PLAIN = r"red \x1b[31m back \x08 bell \x07 left \u202e C1 \x9b2J"


@pytest.mark.parametrize("token", ["", SECRET])
def test_what_a_server_says_moves_no_cursor(connect, observation, token):
    said = [
        lambda frames, request: frames.text(f"Traceback\n  1\nError: {STRANGE}"),
        lambda frames, request: frames.close(1008, STRANGE),
        lambda frames, request: frames.send(msgpack.packb({STRANGE: 1})),
    ]
    for reply in said:
        with servers.openpi(reply) as server:
            policy = connect("pi05", server.port, token=token)
            policy.reset(EPISODE)
            with pytest.raises(PolicyServerError) as error:
                policy.act(observation, 0)
        chain = [error.value]
        while chain[-1].__cause__ is not None:
            chain.append(chain[-1].__cause__)
        texts = [str(link) for link in chain]
        assert r"red \x1b[31m" in texts[0].replace(r"\\x", r"\x")
        letters = "".join(texts).replace("\n", "")
        assert letters.isprintable()


def test_a_first_frame_that_moves_the_cursor_is_told_in_plain_text(connect):
    with (
        servers.websocket(lambda frames: frames.text(STRANGE)) as server,
        pytest.raises(PolicyUnreachable) as error,
    ):
        connect("pi05", server.port).open()
    assert PLAIN in str(error.value)


def test_what_a_server_says_of_itself_is_plain_text_without_its_token(connect):
    long = "x" * 1000
    metadata = {"checkpoint": STRANGE, "a": [SECRET], STRANGE: long, "b": f"{long}y", "n": 3}
    with servers.openpi(metadata=msgpack.packb(metadata)) as server:
        policy = connect("pi05", server.port, token=SECRET)
        policy.open()
    found = policy.metadata
    assert (found["checkpoint"], found["a"], found["n"]) == (PLAIN, ["(token)"], 3)
    assert len(found[PLAIN]) < 600
    assert found[PLAIN] != found["b"]  # told apart, though both are cut
