"""What servers and networks do wrong, provoked for real: each is one error, in bounded time."""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import socket
import struct
import threading
import time

import msgpack
import numpy as np
import pytest

from pytest_safemanip.errors import (
    ConfigError,
    PolicyAnswerError,
    PolicyConnectionLost,
    PolicyServerError,
    PolicyUnreachable,
    RolloutError,
)
from pytest_safemanip.policies.remote import library
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.policy import RemotePolicy
from pytest_safemanip.policies.remote.presets import PRESETS
from tests.policies.remote import servers
from tests.policies.remote.conftest import EPISODE, PATIENT, QUICK

POLICIES = {"openpi": "pi05", "groot": "groot", "vla-eval": "vla-eval"}


@contextlib.contextmanager
def within(seconds):
    began = time.monotonic()
    yield
    assert time.monotonic() - began < seconds


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listening:
        return listening.getsockname()[1]


def stop(server):
    """Stop a process, and wait until it has stopped."""
    server.send_signal(signal.SIGSTOP)
    os.waitpid(server.pid, os.WUNTRACED)


def failed(error, kind, *parts):
    """The message of a raised error, after a check of what every one of them must say."""
    assert type(error.value) is kind
    assert isinstance(error.value, PolicyServerError)
    assert isinstance(error.value, RolloutError)
    text = str(error.value)
    assert "policy server " in text
    assert "127.0.0.1" in text or "localhost" in text or ".invalid" in text
    for part in parts:
        assert part in text
    assert ("can be run again" in text) == (kind is PolicyConnectionLost)
    return text


@pytest.mark.parametrize(
    ("name", "command"),
    [
        (
            "pi05",
            "scripts/serve_policy.py policy:checkpoint --policy.config=pi05_pretrain_human300",
        ),
        ("groot-pt", "scripts/inference_service.py --server --model_path CHECKPOINTS/gr00t_n1-5/"),
        ("vla-eval", "vla-eval serve"),
        ("openpi", "safemanip serve MODULE:ATTRIBUTE"),
    ],
)
def test_a_server_that_was_not_started_is_named_with_the_command_that_starts_it(
    connect, name, command
):
    port = free_port()
    with within(3), pytest.raises(PolicyUnreachable) as error:
        connect(name, port).open()
    failed(error, PolicyUnreachable, f"127.0.0.1:{port}: nothing listens", command)


@pytest.mark.parametrize("name", ["pi05", "groot"])
def test_a_server_that_is_still_starting_is_waited_for(connect, name):
    port = free_port()
    late = []

    def start():
        time.sleep(0.4)
        if name == "groot":
            late.append(servers.Zmq(servers.groot(), port))
        else:
            late.append(servers.openpi(port=port))

    starting = threading.Thread(target=start)
    starting.start()
    deadlines = Deadlines(start=5.0, open=2.0, warm_up=2.0, call=1.0)
    with within(5):
        assert connect(name, port, deadlines).open()["protocol"]
    starting.join()
    late[0].__exit__()


@pytest.mark.parametrize("transport", POLICIES)
def test_a_server_that_is_killed_within_an_episode_is_noticed_at_once(
    connect, process, observation, transport
):
    server, port = process(transport)
    policy = connect(POLICIES[transport], port, Deadlines(0.3, 5.0, 60.0, 60.0, restart=0.3))
    policy.reset(EPISODE)
    policy.act(observation, 0)
    # Only a stopped server leaves a call open until it is killed.
    stop(server)
    threading.Timer(0.3, server.kill).start()
    with within(5), pytest.raises(PolicyConnectionLost) as error:
        policy.act(observation, 5)
    failed(error, PolicyConnectionLost, "died")
    server.wait(5)
    with within(5), pytest.raises(PolicyUnreachable, match="nothing listens"):
        policy.reset(EPISODE)


@pytest.mark.parametrize("transport", POLICIES)
def test_a_server_that_hangs_is_given_up_after_the_deadline_of_a_call(
    connect, process, observation, transport
):
    server, port = process(transport)
    policy = connect(POLICIES[transport], port, Deadlines(0.3, 0.6, 10.0, 0.3, restart=0.3))
    policy.reset(EPISODE)
    policy.act(observation, 0)
    stop(server)
    with within(3), pytest.raises(PolicyConnectionLost) as error:
        policy.act(observation, 5)
    failed(error, PolicyConnectionLost, "did not answer within 0.3 s: it hangs, or other clients")
    with (
        within(5),
        pytest.raises(PolicyUnreachable, match=r"it is busy|busy with another") as error,
    ):
        policy.reset(EPISODE)
    failed(error, PolicyUnreachable, "hangs")


