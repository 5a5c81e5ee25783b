"""Against the code that others publish: vla-eval's server, and openpi's client and encoding."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from websockets.sync.server import serve

from pytest_safemanip.errors import PolicyConnectionLost
from pytest_safemanip.policies.remote.observation import CAMERAS, INSTRUCTION
from pytest_safemanip.policies.remote.openpi import request_of
from pytest_safemanip.policies.remote.presets import PRESETS
from tests.policies.remote.conftest import EPISODE

SERVER = Path(__file__).with_name("published_server.py")


@pytest.fixture
def vla_eval():
    """Starts vla-eval's server; gives its port."""
    pytest.importorskip("vla_eval")
    with contextlib.ExitStack() as stack:

        def start(batch):
            command = [sys.executable, str(SERVER), str(batch)]
            pipe = subprocess.PIPE
            running = stack.enter_context(subprocess.Popen(command, stdin=pipe, stdout=pipe))
            stack.callback(running.kill)
            return int(running.stdout.readline())

        yield start


def test_vla_evals_server_is_asked_and_answers(vla_eval, connect, observation):
    policy = connect("vla-eval", vla_eval(1))
    assert policy.open()["protocol"].startswith("vla-eval")
    policy.reset(EPISODE)
    (action,) = policy.act(observation, 0)
    assert action[0] == pytest.approx(np.mean(observation[CAMERAS[0]]) / 255, abs=1e-3)
    assert action[2] == pytest.approx(len(observation[INSTRUCTION]) / 100)


def test_vla_evals_server_batches_what_is_asked_side_by_side(vla_eval, connect, observation):
    port, found = vla_eval(4), []
    policies = [connect("vla-eval", port) for _ in range(4)]
    for policy in policies:
        policy.reset(EPISODE)
    threads = [
        threading.Thread(target=lambda p=policy: found.append(p.act(observation, 0)[0, 1]))
        for policy in policies
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 4
    assert max(found) > 0.15  # more than one of them in a pass of the model


def test_what_openpis_own_code_unpacks_is_what_was_sent(connect, observation):
    codec = pytest.importorskip("openpi_client.msgpack_numpy")
    chunk = np.linspace(-1, 1, 5 * 12, dtype=np.float32).reshape(5, 12)
    received = []

    def answer(connection):
        packer = codec.Packer()
        connection.send(packer.pack({"checkpoint": "mine"}))
        for message in connection:
            received.append(codec.unpackb(message))
            connection.send(packer.pack({"actions": chunk}))

    with serve(answer, "127.0.0.1", 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        policy = connect("openpi", server.socket.getsockname()[1])
        policy.open()
        policy.reset(EPISODE)
        actions = policy.act(observation, 0)
        server.shutdown()
    binary = [6, 11]  # the gripper and the mode of the base
    given = np.delete(chunk[: len(actions)], binary, axis=1)
    np.testing.assert_allclose(np.delete(actions, binary, axis=1), given)
    expected = request_of(observation, PRESETS["openpi"].naming)
    assert received[-1].keys() == expected.keys()
    for key, value in expected.items():
        np.testing.assert_array_equal(received[-1][key], value)


@pytest.mark.parametrize("shape", [(256, 256), (180, 320), (480, 300)])
def test_pictures_are_resized_as_openpis_own_code_does(observation, shape):
    tools = pytest.importorskip("openpi_client.image_tools")
    naming = PRESETS["pi05"].naming
    random = np.random.default_rng(1)
    seen = {**observation, **{c: random.integers(0, 256, (*shape, 3), np.uint8) for c in CAMERAS}}
    request = request_of(seen, naming)
    for key, camera in naming.pictures.items():
        wanted = tools.resize_with_pad(seen[camera], naming.image_size, naming.image_size)
        np.testing.assert_array_equal(request[key], wanted)


MODEL = """
import numpy as np

class Counts:
    fingerprint = "1"

    def infer(self, request):
        return {"actions": np.full((3, 12), len(request["prompt"]) / 100)}
"""


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # their client's
def test_openpis_own_client_talks_to_what_we_serve(tmp_path):
    client = pytest.importorskip("openpi_client.websocket_client_policy")
    (tmp_path / "model.py").write_text(MODEL)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
    command = [sys.executable, "-m", "pytest_safemanip", "serve", "model:Counts", "--port"]
    with subprocess.Popen([*command, str(port)], cwd=tmp_path, stdout=subprocess.PIPE) as server:
        try:
            server.stdout.readline()
            policy = client.WebsocketClientPolicy("127.0.0.1", port)
            assert policy.infer({"prompt": "open"})["actions"].tolist() == [[0.04] * 12] * 3
        finally:
            server.kill()


def test_a_server_that_is_stopped_between_two_calls_has_lost_the_connection(connect, observation):
    """It may be restarted: the episode is begun again, and nothing is wrong with its answers."""
    codec = pytest.importorskip("openpi_client.msgpack_numpy")
    packer, over = codec.Packer(), threading.Event()

    def answer(connection):
        connection.send(packer.pack({}))
        connection.recv()
        connection.send(packer.pack({"actions": np.zeros((5, 12), np.float32)}))
        over.wait(10.0)

    with serve(answer, "127.0.0.1", 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        policy = connect("openpi", server.socket.getsockname()[1])
        policy.reset(EPISODE)
        policy.act(observation, 0)
        over.set()  # the handler ends, and the server closes the connection in order
        time.sleep(0.5)
        with pytest.raises(PolicyConnectionLost):
            policy.act(observation, 5)
        server.shutdown()
