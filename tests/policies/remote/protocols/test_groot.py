"""GR00T's protocol in its encodings, against servers that are none of the package's code."""

from __future__ import annotations

import io
import struct
import time
from pathlib import Path

import msgpack
import numpy as np
import pytest

from pytest_safemanip.errors import (
    PolicyAnswerError,
    PolicyConnectionLost,
    PolicyMismatch,
    PolicyUnreachable,
)
from tests.policies.remote import servers
from tests.policies.remote.conftest import EPISODE, PATIENT, QUICK, unpickle

GOLDEN = Path(__file__).parents[1] / "golden"
TOKEN = "".join(["a", "key"])
GIVEN = [0.25] * 6 + [-1.0] + [0.25] * 4 + [-1.0]


def golden(name):
    return (GOLDEN / f"{name}.pt").read_bytes()


def torch_request(data):
    """A request as an old server's ``torch.load`` reads it; only its own tests send it here."""
    stream = io.BytesIO(data)
    assert unpickle(stream) == 0x1950A86A20F9469CFC6C
    unpickle(stream)
    unpickle(stream)
    return unpickle(stream)


def torch_server(actions="actions_numpy1", modalities="modalities", error=None):
    """Answers like N1.5's servers before mid 2025: errors are a word, or a map."""

    def answer(request):
        try:
            asked = torch_request(request)["endpoint"]
        except Exception:
            return error or b"ERROR"
        if asked == "get_action" and actions is None:
            return b"ERROR"
        return golden({"ping": "ping", "get_modality_config": modalities}.get(asked, actions))

    return answer


def test_a_msgpack_server_is_recognised_and_asked_in_its_shapes(connect, observation):
    with servers.Zmq(servers.groot()) as server:
        policy = connect("groot", server.port)
        found = policy.open()
        policy.reset(EPISODE)
        actions = policy.act(observation, 0)
        asked = [msgpack.unpackb(request) for request in server.requests]
    assert found["protocol"] == "GR00T msgpack"
    assert found["metadata"]["modalities"]["language"] == [servers.LANGUAGE]
    assert actions.tolist() == [GIVEN] * 16
    assert [request["endpoint"] for request in asked] == [
        "ping",
        "get_modality_config",
        "get_action",
    ]
    data = asked[-1]["data"]
    assert data["annotation.human.task_description"] == ["open the drawer"]
    arrays = {key: load(value) for key, value in data.items() if isinstance(value, dict)}
    assert {key: (array.shape, array.dtype.str) for key, array in arrays.items()} == {
        "video.robot0_agentview_left": ((1, 1, 256, 256, 3), "|u1"),
        "video.robot0_agentview_right": ((1, 1, 256, 256, 3), "|u1"),
        "video.robot0_eye_in_hand": ((1, 1, 256, 256, 3), "|u1"),
        "state.end_effector_position_relative": ((1, 1, 3), "<f4"),
        "state.end_effector_rotation_relative": ((1, 1, 4), "<f4"),
        "state.gripper_qpos": ((1, 1, 2), "<f4"),
        "state.base_position": ((1, 1, 3), "<f4"),
        "state.base_rotation": ((1, 1, 4), "<f4"),
    }
    for key, array in arrays.items():
        assert (array[0, 0] == observation[key]).all()


def load(value):
    assert value["__ndarray_class__"] is True
    return np.load(io.BytesIO(value["as_npy"]), allow_pickle=False)


@pytest.mark.parametrize("numpy", ["numpy1", "numpy2"])
@pytest.mark.parametrize("error", [b"ERROR", golden("ping")])
def test_a_torch_server_is_recognised_without_unpickling(connect, observation, numpy, error):
    answer = torch_server(f"actions_{numpy}", error=error)
    with servers.Zmq(answer) as server:
        policy = connect("groot", server.port)
        found = policy.open()
        policy.reset(EPISODE)
        actions = policy.act(observation, 0)
        asked = torch_request(server.requests[-1])
    assert found["protocol"] == "GR00T torch"
    assert found["metadata"]["modalities"]["language"] == [servers.LANGUAGE]
    assert actions.shape == (16, 12)
    position = ((np.arange(48) - 20) / 100).reshape(16, 3)
    motion = ((np.arange(64) - 20) / 100).reshape(16, 4)
    assert actions[:, 0:3] == pytest.approx(position)
    assert actions[:, 7:11] == pytest.approx(motion)
    assert set(actions[:, 6]) == {-1.0}
    assert asked["data"]["annotation.human.task_description"] == ["open the drawer"]
    image = asked["data"]["video.robot0_eye_in_hand"]
    assert (image[0, 0] == observation["video.robot0_eye_in_hand"]).all()


