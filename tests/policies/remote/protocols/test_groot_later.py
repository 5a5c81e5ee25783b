"""GR00T N1.6 and N1.7: nested and flat requests, and the names that their models have."""

from __future__ import annotations

import io

import msgpack
import numpy as np
import pytest

from pytest_safemanip.errors import PolicyAnswerError, PolicyMismatch
from tests.policies.remote import servers
from tests.policies.remote.conftest import EPISODE

OLD = ("robot0_agentview_left", "robot0_agentview_right", "robot0_eye_in_hand")
NEW = ("res256_image_side_0", "res256_image_side_1", "res256_image_wrist_0")
OLD_WORDS, NEW_WORDS = servers.LANGUAGE, "annotation.human.action.task_description"
STATE = (
    "end_effector_position_relative",
    "end_effector_rotation_relative",
    "gripper_qpos",
    "base_position",
    "base_rotation",
)


class Later:
    """A server as the later releases have it.

    Args:
        flat: whether it was started with the wrapper for simulators.
        video: names of the pictures that the model reads.
        language: name of the instruction.
        frames: pictures of each camera that the model reads.
    """

    def __init__(self, flat, video=NEW, language=NEW_WORDS, state=STATE, frames=1):
        self.flat, self.video, self.language, self.state = flat, video, language, state
        self.frames, self.asked = frames, []

    def __call__(self, request):
        asked = msgpack.unpackb(request)
        self.asked.append(asked)
        match asked["endpoint"]:
            case "get_modality_config":
                reply = self.config()
            case "get_action":
                try:
                    reply = self.act(**asked["data"])
                except (AssertionError, KeyError) as error:
                    reply = {"error": str(error)}
            case _:
                reply = {"status": "ok"}
        return msgpack.packb(reply)

    def config(self):
        sizes = {"video": (self.video, self.frames), "state": (self.state, 1)}
        sizes |= {"language": ([self.language], 1), "action": (servers.SIZES, 16)}
        return {
            name: {
                "__ModalityConfig_class__": True,
                "as_json": {"delta_indices": list(range(steps)), "modality_keys": list(keys)},
            }
            for name, (keys, steps) in sizes.items()
        }

    def act(self, observation, options):
        if self.flat:
            for key in self.video:
                assert f"video.{key}" in observation, f"Video key 'video.{key}' must be in it"
            for key in self.state:
                assert f"state.{key}" in observation, f"State key 'state.{key}' must be in it"
            (words,) = observation[self.language]
            assert isinstance(words, str)
            return [servers.groot_actions(), {}]
        for modality in ("video", "state", "language"):
            assert modality in observation, f"Observation must contain a '{modality}' key"
        for key in self.video:
            assert key in observation["video"], f"Video key '{key}' must be in it"
        ((words,),) = observation["language"][self.language]
        assert isinstance(words, str)
        return [servers.groot_actions(prefix=""), {}]

    @property
    def observations(self):
        return [a["data"]["observation"] for a in self.asked if a["endpoint"] == "get_action"]


@pytest.mark.parametrize("flat", [False, True], ids=["plain", "with the wrapper"])
@pytest.mark.parametrize(("video", "language"), [(OLD, OLD_WORDS), (NEW, NEW_WORDS)])
def test_the_layout_and_the_names_are_found_out(connect, observation, flat, video, language):
    answer = Later(flat, video, language)
    with servers.Zmq(answer) as server:
        policy = connect("groot", server.port)
        assert policy.open()["protocol"] == "GR00T msgpack, N1.6 or later"
        policy.prepare("OpenDrawer")
        policy.reset(EPISODE)
        for step in (0, 16):
            assert policy.act(observation, step).shape == (16, 12)
    *_, last = answer.observations
    assert ("video" in last) != flat
    # What was refused once is not tried again.
    assert len(answer.observations) == 3 + flat
    pictures = {k.removeprefix("video."): v for k, v in last.items()} if flat else last["video"]
    for key, camera in zip(video, OLD, strict=True):
        shown = np.load(io.BytesIO(pictures[key]["as_npy"]), allow_pickle=False)
        assert (shown[0, 0] == observation[f"video.{camera}"]).all()


@pytest.mark.parametrize("layout", ["flat", "nested"])
def test_a_layout_that_was_set_is_the_only_one_that_is_tried(connect, observation, layout):
    answer = Later(flat=True)
    with servers.Zmq(answer) as server:
        policy = connect("groot", server.port, layout=layout)
        if layout == "flat":
            policy.prepare("OpenDrawer")
        else:
            with pytest.raises(PolicyMismatch, match=r"Video key 'video\.res256_image_side_0'"):
                policy.prepare("OpenDrawer")
    assert len(answer.observations) == 1


def test_a_server_that_refuses_both_layouts_is_quoted_twice(connect):
    def broken(observation, options):
        raise AssertionError(f"out of memory over {len(observation)} entries")

    answer = Later(flat=False)
    answer.act = broken
    with servers.Zmq(answer) as server, pytest.raises(PolicyMismatch) as error:
        connect("groot", server.port).prepare("OpenDrawer")
    assert "asked in nested maps, the server failed: out of memory over 3" in str(error.value)
    assert "asked in a flat one, the server failed: out of memory over 9" in str(error.value)


def test_a_failure_later_on_is_no_question_of_the_layout(connect, observation):
    answer = Later(flat=False)
    with servers.Zmq(answer) as server:
        policy = connect("groot", server.port)
        policy.prepare("OpenDrawer")
        answer.video = ("gone",)
        policy.reset(EPISODE)
        with pytest.raises(PolicyAnswerError, match=r"at step 0.*Video key 'gone'"):
            policy.act(observation, 0)
    assert len(answer.observations) == 2


def test_a_camera_that_the_model_does_not_read_is_not_sent(connect):
    answer = Later(flat=False, video=NEW[::2])
    with servers.Zmq(answer) as server:
        connect("groot", server.port).prepare("OpenDrawer")
    assert list(answer.observations[0]["video"]) == [*NEW[::2]]


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        (
            {"video": (*NEW, "ego_view")},
            "reads ego_view, .* groot.key.left = video.ego_view in safemanip_presets",
        ),
        ({"state": (*STATE, "joint_position")}, "its model reads joint_position, the presets'"),
        ({"language": "task"}, "its model reads task, .* groot.key.instruction = task"),
        ({"frames": 2}, "looks at 2 pictures of each camera at a time"),
    ],
)
def test_a_model_of_something_else_is_refused_with_the_setting_that_helps(connect, changed, says):
    with servers.Zmq(Later(True, **changed)) as server, pytest.raises(PolicyMismatch, match=says):
        connect("groot", server.port).open()


def test_a_name_that_was_set_is_read(connect):
    from pytest_safemanip.policies.remote.adjusting import adjusted_presets

    (preset,) = adjusted_presets(["groot.key.instruction = task"]).values()
    answer = Later(flat=True, language="task")
    with servers.Zmq(answer) as server:
        connect("groot", server.port, naming=preset.naming).prepare("OpenDrawer")
    assert answer.observations[-1]["task"] == ["open the drawer"]
