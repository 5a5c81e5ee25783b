"""openpi's protocol, against a server that is none of the package's code."""

from __future__ import annotations

import msgpack
import numpy as np
import pytest
import websockets.sync.client

from pytest_safemanip.errors import PolicyAnswerError, PolicyConnectionLost, RolloutError
from pytest_safemanip.policies.remote.images import resize_with_pad
from pytest_safemanip.policies.remote.openpi import request_of
from pytest_safemanip.policies.remote.wire import packing
from tests.policies.remote import servers
from tests.policies.remote.conftest import EPISODE, PATIENT

# What openpi-client 0.1.2 packs, byte by byte.
REQUEST = bytes.fromhex(
    "83b16f62736572766174696f6e2f696d61676584c40b5f5f6e6461727261795f5fc3c40464617461c40c00010203"
    "0405060708090a0bc4056474797065a37c7531c405736861706593020203b16f62736572766174696f6e2f737461"
    "746584c40b5f5f6e6461727261795f5fc3c40464617461c4080000803e0000803fc4056474797065a33c6634c405"
    "7368617065"
    "9102a670726f6d7074af6f70656e2074686520647261776572"
)
REPLY = bytes.fromhex(
    "83a7616374696f6e7384c40b5f5f6e6461727261795f5fc3c40464617461c4080000003f000080bfc40564747970"
    "65a33c6634c4057368617065920102ad7365727665725f74696d696e6781a8696e6665725f6d73cb3ff800000000"
    "0000a16ecb4004000000000000"
)

TOKEN = "".join(["a", "key"])


def test_what_is_packed_is_what_openpis_own_client_packs():
    request = {
        "observation/image": np.arange(12, dtype=np.uint8).reshape(2, 2, 3),
        "observation/state": np.array([0.25, 1], np.float32),
        "prompt": "open the drawer",
    }
    assert packing.pack(request, packing.openpi_array) == REQUEST


def test_what_openpis_own_packer_packs_is_read():
    reply = packing.unpack(REPLY, packing.from_openpi)
    assert reply["actions"].tolist() == [[0.5, -1.0]]
    assert reply["actions"].dtype == np.float32
    assert reply["actions"].flags.writeable
    assert (reply["server_timing"], reply["n"]) == ({"infer_ms": 1.5}, 2.5)


def test_a_numpy_scalar_is_sent_and_read_with_its_value():
    packed = packing.pack({"x": np.float32(1.5)}, packing.openpi_array)
    inner = msgpack.unpackb(packed)["x"]
    assert inner == {b"__npgeneric__": True, b"data": 1.5, b"dtype": "<f4"}
    assert packing.unpack(packed, packing.from_openpi) == {"x": 1.5}


def test_a_request_has_the_models_keys_shapes_and_order(observation):
    request = request_of(observation)
    assert list(request) == [
        "observation/image",
        "observation/wrist_image",
        "observation/right_image",
        "observation/state",
        "prompt",
    ]
    for key, name in (
        ("observation/image", "video.robot0_agentview_left"),
        ("observation/wrist_image", "video.robot0_eye_in_hand"),
        ("observation/right_image", "video.robot0_agentview_right"),
    ):
        assert request[key].shape == (224, 224, 3)
        assert (request[key] == resize_with_pad(observation[name], 224)).all()
    expected = [0, 1, 2, 16, 17, 18, 19, 48, 49, 50, 64, 65, 66, 67, 32, 33]
    assert (request["observation/state"] * 16).tolist() == expected
    assert request["observation/state"].dtype == np.float32
    assert request["prompt"] == "open the drawer"


def test_a_chunk_is_asked_for_and_its_first_steps_are_given(connect, observation):
    seen = []
    with servers.openpi(seen=seen) as server:
        policy = connect("pi05", server.port)
        assert policy.open() == {"protocol": "openpi", "metadata": {}}
        policy.reset(EPISODE)
        actions = policy.act(observation, 0)
    assert actions.shape == (5, 12)
    expected = [0.25] * 6 + [-1.0] + [0.25] * 4 + [-1.0]
    assert actions.tolist() == [expected] * 5
    assert (policy.counts.calls, policy.counts.actions, policy.seeded) == (1, 5, False)
    (request,) = seen
    image = request["observation/image"]
    assert (image[b"dtype"], image[b"shape"], len(image[b"data"])) == ("|u1", [224, 224, 3], 150528)
    assert image[b"data"] == request_of(observation)["observation/image"].tobytes()


