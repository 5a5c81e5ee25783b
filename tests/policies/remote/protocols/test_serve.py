"""The package's own server: a policy of one's own behind openpi's protocol."""

from __future__ import annotations

import contextlib
import http.client
import signal
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, PolicyAnswerError
from pytest_safemanip.policies import serve
from pytest_safemanip.policies.remote.client import Beginning
from tests.policies.remote.conftest import EPISODE

MODULE = """
    import random
    import time

    import numpy as np

    class Seeded:
        fingerprint = "weights 1"
        metadata = {"config": "toy"}

        def reset(self, seed):
            self.random = random.Random(seed)

        def infer(self, request):
            if request["prompt"] == "fail":
                raise RuntimeError("no such word")
            if request["prompt"] == "wait":
                time.sleep(60)
            return {"actions": np.full((50, 12), self.random.random()), "note": np.float32(2)}

    class Bare:
        resets = 0

        def reset(self):
            self.resets += 1

        def act(self, request):
            return np.full(12, 0.1 * self.resets)

    class Careful:
        inside = 0

        def infer(self, request):
            self.inside += 1
            time.sleep(0.1)
            assert self.inside == 1, "two calls at a time"
            self.inside -= 1
            return np.zeros((5, 12))

    def function(request):
        return [[0.5] * 12] * 8

    def factory():
        return Bare()

    wrong = 3
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "served.py").write_text(textwrap.dedent(MODULE))
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    sys.modules.pop("served", None)


@pytest.fixture
def serving(folder):
    """Serves a policy from a thread of this process; gives the port."""
    with contextlib.ExitStack() as stack:

        def start(name):
            served = serve.load(name)
            server = serve.make_server(served, "127.0.0.1", 0)
            thread = threading.Thread(target=server.serve_forever)
            thread.start()

            def stop():
                for client in list(served.clients):
                    client.close()
                server.shutdown()
                thread.join(5)

            stack.callback(stop)
            return server.socket.getsockname()[1]

        yield start


def test_a_seed_decides_what_a_served_policy_does(connect, serving, observation):
    policy = connect("openpi", serving("served:Seeded"))

    def first_action(seed):
        policy.reset(Beginning("OpenDrawer", seed, "open it"))
        assert policy.seeded
        return policy.act(observation, 0)[0, 0]

    assert first_action(3) == first_action(3) != first_action(4)


def test_what_is_served_is_said_in_the_metadata(connect, serving):
    found = connect("openpi", serving("served:Seeded")).open()["metadata"]
    own = found["safemanip"]
    assert found["config"] == "toy"
    assert (own["policy"], own["fingerprint"], own["reset"]) == ("served:Seeded", "weights 1", True)
    assert len(own["source"]) == 64


@pytest.mark.parametrize(
    ("name", "value", "rows", "seeded"),
    [
        ("served:Bare", 0.0, 1, False),
        ("served:factory", 0.0, 1, False),
        ("served:function", 0.5, 5, False),
    ],
)
def test_objects_factories_and_functions_are_served(
    connect, serving, observation, name, value, rows, seeded
):
    policy = connect("openpi", serving(name), steps=rows)
    policy.reset(EPISODE)
    actions = policy.act(observation, 0)
    assert (actions[0, 0], len(actions), policy.seeded) == (pytest.approx(value), rows, seeded)


def test_a_policy_that_raises_is_shown_as_by_openpis_server(connect, serving, observation):
    policy = connect("openpi", serving("served:Seeded"))
    policy.reset(EPISODE)
    with pytest.raises(PolicyAnswerError) as error:
        policy.act({**observation, "annotation.human.task_description": "fail"}, 0)
    first, *trace = str(error.value).split("\n")
    assert "the server failed: RuntimeError: no such word" in first
    assert any("in infer" in line for line in trace)
    policy.reset(EPISODE)
    assert policy.act(observation, 0).shape == (5, 12)


def test_two_clients_are_answered_one_after_the_other(connect, serving, observation):
    port = serving("served:Careful")
    policies = [connect("openpi", port) for _ in range(2)]
    for policy in policies:
        policy.reset(EPISODE)
    threads = [threading.Thread(target=p.act, args=(observation, 0)) for p in policies]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(10)
    assert [policy.counts.actions for policy in policies] == [5, 5]


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("served", "expected MODULE:ATTRIBUTE"),
        ("served:Nobody", "cannot be imported (AttributeError"),
        ("no_such_module:Policy", "cannot be imported (ModuleNotFoundError"),
        ("served:wrong", "has no 'infer(request)' and cannot be called"),
    ],
)
def test_what_is_no_policy_is_refused(folder, name, what):
    with pytest.raises(ConfigError) as error:
        serve.load(name)
    assert what in str(error.value)


def start(folder, *arguments):
    return subprocess.Popen(
        [sys.executable, "-m", "pytest_safemanip", "serve", *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def get(port, path):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
    try:
        connection.request("GET", path)
        response = connection.getresponse()
        return response.status, response.read().decode()
    finally:
        connection.close()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_command_serves_until_it_is_interrupted(connect, folder, observation, number):
    with start(folder, "served:Seeded", "--port", "0") as process:
        try:
            line = process.stdout.readline()
            assert line.startswith("serving served:Seeded at ws://127.0.0.1:")
            port = int(line.rpartition(":")[2])
            assert get(port, "/healthz") == (200, "OK\n")
            policy = connect("openpi", port)
            policy.reset(EPISODE)
            assert np.ptp(policy.act(observation, 0)[:, 0]) == 0
            process.send_signal(number)  # with a client connected
            assert process.wait(30) == 0
            assert process.stderr.read() == ""
        finally:
            process.kill()


def test_health_is_answered_and_a_second_signal_ends_it_while_the_policy_computes(
    connect, folder, observation
):
    with start(folder, "served:Seeded", "--port", "0") as process:
        try:
            port = int(process.stdout.readline().rpartition(":")[2])
            policy = connect("openpi", port)
            policy.reset(EPISODE)
            waiting = {**observation, "annotation.human.task_description": "wait"}
            call = threading.Thread(target=_fails, args=(policy, waiting))
            call.start()
            time.sleep(0.3)
            assert get(port, "/healthz") == (200, "OK\n")
            process.send_signal(signal.SIGINT)
            _wait_until_refused(port)  # two signals at once are one to a busy process
            assert process.poll() is None
            process.send_signal(signal.SIGINT)
            assert process.wait(30) == -signal.SIGINT
            call.join(30)
        finally:
            process.kill()


def _wait_until_refused(port):
    deadline = time.monotonic() + 30
    with contextlib.suppress(ConnectionError):
        while time.monotonic() < deadline:
            get(port, "/healthz")
            time.sleep(0.05)
        raise AssertionError("it still serves")


def _fails(policy, observation):
    with contextlib.suppress(Exception):
        policy.act(observation, 0)


def test_a_port_that_is_taken_is_named(folder, serving):
    port = serving("served:Bare")
    with start(folder, "served:Bare", "--port", str(port)) as process:
        _, said = process.communicate(timeout=10)
    assert process.returncode == 4
    assert said.startswith(f"safemanip serve: error: cannot listen at 127.0.0.1:{port} (")
    assert said.count("\n") == 1
