"""vla-eval's protocol, against a server that is none of the package's code."""

from __future__ import annotations

import msgpack
import numpy as np
import pytest

from pytest_safemanip.errors import PolicyAnswerError, PolicyUnreachable
from pytest_safemanip.policies.remote import vlaeval
from pytest_safemanip.policies.remote.wire import packing
from tests.policies.remote import servers
from tests.policies.remote.conftest import EPISODE

# What vla-eval 0.8.0 packs, byte by byte.
HELLO = bytes.fromhex(
    "84a474797065a568656c6c6fa77061796c6f616484af6861726e6573735f76657273696f6ea5302e382e30b07072"
    "6f746f636f6c5f76657273696f6e01ac6d6f64656c5f736572766572a153ac6361706162696c697469657380a373"
    "657101a974696d657374616d70cb4000000000000000"
)
ACTION = bytes.fromhex(
    "84a474797065a6616374696f6ea77061796c6f616481a7616374696f6e7384ab5f5f6e6461727261795f5fc3a464"
    "617461c43000000000cdcccc3dcdcc4c3e9a99993ecdcccc3e0000003f9a99193f3333333fcdcc4c3f6666663f00"
    "00803fcdcc8c3fa56474797065a33c6634a57368617065910ca373657103a974696d657374616d70cb4000000000"
    "000000"
)
OBSERVATION = bytes.fromhex(
    "84a474797065ab6f62736572766174696f6ea77061796c6f616483a6696d6167657381a16184ab5f5f6e64617272"
    "61795f5fc3a464617461c403000000a56474797065a37c7531a5736861706593010103a5737461746581a17384ab"
    "5f5f6e6461727261795f5fc3a464617461c4040000003fa56474797065a33c6634a573686170659101b07461736b"
    "5f6465736372697074696f6ea46f70656ea373657103a974696d657374616d70cb4000000000000000"
)


def test_what_is_packed_is_what_vla_eval_packs():
    payload = {
        "images": {"a": np.zeros((1, 1, 3), np.uint8)},
        "state": {"s": np.array([0.5], np.float32)},
        "task_description": "open",
    }
    message = {"type": "observation", "payload": payload, "seq": 3, "timestamp": 2.0}
    assert packing.pack(message, packing.vlaeval_array) == OBSERVATION


def test_what_vla_eval_sends_is_executed(connect, observation):
    def converse(frames):
        frames.receive()
        frames.send(HELLO)
        assert msgpack.unpackb(frames.receive())["seq"] == 2
        assert msgpack.unpackb(frames.receive())["seq"] == 3
        frames.send(ACTION)
        frames.receive()

    with servers.websocket(converse) as server:
        policy = connect("vla-eval", server.port)
        found = policy.open()
        policy.reset(EPISODE)
        actions = policy.act(observation, 0)
    assert found["protocol"] == "vla-eval 1"
    assert found["metadata"]["model_server"] == "S"
    expected = np.arange(12) / 10
    expected[6], expected[11] = 1.0, 1.0
    assert actions[0] == pytest.approx(expected)
    assert actions.shape == (1, 12)
    assert policy.counts.clipped == 0  # 1.1 stands where the mode is


def test_an_episode_is_announced_asked_about_and_ended(connect, observation):
    seen = []
    with servers.vlaeval(seen=seen) as server:
        policy = connect("vla-eval", server.port)
        policy.reset(EPISODE)
        assert not policy.seeded
        for index in range(2):
            policy.act(observation, index)
        policy.reset(EPISODE)
        policy.act(observation, 0)
        policy.close()
    assert [(m["type"], m["seq"]) for m in seen] == [
        ("hello", 1),
        ("episode_start", 2),
        ("observation", 3),
        ("observation", 4),
        ("episode_end", 5),
        ("episode_start", 6),
        ("observation", 7),
        ("episode_end", 8),
    ]
    assert seen[0]["payload"]["protocol_version"] == 1
    assert seen[1]["payload"] == {"task": {"name": "OpenDrawer", "seed": 5}}
    payload = seen[2]["payload"]
    assert payload["task_description"] == "open the drawer"
    image = payload["images"]["video.robot0_agentview_right"]
    assert image["data"] == observation["video.robot0_agentview_right"].tobytes()
    assert (image["dtype"], image["shape"]) == ("|u1", [256, 256, 3])
    assert list(payload["state"]) == [
        "state.end_effector_position_relative",
        "state.end_effector_rotation_relative",
        "state.gripper_qpos",
        "state.base_position",
        "state.base_rotation",
    ]


