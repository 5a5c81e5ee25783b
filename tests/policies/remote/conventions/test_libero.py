"""LIBERO's public models: every convention of their observations and actions."""

from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.policies.registry import resolve
from pytest_safemanip.policies.remote.actions import ActionError, chunk_of, flat, flat_label
from pytest_safemanip.policies.remote.adjusting import adjusted_presets
from pytest_safemanip.policies.remote.embodiment import (
    LIBERO_PANDA,
    OPENVLA_PANDA,
    axis_angle,
    mirrored,
)
from pytest_safemanip.policies.remote.observation import blank, checked
from pytest_safemanip.policies.remote.openpi import request_of
from pytest_safemanip.policies.remote.presets import PRESETS
from pytest_safemanip.sim.libero.robot import AGENT_VIEW, EEF_POSITION, EEF_ROTATION, FINGERS, SPEC

PI05, OFT = PRESETS["pi05-libero"], PRESETS["openvla-oft"]


@pytest.fixture
def observation():
    seen = blank(LIBERO_PANDA)
    seen[EEF_POSITION] = np.array((0.1, 0.2, 0.3), np.float32)
    seen[FINGERS] = np.array((0.04, -0.04), np.float32)
    half = np.sqrt(0.5)
    seen[EEF_ROTATION] = np.array((half, 0.0, 0.0, half), np.float32)  # a quarter turn about x
    return checked(seen, LIBERO_PANDA)


def test_openpis_models_get_two_pictures_eight_numbers_and_the_prompt(observation):
    request = request_of(observation, PI05.naming, PI05.robot)
    assert sorted(request) == [
        "observation/image",
        "observation/state",
        "observation/wrist_image",
        "prompt",
    ]
    assert request["observation/image"].shape == (224, 224, 3)
    assert request["observation/image"].dtype == np.uint8
    assert request["prompt"] == "open the drawer"


def test_the_state_is_position_axis_times_angle_and_fingers(observation):
    state = request_of(observation, PI05.naming, PI05.robot)["observation/state"]
    assert state.dtype == np.float32
    assert state == pytest.approx([0.1, 0.2, 0.3, np.pi / 2, 0.0, 0.0, 0.04, -0.04])


@pytest.mark.parametrize(
    ("quaternion", "expected"),
    [
        ((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0)),
        ((1.0, 0.0, 0.0, 0.0), (np.pi, 0.0, 0.0)),
        ((0.0, 0.0, np.sin(0.1), np.cos(0.1)), (0.0, 0.0, 0.2)),
        # The other way round, as robosuite 1.4 has it: training data have it so.
        ((0.0, 0.0, -np.sin(0.1), -np.cos(0.1)), (0.0, 0.0, 0.2 - 2 * np.pi)),
    ],
)
def test_a_rotation_is_its_axis_times_its_angle(quaternion, expected):
    assert axis_angle(np.array(quaternion)) == pytest.approx(expected)


def test_pictures_are_liberos_own_turned_by_180_degrees(observation):
    upright = observation[AGENT_VIEW]
    own = upright[::-1]  # LIBERO's are upside down
    assert (mirrored(upright) == own[::-1, ::-1]).all()
    sent = request_of(observation, OFT.naming, OFT.robot)["full_image"]
    assert (sent == own[::-1, ::-1]).all()


def test_openpis_actions_are_executed_as_they_are():
    rows = flat({"actions": np.array([[0.5, 0, 0, 0, 0, 0.2, -1.0]] * 10)}, "actions", LIBERO_PANDA)
    chunk = chunk_of(rows, PI05.steps, flat_label("actions", LIBERO_PANDA), LIBERO_PANDA)
    assert chunk.actions.shape == (5, 7)
    assert chunk.actions[0].tolist() == [0.5, 0, 0, 0, 0, 0.2, -1.0]


@pytest.mark.parametrize(("given", "executed"), [(0.0, 1.0), (0.49, 1.0), (0.51, -1.0), (1.0, -1)])
def test_openvla_says_0_to_close_and_1_to_open(given, executed):
    rows = np.zeros((8, 7))
    rows[:, 6] = given
    chunk = chunk_of(rows, OFT.steps, flat_label("actions", OPENVLA_PANDA), OPENVLA_PANDA)
    assert chunk.actions[:, 6].tolist() == [executed] * 8


def test_another_robots_actions_are_refused():
    with pytest.raises(ActionError, match=r"expected \(H, 7\): is another robot's model"):
        flat({"actions": np.zeros((10, 12))}, "actions", LIBERO_PANDA)


def test_a_number_that_is_none_is_named_by_its_part():
    rows = np.zeros((5, 7))
    rows[2, 6] = np.nan
    with pytest.raises(ActionError, match=r"actions\[2, 6\] \(gripper_close\) is nan"):
        chunk_of(rows, 5, flat_label("actions", LIBERO_PANDA), LIBERO_PANDA)


def test_a_preset_of_libero_needs_what_its_backend_observes(tmp_path):
    seen = {*(camera.name for camera in SPEC.cameras), *SPEC.state}
    for name in ("pi0-libero", "pi05-libero", "openvla-oft"):
        assert set(resolve(name, {}, out=tmp_path).needs) == seen


def test_a_preset_of_libero_has_no_camera_of_robocasas():
    changed = adjusted_presets(["pi05-libero.camera.wrist = none"])["pi05-libero"]
    assert list(changed.naming.pictures) == ["observation/image"]
    with pytest.raises(ConfigError, match="expected a camera"):
        adjusted_presets(["pi05-libero.camera.left = robot0_agentview_left"])