def test_parts_are_put_where_the_environment_wants_them(connect, observation):
    parts = {
        "action.end_effector_position": servers.groot_map([0.1, 0.2, 0.3] * 16, (1, 16, 3)),
        "action.end_effector_rotation": servers.groot_map([0.4, 0.5, 0.6] * 16, (1, 16, 3)),
        "action.gripper_close": servers.groot_map([1.0, 0.0] * 8, (1, 16, 1)),
        "action.base_motion": servers.groot_map([0.7, 0.8, 0.9, 1.5] * 16, (1, 16, 4)),
        "action.control_mode": servers.groot_map([0.4, 0.5] * 8, (1, 16, 1)),
    }
    with servers.Zmq(servers.groot(parts)) as server:
        policy = connect("groot", server.port)
        policy.reset(EPISODE)
        actions = policy.act(observation, 0)
    common = ([0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [0.7, 0.8, 0.9, 1.0])
    assert actions[0] == pytest.approx([*common[0], 1.0, *common[1], -1.0])
    assert actions[1] == pytest.approx([*common[0], -1.0, *common[1], 1.0])
    assert policy.counts.clipped == 16


def later_server(reply=None, seen=None):
    """Answers like N1.6's server: nested maps, a list of action and info, a reset."""

    def answer(request):
        asked = msgpack.unpackb(request)
        seen.append(asked)
        if asked["endpoint"] == "get_modality_config":
            inner = {"delta_indices": list(range(16)), "modality_keys": list(servers.SIZES)}
            words = {"delta_indices": [0], "modality_keys": [servers.LANGUAGE]}
            found = {"__ModalityConfig_class__": True}
            return msgpack.packb(
                {"action": {**found, "as_json": inner}, "language": {**found, "as_json": words}}
            )
        if asked["endpoint"] == "get_action":
            return msgpack.packb([servers.groot_actions(prefix=""), {"info": 1}])
        return msgpack.packb({"status": "ok"})

    return answer


def test_a_later_server_is_asked_in_nested_maps_and_told_of_the_episode(connect, observation):
    seen = []
    with servers.Zmq(later_server(seen=seen)) as server:
        policy = connect("groot", server.port)
        found = policy.open()
        policy.reset(EPISODE)
        actions = policy.act(observation, 0)
    assert found["protocol"] == "GR00T msgpack, N1.6 or later"
    assert actions.tolist() == [GIVEN] * 16
    assert [asked["endpoint"] for asked in seen[2:]] == ["reset", "get_action"]
    assert seen[2]["data"] == {"options": None}
    data = seen[3]["data"]["observation"]
    assert data["language"] == {"annotation.human.task_description": [["open the drawer"]]}
    assert list(data["video"]) == [
        "robot0_agentview_left", "robot0_agentview_right", "robot0_eye_in_hand",
    ]  # fmt: skip
    assert load(data["state"]["base_rotation"]).shape == (1, 1, 4)


def test_a_token_is_sent_with_every_request(connect):
    with servers.Zmq(servers.groot()) as server:
        connect("groot", server.port, token=TOKEN).open()
        assert [msgpack.unpackb(r)["api_token"] for r in server.requests] == [TOKEN] * 2


def test_a_wrong_token_is_what_the_server_says(connect):
    refused = msgpack.packb({"error": "Unauthorized: Invalid API token"})
    said = "the server failed: Unauthorized: Invalid"
    with (
        servers.Zmq(lambda request: refused) as server,
        pytest.raises(PolicyUnreachable, match=said),
    ):
        connect("groot", server.port).open()


def test_a_model_that_is_told_its_task_in_another_way_is_refused(connect):
    answer = servers.groot(language="annotation.human.task_name")
    with servers.Zmq(answer) as server, pytest.raises(PolicyMismatch) as error:
        connect("groot-to", server.port).open()
    assert "its model reads annotation.human.task_name" in str(error.value)


def test_a_model_with_shorter_chunks_than_are_executed_is_refused(connect, observation):
    with servers.Zmq(servers.groot(servers.groot_actions(8), steps=8)) as server:
        with pytest.raises(PolicyMismatch, match="predicts 8 steps, and 16 are executed"):
            connect("groot", server.port).open()
        policy = connect("groot", server.port, steps=8)
        policy.reset(EPISODE)
        assert policy.act(observation, 0).shape == (8, 12)


def without(part):
    actions = servers.groot_actions()
    del actions[part]
    return actions


def changed(part, values, shape):
    return {**servers.groot_actions(), part: servers.groot_map(values, shape)}


@pytest.mark.parametrize(
    ("actions", "what"),
    [
        (without("action.base_motion"), "the reply has no 'action.base_motion'; it has 'action.en"),
        (
            changed("action.control_mode", [0.0] * 15 + [float("nan")], (1, 16, 1)),
            "action.control_mode[15, 0] is nan: the action of step 15 of the 16",
        ),
        (
            changed("action.base_motion", [0.0] * 48, (1, 16, 3)),
            "'action.base_motion' has shape (1, 16, 3), expected (1, H, 4)",
        ),
        (
            changed("action.gripper_close", [0.0] * 8, (1, 8, 1)),
            "'action.gripper_close' has 8 steps, the parts before 16",
        ),
        (
            changed("action.gripper_close", [0.0] * 32, (2, 16, 1)),
            "'action.gripper_close' has shape (2, 16, 1), expected (1, H, 1)",
        ),
        (servers.groot_actions(8), "8 actions, but 16 are executed"),
        ([1, 2], "the reply is list, not a map"),
        ({"error": "CUDA out of memory"}, "the server failed: CUDA out of memory"),
        (None, "the server failed, and says no more than ERROR"),
    ],
)
def test_an_answer_that_cannot_be_executed_is_named(connect, observation, actions, what):
    reply = b"ERROR" if actions is None else msgpack.packb(actions)
    with servers.Zmq(servers.groot(lambda: reply)) as server:
        policy = connect("groot", server.port)
        policy.reset(EPISODE)
        with pytest.raises(PolicyAnswerError) as error:
            policy.act(observation, 32)
    assert "at step 32" in str(error.value)
    assert what in str(error.value)


@pytest.mark.parametrize("name", ["objects", "tensor"])
def test_an_answer_with_objects_or_tensors_is_refused(connect, observation, name):
    with servers.Zmq(torch_server(name)) as server:
        policy = connect("groot", server.port)
        policy.reset(EPISODE)
        with pytest.raises(PolicyAnswerError, match="the reply is not GR00T's"):
            policy.act(observation, 0)


@pytest.mark.parametrize("reply", [b"", b"hello", b"\xc1", b"\xdd\xff"])
def test_a_ping_that_is_answered_with_something_else_is_no_groot_server(connect, reply):
    with (
        servers.Zmq(lambda request: reply) as server,
        pytest.raises(PolicyUnreachable, match="does not answer a ping as GR00T does"),
    ):
        connect("groot", server.port).open()


def zmtp(after):
    """A ZeroMQ server from raw bytes (ZMTP 3.0, NULL), until the client's first message."""

    def converse(connection):
        connection.sendall(b"\xff" + b"\0" * 8 + b"\x7f")
        servers.exactly(connection, 10)
        connection.sendall(b"\x03\x00NULL" + b"\0" * 16 + b"\0" + b"\0" * 31)
        servers.exactly(connection, 54)
        ready = b"\x05READY\x0bSocket-Type" + struct.pack(">I", 3) + b"REP"
        connection.sendall(b"\x04" + bytes((len(ready),)) + ready)
        connection.recv(65536)
        if after is not None:
            connection.sendall(after)
            server.over.wait(10)

    server = servers.Raw(converse)
    return server


@pytest.mark.parametrize(
    "after",
    [
        b"\x02" + struct.pack(">Q", 2**22 + 1) + b"x" * 1000,
        b"\x02" + struct.pack(">Q", 2**32) + b"x" * 1000,
        b"\x02" + struct.pack(">Q", 2**63) + b"x" * 1000,
        b"\xff" * 1000,
        None,
    ],
    ids=["a byte too many", "4 GB", "8 EB", "garbage", "closes"],
)
def test_a_message_that_is_announced_too_long_or_broken_ends_the_connection(connect, after):
    began = time.monotonic()
    with zmtp(after) as server, pytest.raises(PolicyUnreachable):
        connect("groot", server.port).open()
    assert time.monotonic() - began < PATIENT.open / 2  # long before a reply would be too late


def test_a_socket_that_was_closed_leaves_nothing_behind(connect, observation):
    with servers.Zmq(servers.groot()) as server:
        policy = connect("groot", server.port)
        for _ in range(3):
            policy.reset(EPISODE)
            policy.act(observation, 0)
            policy.close()
            policy.close()
        server.answer = lambda request: None
        policy = connect("groot", server.port, QUICK)
        with pytest.raises((PolicyUnreachable, PolicyConnectionLost)):
            policy.open()