@pytest.mark.parametrize("key", ["actions", "action"])
@pytest.mark.parametrize("shape", [[12], [1, 12]])
def test_both_names_of_an_action_are_read(connect, observation, key, shape):
    array = {**servers.vlaeval_action()["actions"], "shape": shape}

    def answer(frames, found):
        frames.send(servers.message("action", {key: array}, found["seq"]))

    with servers.vlaeval(answer) as server:
        policy = connect("vla-eval", server.port)
        policy.reset(EPISODE)
        assert policy.act(observation, 0)[0, 0] == 0.25


FAILED = {"error": "observation_failed: ValueError: no image"}


@pytest.mark.parametrize(
    ("kind", "payload", "shift", "what"),
    [
        ("error", FAILED, 0, "the server failed: observation_failed: ValueError: no image"),
        (
            "action",
            servers.vlaeval_action(),
            -1,
            "the reply is 'action' number 2, expected 'action",
        ),
        ("hello", {}, 0, "the reply is 'hello' number 3, expected 'action' number 3"),
        ("action", {}, 0, "the reply has no 'action'; it has nothing"),
        ("action", {"actions": [0.0] * 7}, 0, "'actions' has shape (7,), expected (H, 12)"),
        ("action", {"actions": {"__image__": True}}, 0, "the reply is not vla-eval's: a reply has"),
        (3, {}, 0, "the reply is not vla-eval's: no message"),
    ],
)
def test_an_answer_that_is_none_is_named(connect, observation, kind, payload, shift, what):
    def answer(frames, found):
        frames.send(servers.message(kind, payload, found["seq"] + shift))

    with servers.vlaeval(answer) as server:
        policy = connect("vla-eval", server.port)
        policy.reset(EPISODE)
        with pytest.raises(PolicyAnswerError) as error:
            policy.act(observation, 0)
        assert what in str(error.value)
        policy.reset(EPISODE)  # on a new connection


def test_a_start_of_an_episode_that_failed_is_reported_and_kept(connect, observation, tmp_path):
    def converse(frames):
        while True:
            found = msgpack.unpackb(frames.receive())
            if found["type"] == "hello":
                frames.send(servers.message("hello", {"protocol_version": 1}, found["seq"]))
            elif found["type"] == "episode_start":
                failed = {"error": "episode_start_failed: KeyError: 'OpenDrawer'"}
                frames.send(servers.message("error", failed, found["seq"]))

    with servers.websocket(converse) as server:
        policy = connect("vla-eval", server.port)
        policy.reset(EPISODE)
        with pytest.raises(PolicyAnswerError, match="episode_start_failed: KeyError"):
            policy.act(observation, 0)
    (kept,) = (tmp_path / "dumps").iterdir()
    with np.load(kept) as arrays:
        assert arrays["request/task/name"] == "OpenDrawer"


def test_another_version_of_the_protocol_is_refused(connect):
    with (
        servers.vlaeval(hello={"protocol_version": 2}) as server,
        pytest.raises(PolicyUnreachable, match="protocol version 2, this is version 1"),
    ):
        connect("vla-eval", server.port).open()


def test_the_instruction_and_every_entry_are_where_the_benchmark_has_them(observation):
    payload = vlaeval.payload_of(observation)
    assert list(payload) == ["images", "state", "task_description"]
    assert set(payload["images"]) | set(payload["state"]) == set(observation) - {
        "annotation.human.task_description"
    }