def test_the_handshake_offers_no_compression_and_sends_the_key(connect):
    heads = []

    def converse(frames):
        heads.append(frames.head)
        frames.send(b"\x80")
        frames.receive()

    with servers.websocket(converse) as server:
        connect("pi0", server.port, token=TOKEN).open()
    assert "Sec-WebSocket-Extensions" not in heads[0]
    assert f"Authorization: Api-Key {TOKEN}\r\n" in heads[0]


def test_the_librarys_own_deadlines_are_not_those_of_a_model(connect, monkeypatch):
    """Its keepalive would cut a first call of more than 40 s, as openpi's own client does."""
    asked = {}
    real = websockets.sync.client.connect

    def spy(*arguments, **options):
        asked.update(options)
        return real(*arguments, **options)

    monkeypatch.setattr(websockets.sync.client, "connect", spy)
    with servers.openpi() as server:
        connect("pi05", server.port).open()
    assert asked["ping_interval"] is None
    assert asked["open_timeout"] == PATIENT.open


def test_metadata_are_reported_as_they_are(connect):
    metadata = msgpack.packb({"config": "pi05", "norm": servers.floats([1.0], [1])})
    with servers.openpi(metadata=metadata) as server:
        found = connect("pi05", server.port).open()["metadata"]
    assert (found["config"], found["norm"].tolist()) == ("pi05", [1.0])


def test_a_server_that_can_be_seeded_is_seeded(connect):
    seen = []
    metadata = msgpack.packb({"safemanip": {"reset": True}})
    confirmed = msgpack.packb({"safemanip/reset": True})
    with servers.openpi(confirmed, metadata, seen) as server:
        policy = connect("openpi", server.port)
        policy.reset(EPISODE)
    assert policy.seeded
    episode = {"task": "OpenDrawer", "seed": 5, "instruction": "open the drawer"}
    assert seen == [{"safemanip/reset": episode}]


def test_a_reset_that_is_not_confirmed_is_no_reset(connect):
    metadata = msgpack.packb({"safemanip": {"reset": True}})
    with (
        servers.openpi(metadata=metadata) as server,
        pytest.raises(PolicyAnswerError, match="OpenDrawer: the server did not confirm"),
    ):
        connect("openpi", server.port).reset(EPISODE)


def test_trying_a_server_checks_its_answer_before_anything_is_simulated(connect):
    with servers.openpi() as server:
        policy = connect("pi05", server.port)
        policy.probe()
        assert policy.counts.calls == 1
    with (
        servers.openpi(servers.openpi_actions(rows=4)) as server,
        pytest.raises(PolicyAnswerError, match="trying the server: 4 actions, but 5 are"),
    ):
        connect("pi05", server.port).probe()


def test_after_a_failure_the_next_reset_makes_a_new_connection(connect, observation):
    def once(frames, request):
        if len(server.connections) == 1:
            raise EOFError
        frames.send(servers.openpi_actions())

    with servers.openpi(once) as server:
        policy = connect("pi05", server.port)
        policy.reset(EPISODE)
        with pytest.raises(PolicyConnectionLost, match="died"):
            policy.act(observation, 0)
        policy.reset(EPISODE)
        assert policy.act(observation, 0).shape == (5, 12)
        assert len(server.connections) == 2


def test_an_observation_without_an_image_is_refused_before_it_is_sent(connect, observation):
    seen = []
    with servers.openpi(seen=seen) as server:
        policy = connect("pi05", server.port)
        policy.reset(EPISODE)
        del observation["video.robot0_eye_in_hand"]
        with pytest.raises(RolloutError, match=r"has no 'video\.robot0_eye_in_hand'"):
            policy.act(observation, 0)
    assert seen == []