@pytest.mark.parametrize("transport", POLICIES)
def test_after_a_server_was_started_again_the_next_episode_works(
    connect, process, observation, transport
):
    server, port = process(transport)
    policy = connect(POLICIES[transport], port)
    policy.reset(EPISODE)
    policy.act(observation, 0)
    server.kill()
    server.wait()
    with pytest.raises(PolicyConnectionLost):
        policy.act(observation, 5)
    with contextlib.ExitStack() as stack:
        if transport == "groot":
            stack.enter_context(servers.Zmq(servers.groot(), port))
        else:
            again = {"openpi": servers.openpi, "vla-eval": servers.vlaeval}[transport]
            stack.enter_context(again(port=port))
        policy.reset(EPISODE)
        assert policy.act(observation, 0).shape[1] == 12


def test_the_first_call_of_a_connection_has_a_deadline_of_its_own(connect, observation):
    patient = Deadlines(start=0.3, open=5.0, warm_up=10.0, call=0.3)
    with servers.openpi(delays=(0.6, 0.0, 0.6)) as server:
        policy = connect("pi05", server.port, patient)
        policy.reset(EPISODE)
        policy.act(observation, 0)
        policy.act(observation, 5)
        with pytest.raises(PolicyConnectionLost, match=r"did not answer within 0\.3"):
            policy.act(observation, 10)
        policy.reset(EPISODE)
        policy.act(observation, 0)


def test_a_late_reply_is_not_taken_for_the_next_one(connect, observation):
    answers = [msgpack.packb({"endpoint": "late"})]

    def slow(actions=None):
        if answers:
            answers.pop()
            time.sleep(0.6)
            return msgpack.packb(servers.groot_actions(value=0.75))
        return msgpack.packb(servers.groot_actions(value=0.25))

    with servers.Zmq(servers.groot(slow)) as server:
        policy = connect("groot", server.port, Deadlines(0.3, 5.0, 0.3, 0.3, restart=0.3))
        policy.reset(EPISODE)
        with pytest.raises(PolicyConnectionLost):
            policy.act(observation, 0)
        policy._deadlines = PATIENT
        policy.reset(EPISODE)
        assert policy.act(observation, 0)[0, 0] == 0.25


def test_a_server_that_raises_is_shown_with_its_last_line_and_its_traceback(
    connect, observation, tmp_path
):
    trace = "Traceback (most recent call last):\n  File \"p.py\", line 3\nKeyError: 'right_image'\n"

    def fail(frames, request):
        frames.text(trace)
        frames.close(1011, "Internal server error")
        raise EOFError

    with servers.openpi(fail) as server:
        policy = connect("pi05", server.port)
        policy.reset(EPISODE)
        with within(2), pytest.raises(PolicyAnswerError) as error:
            policy.act(observation, 35)
    text = failed(
        error, PolicyAnswerError, "at step 35, asked to 'open the drawer': the server failed"
    )
    assert "KeyError: 'right_image'; request and reply: " in text.split("\n")[0]
    assert text.endswith(trace.strip())
    (kept,) = (tmp_path / "dumps").iterdir()
    assert str(kept) in text
    with np.load(kept) as arrays:
        assert arrays["reply"] == trace
        assert arrays["request/observation|image"].shape == (224, 224, 3)


@pytest.mark.parametrize(
    ("close", "parts"),
    [
        (lambda f: f.close(1011, "keepalive ping timeout"), ["its keepalive cut the connection"]),
        (lambda f: f.close(1001, "going away"), ["closed the connection (1001 going away)"]),
        (lambda f: f.close(1000), ["closed the connection (1000)"]),
        (lambda f: f.connection.sendall(b"\x82"), ["died: the connection ended without"]),
    ],
)
def test_a_connection_that_is_cut_says_how(connect, observation, close, parts):
    def cut(frames, request):
        close(frames)
        raise EOFError

    with servers.openpi(cut) as server:
        policy = connect("pi05", server.port)
        policy.reset(EPISODE)
        with within(3), pytest.raises(PolicyConnectionLost) as error:
            policy.act(observation, 0)
    failed(error, PolicyConnectionLost, "(at step 0, asked to 'open the drawer')", *parts)


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"\x83\x00", "(1002"),
        (servers.header(2**40), "(1009"),
        (servers.header(2**22 + 1), "(1009"),
        (servers.header(2, 1) + b"\xff\xff", "(1007"),
    ],
    ids=["no frame", "1 TB", "a byte too many", "no UTF-8"],
)
def test_what_is_no_frame_or_too_long_is_a_wrong_answer(connect, observation, data, code):
    def answer(frames, request):
        frames.connection.sendall(data)
        server.over.wait(10)
        raise EOFError

    with servers.openpi(answer) as server:
        policy = connect("pi05", server.port, Deadlines(0.3, 5.0, 0.3, 0.3, restart=0.3))
        policy.reset(EPISODE)
        with within(4), pytest.raises(PolicyAnswerError) as error:
            policy.act(observation, 15)
    failed(error, PolicyAnswerError, f"over 4194304 bytes {code}", "(at step 15, asked to 'open")


