"""Presets as the ini file changes them, and the requests that come of it."""

from __future__ import annotations

import dataclasses

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.policies.remote.adjusting import adjusted_presets, changes_of
from pytest_safemanip.policies.remote.claims import described, digest_of
from pytest_safemanip.policies.remote.endpoint import Endpoint
from pytest_safemanip.policies.remote.groot import request_of as groot_request
from pytest_safemanip.policies.remote.openpi import request_of
from pytest_safemanip.policies.remote.presets import PRESETS
from pytest_safemanip.policies.remote.vlaeval import payload_of


def test_what_is_not_mentioned_stays():
    assert adjusted_presets([]) == {}
    found = adjusted_presets(["pi05.open_loop_steps = 8"])
    assert found == {"pi05": dataclasses.replace(PRESETS["pi05"], steps=8)}


def test_a_request_has_the_names_cameras_and_sizes_that_were_set(observation):
    (preset,) = adjusted_presets(
        [
            "openpi.image_size = 96",
            "openpi.camera.left = robot0_agentview_right",
            "openpi.camera.right=none",
            "openpi.key.left = cam/front",
            "openpi.key.state = state",
            "openpi.key.instruction = task",
        ]
    ).values()
    request = request_of(observation, preset.naming)
    assert list(request) == ["cam/front", "observation/wrist_image", "state", "task"]
    assert request["cam/front"].shape == (96, 96, 3)
    bright = {
        key: (value.mean() if hasattr(value, "mean") else 0) for key, value in request.items()
    }
    assert bright["cam/front"] == pytest.approx(
        observation["video.robot0_agentview_right"].mean(), abs=1
    )


def test_groots_and_vla_evals_requests_have_them_too(observation):
    found = adjusted_presets(
        [
            "groot.key.left = video.res256_image_side_0",
            "groot.key.eef_position = state.eef",
            "vla-eval.key.instruction = prompt",
            "vla-eval.camera.wrist = none",
        ]
    )
    request = groot_request(observation, found["groot"].naming)
    assert (
        request["video.res256_image_side_0"][0, 0] == observation["video.robot0_agentview_left"]
    ).all()
    assert request["state.eef"].shape == (1, 1, 3)
    payload = payload_of(observation, found["vla-eval"].naming)
    assert payload["prompt"] == "open the drawer"
    assert list(payload["images"]) == [
        "video.robot0_agentview_left",
        "video.robot0_agentview_right",
    ]


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("pi05.open_loop_steps", "expected PRESET.SETTING = VALUE"),
        ("open_loop_steps = 8", "expected PRESET.SETTING = VALUE"),
        ("pi5.open_loop_steps = 8", "unknown preset 'pi5'; did you mean 'pi05'?"),
        ("pi05.open_loop_step = 8", "no setting 'open_loop_step'; did you mean 'open_loop_steps'?"),
        ("pi05.open_loop_steps = 0", "expected a number from 1 to 1000, found '0'"),
        ("pi05.image_size = 8", "expected a number from 16 to 2048"),
        ("pi05.camera.left = robot0_agentview_rihgt", "did you mean 'robot0_agentview_right'?"),
        ("pi05.key.wirst = image", "did you mean 'key.wrist'?"),
        ("pi05.key.wrist = prompt", "a key of its own (that of 'instruction' is the same)"),
        ("pi05.layout = flat", "has no setting 'layout'"),
        ("groot.layout = flta", "expected one of auto, nested, flat, found 'flta'"),
    ],
)
def test_what_cannot_be_set_is_a_usage_error_with_the_nearest_name(line, says):
    with pytest.raises(ConfigError) as error:
        adjusted_presets([line])
    assert str(error.value).startswith("safemanip_presets: ")
    assert says in str(error.value)


def test_a_setting_is_given_once():
    lines = ["pi05.image_size = 256", "pi0.image_size = 256", "pi05.image_size = 224"]
    with pytest.raises(ConfigError, match=r"pi05\.image_size is given twice"):
        adjusted_presets(lines)


@pytest.mark.parametrize(
    "line",
    [
        "groot.open_loop_steps = 8",
        "groot.image_size = 128",
        "groot.camera.left = none",
        "groot.key.left = video.other",
        "groot.layout = flat",
    ],
)
def test_every_change_is_part_of_what_is_claimed_to_be_served(line):
    servers = {"": (Endpoint("tcp", "127.0.0.1", 5555),)}
    (changed,) = adjusted_presets([line]).values()
    assert described(changed, servers, "x") != described(PRESETS["groot"], servers, "x")
    said = {"claimed": "x"}
    assert digest_of(changed, said) != digest_of(PRESETS["groot"], said)


def test_every_preset_can_be_changed():
    for preset in PRESETS.values():
        assert {"open_loop_steps", "image_size", "camera.left", "key.instruction"} <= {
            *changes_of(preset)
        }