@pytest.mark.parametrize("name", ["pi05", "vla-eval"])
def test_a_websocket_policy_says_so_when_zeromq_listens(connect, name):
    with (
        servers.Zmq(servers.groot()) as server,
        within(4),
        pytest.raises(PolicyUnreachable) as error,
    ):
        connect(name, server.port, QUICK).open()
    failed(error, PolicyUnreachable, "a ZeroMQ server listens, as GR00T's")


def test_a_zeromq_policy_says_so_when_a_websocket_listens(connect):
    with servers.openpi() as server, within(4), pytest.raises(PolicyUnreachable) as error:
        connect("groot", server.port).open()
    failed(error, PolicyUnreachable, "an HTTP or WebSocket server listens", "openpi, pi0 and pi05")


def test_openpi_and_vla_eval_are_told_apart(connect):
    with servers.vlaeval() as server, within(4), pytest.raises(PolicyUnreachable) as error:
        connect("pi05", server.port, QUICK).open()
    failed(error, PolicyUnreachable, "sends no metadata within 0.3 s", "their name is vla-eval")
    with servers.openpi() as server, within(4), pytest.raises(PolicyUnreachable) as error:
        connect("vla-eval", server.port).open()
    failed(error, PolicyUnreachable, "does not speak vla-eval's protocol")


@pytest.mark.parametrize("name", POLICIES.values())
@pytest.mark.parametrize(
    ("greeting", "what"),
    [
        (b"", "accepts connections and says nothing|no handshake within"),
        (b"SSH-2.0-OpenSSH_9.6\r\n", "neither a WebSocket nor a ZeroMQ server"),
        (None, "closes them at once|no WebSocket handshake was made"),
        (b"\x00\x00\x12\x04\x00\x00\x00\x00\x00", "neither a WebSocket nor a ZeroMQ server"),
    ],
)
def test_a_port_of_something_else_is_recognised(connect, name, greeting, what):
    def converse(connection):
        if greeting is not None:
            connection.sendall(greeting)
            server.over.wait(0.2 if greeting else 10)

    with servers.Raw(converse) as server, within(5), pytest.raises(PolicyUnreachable, match=what):
        connect(name, server.port, QUICK).open()


def test_a_web_server_is_no_policy_server(connect):
    def refuse(connection):
        connection.recv(4096)
        connection.sendall(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n")

    with servers.Raw(refuse) as server, pytest.raises(PolicyUnreachable, match="answers HTTP 404"):
        connect("pi05", server.port).open()


@pytest.mark.parametrize("name", ["pi05", "groot"])
def test_a_host_that_does_not_exist_is_named(tmp_path, name):
    preset = PRESETS[name]
    endpoint = Endpoint("tcp" if name == "groot" else "ws", "robot.invalid", 8000)
    policy = RemotePolicy(preset, endpoint, tmp_path, QUICK)
    with within(20), pytest.raises(PolicyUnreachable, match=r"robot\.invalid.*no (known )?host"):
        policy.open()


def test_a_server_that_is_busy_with_another_client_is_named(connect):
    with (
        servers.Raw(lambda connection: server.over.wait(10)) as server,
        within(4),
        pytest.raises(PolicyUnreachable) as error,
    ):
        connect("pi05", server.port, QUICK).open()
    failed(error, PolicyUnreachable, "no handshake within 0.3 s", "busy with another client's call")


def test_a_groot_server_that_is_busy_is_named(connect):
    with (
        servers.Zmq(lambda request: None) as server,
        within(5),
        pytest.raises(PolicyUnreachable) as error,
    ):
        connect("groot", server.port, QUICK).open()
    failed(error, PolicyUnreachable, "does not answer a ping within 0.3 s")


def test_proxies_are_not_asked_for_this_machine(connect, observation, monkeypatch):
    for name in ("HTTP_PROXY", "http_proxy", "HTTPS_PROXY", "ALL_PROXY", "all_proxy"):
        monkeypatch.setenv(name, f"http://127.0.0.1:{free_port()}")
    monkeypatch.delenv("NO_PROXY", raising=False)
    monkeypatch.delenv("no_proxy", raising=False)
    with servers.openpi() as server:
        policy = connect("pi05", server.port)
        policy.reset(EPISODE)
        assert policy.act(observation, 0).shape == (5, 12)


def test_a_proxy_that_fails_for_another_machine_is_named(tmp_path, monkeypatch):
    for name in list(os.environ):
        if name.lower() in ("no_proxy", "http_proxy", "all_proxy", "https_proxy", "socks_proxy"):
            monkeypatch.delenv(name)
    monkeypatch.setenv("http_proxy", f"http://user:secret@127.0.0.1:{free_port()}")
    policy = RemotePolicy(PRESETS["pi05"], Endpoint("ws", "robot.invalid", 8000), tmp_path, QUICK)
    with within(4), pytest.raises(PolicyUnreachable) as error:
        policy.open()
    text = failed(error, PolicyUnreachable, "the proxy of http_proxy", "NO_PROXY")
    assert "secret" not in text
    monkeypatch.setenv("http_proxy", "ftp://user:secret@proxy")
    with within(4), pytest.raises(PolicyUnreachable) as error:
        policy.open()
    assert "secret" not in failed(error, PolicyUnreachable, "the proxy of http_proxy")


def chunk(row=None, column=0, value=0.25, rows=50, columns=12):
    values = np.full((rows, columns), 0.25, np.float32)
    if row is not None:
        values[row, column] = value
    data = {b"__ndarray__": True, b"data": values.tobytes(), b"dtype": "<f4"}
    return msgpack.packb({"actions": {**data, b"shape": list(values.shape)}})


@pytest.mark.parametrize(
    ("reply", "what"),
    [
        (chunk(3, 7, np.nan), "actions[3, 7] (base_motion) is nan: the action of step 3 of the 5"),
        (chunk(0, 11, -np.inf), "actions[0, 11] (control_mode) is -inf"),
        (chunk(rows=4), "4 actions, but 5 are executed"),
        (chunk(rows=0), "0 actions, but 5 are executed"),
        (chunk(columns=7), "'actions' has shape (50, 7), expected (H, 12): is another robot's"),
        (msgpack.packb({}), "the reply has no 'actions'; it has nothing"),
        (msgpack.packb({"action": [0.0] * 12}), "the reply has no 'actions'; it has 'action'"),
        (msgpack.packb({"actions": "up"}), "'actions' is not an array of numbers"),
        (msgpack.packb({"actions": [[1.0], [1.0, 2.0]]}), "'actions' is not an array of numbers"),
        (msgpack.packb([1]), "the reply is not openpi's: list instead of a map"),
        (b"\xc1", "the reply is not openpi's: not msgpack"),
        (b"", "the reply is not openpi's: not msgpack"),
    ],
)
def test_an_answer_that_cannot_be_executed_is_named_and_kept(
    connect, observation, tmp_path, reply, what
):
    with servers.openpi(reply) as server:
        policy = connect("pi05", server.port)
        policy.reset(EPISODE)
        with pytest.raises(PolicyAnswerError) as error:
            policy.act(observation, 20)
    text = failed(error, PolicyAnswerError, "at step 20, asked to 'open the drawer'", what)
    (kept,) = (tmp_path / "dumps").iterdir()
    assert f"request and reply: {kept}" in text
    with np.load(kept) as arrays:
        assert arrays["request/prompt"] == "open the drawer"
        assert any(name.startswith("reply") for name in arrays) or reply == msgpack.packb({})


def test_after_a_wrong_answer_the_next_episode_has_a_new_connection(connect, observation):
    """What else the server has sent on the old one is not taken for an answer."""

    def twice(frames, request):
        frames.send(chunk(columns=7))
        frames.send(chunk(0, 0, 0.75))

    with servers.openpi(twice) as server:
        policy = connect("pi05", server.port)
        for _ in range(2):
            policy.reset(EPISODE)
            with pytest.raises(PolicyAnswerError, match="another robot's model"):
                policy.act(observation, 0)
        assert len(server.connections) == 2


def test_nan_beyond_the_executed_steps_does_not_matter(connect, observation):
    with servers.openpi(chunk(5, 0, np.nan)) as server:
        policy = connect("pi05", server.port)
        policy.reset(EPISODE)
        assert np.isfinite(policy.act(observation, 0)).all()


def test_what_is_out_of_range_is_clipped_and_counted(connect, observation):
    with servers.openpi(chunk(2, 4, -1.7)) as server:
        policy = connect("pi05", server.port)
        policy.reset(EPISODE)
        first, second = policy.act(observation, 0), policy.act(observation, 5)
        assert first[2, 4] == second[2, 4] == -1.0
        assert (policy.counts.actions, policy.counts.clipped) == (10, 2)
        policy.reset(EPISODE)
        assert policy.counts.clipped == 0


def test_a_folder_that_cannot_be_written_does_not_hide_what_was_wrong(tmp_path, observation):
    (tmp_path / "file").write_text("")
    with servers.openpi(chunk(columns=7)) as server:
        endpoint = Endpoint("ws", "127.0.0.1", server.port)
        policy = RemotePolicy(PRESETS["pi05"], endpoint, tmp_path / "file" / "dumps", QUICK)
        policy.reset(EPISODE)
        with pytest.raises(PolicyAnswerError, match=r"\(50, 7\).*could not be kept"):
            policy.act(observation, 0)
        policy.close()


def test_a_server_that_takes_no_data_is_given_up(connect, observation):
    """A request that does not fit into the buffers of a connection that nobody reads."""

    def deaf(frames):
        frames.connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        frames.send(b"\x80")
        server.over.wait(10)

    server = servers.websocket(deaf)
    server.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    with server:
        policy = connect("pi05", server.port, Deadlines(0.3, 10.0, 0.3, 0.3, restart=0.3))
        policy.reset(EPISODE)
        own = policy._client._socket._connection.socket
        own.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        with within(3), pytest.raises(PolicyConnectionLost) as error:
            policy.act(observation, 0)
    failed(error, PolicyConnectionLost, "took no data for 0.3 s")


def drip(frames):
    """Announces a frame of allowed length, and sends it a byte at a time."""
    frames.connection.sendall(servers.header(2**20))
    while not frames.server_is_over():
        frames.connection.sendall(b"\0")
        time.sleep(0.01)


def fragments(frames):
    """Sends parts of one message, for ever."""
    frames.connection.sendall(b"\x02\x7f" + struct.pack(">Q", 2**18) + b"\0" * 2**18)
    while not frames.server_is_over():
        frames.connection.sendall(b"\x00\x7f" + struct.pack(">Q", 2**18) + b"\0" * 2**18)


def pings(frames):
    """Sends control frames, for ever, and never an answer."""
    while not frames.server_is_over():
        frames.send(b"", 9)
        time.sleep(0.001)


@pytest.mark.parametrize("never_ending", [drip, fragments, pings])
def test_a_message_without_an_end_is_given_up(connect, observation, never_ending):
    def answer(frames, request):
        frames.server_is_over = server.over.is_set
        never_ending(frames)
        raise EOFError

    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with servers.openpi(answer) as server:
        policy = connect("pi05", server.port, Deadlines(0.3, 5.0, 0.5, 0.5, restart=0.3))
        policy.reset(EPISODE)
        with within(4), pytest.raises((PolicyConnectionLost, PolicyAnswerError)):
            policy.act(observation, 0)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory < 60_000  # KiB


def test_a_first_frame_without_an_end_is_given_up(connect):
    def converse(frames):
        frames.server_is_over = server.over.is_set
        drip(frames)

    with servers.websocket(converse) as server, within(4), pytest.raises(PolicyUnreachable):
        connect("pi05", server.port, QUICK).open()


def test_a_library_that_is_missing_is_named_with_the_extra(connect, monkeypatch):
    def missing(name):
        raise ModuleNotFoundError(f"No module named {name!r}")

    monkeypatch.setattr(library.importlib, "import_module", missing)
    for name, module in (("pi05", "websockets"), ("groot", "zmq")):
        with pytest.raises(ConfigError, match=rf"{module}.*pip install '\.\[servers\]'"):
            connect(name, 8000).open()
