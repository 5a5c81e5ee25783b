"""Policies of LeRobot's, served: with LeRobot itself where it is installed."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys

import numpy as np
import pytest

from pytest_safemanip.cli.main import main
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.policies.lerobot import LeRobotModel, parse_cameras
from pytest_safemanip.policies.remote.client import Beginning
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.observation import blank
from pytest_safemanip.policies.remote.openpi import request_of
from pytest_safemanip.policies.remote.policy import RemotePolicy
from pytest_safemanip.policies.remote.presets import PRESETS

CAMERAS = ("robot0_agentview_left", "robot0_eye_in_hand")
STEPS = 4


def lerobot():
    pytest.importorskip("torch")
    pytest.importorskip("lerobot.policies.factory")


def save_act(folder, cameras=CAMERAS, actions=12, state=16):
    """A tiny ACT with random weights, saved as LeRobot's training does."""
    import torch
    from lerobot.configs.types import FeatureType, PolicyFeature
    from lerobot.policies.act.configuration_act import ACTConfig
    from lerobot.policies.act.modeling_act import ACTPolicy
    from lerobot.policies.act.processor_act import make_act_pre_post_processors

    torch.manual_seed(0)
    pictures = {
        f"observation.images.{name}": PolicyFeature(FeatureType.VISUAL, (3, 64, 64))
        for name in cameras
    }
    config = ACTConfig(
        input_features={
            **pictures,
            "observation.state": PolicyFeature(FeatureType.STATE, (state,)),
        },
        output_features={"action": PolicyFeature(FeatureType.ACTION, (actions,))},
        device="cpu",
        push_to_hub=False,
        chunk_size=8,
        n_action_steps=STEPS,
        pretrained_backbone_weights=None,
        dim_model=32,
        n_heads=2,
        dim_feedforward=32,
        n_encoder_layers=1,
        use_vae=False,
    )
    ACTPolicy(config).save_pretrained(folder)
    zeros, ones = torch.zeros, torch.ones
    statistics = {
        "observation.state": {"mean": zeros(state), "std": ones(state)},
        "action": {"mean": torch.full((actions,), 0.25), "std": ones(actions) / 100},
        **{name: {"mean": zeros(3, 1, 1), "std": ones(3, 1, 1)} for name in pictures},
    }
    for part in make_act_pre_post_processors(config, statistics):
        part.save_pretrained(folder)
    return folder


def test_an_act_is_asked_for_the_steps_it_executes_with_what_was_saved_beside_it(tmp_path):
    lerobot()
    model = LeRobotModel(str(save_act(tmp_path / "act")))
    model.reset(0)
    request = request_of(blank())
    actions = model.infer(request)["actions"]
    assert actions.shape == (STEPS, 12)
    assert np.abs(actions - 0.25).max() < 0.2  # the statistics of its postprocessor
    assert actions.std() > 0
    model.reset(0)
    assert (model.infer(request)["actions"] == actions).all()
    darker = {key: value // 2 if key.endswith("image") else value for key, value in request.items()}
    model.reset(0)
    assert (model.infer(darker)["actions"] != actions).any()
    assert model.metadata["lerobot"]["type"] == "act"
    assert model.metadata["lerobot"]["pictures"] == {
        "observation.images.robot0_agentview_left": "left",
        "observation.images.robot0_eye_in_hand": "wrist",
    }


def test_other_weights_are_another_fingerprint(tmp_path):
    lerobot()
    folder = save_act(tmp_path / "act")
    before = LeRobotModel(str(folder)).fingerprint
    assert LeRobotModel(str(folder)).fingerprint == before
    (folder / "note.txt").write_text("changed")
    assert LeRobotModel(str(folder)).fingerprint != before


def test_a_camera_without_a_known_name_is_asked_for(tmp_path):
    lerobot()
    folder = str(save_act(tmp_path / "act", ("front",)))
    with pytest.raises(ConfigError, match=r"--camera observation\.images\.front=left"):
        LeRobotModel(folder)
    found = LeRobotModel(folder, cameras={"observation.images.front": "right"})
    assert found.metadata["lerobot"]["pictures"] == {"observation.images.front": "right"}
    with pytest.raises(ConfigError, match=r"has no picture 'observation\.images\.frnt'"):
        LeRobotModel(folder, cameras={
            "observation.images.front": "right", "observation.images.frnt": "left"
        })  # fmt: skip


@pytest.mark.parametrize("sizes", [{"actions": 7}, {"state": 8}])
def test_a_policy_of_another_robot_is_refused(tmp_path, sizes):
    lerobot()
    folder = str(save_act(tmp_path / "act", **sizes))
    with pytest.raises(ConfigError, match="it is another robot's"):
        LeRobotModel(folder)


def test_it_is_served_and_asked_over_the_wire(tmp_path):
    lerobot()
    folder = save_act(tmp_path / "act")
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
    command = [sys.executable, "-m", "pytest_safemanip", "serve", "--lerobot", str(folder)]
    with contextlib.ExitStack() as stack:
        server = stack.enter_context(
            subprocess.Popen([*command, "--port", str(port)], stdout=subprocess.PIPE, text=True)
        )
        stack.callback(server.kill)
        assert any("serving" in line for line in server.stdout)  # LeRobot prints, too
        deadlines = Deadlines(start=60.0, open=20.0)
        endpoint = Endpoint("ws", "127.0.0.1", port)
        policy = RemotePolicy(PRESETS["lerobot"], endpoint, tmp_path, deadlines)
        stack.callback(policy.close)
        policy.prepare("OpenDrawer")
        policy.reset(Beginning("OpenDrawer", 3, "open the drawer"))
        assert policy.act(blank(), 0).shape == (STEPS, 12)
        assert policy.seeded


def test_without_lerobot_it_is_said_where_it_runs(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(ConfigError, match="runs in LeRobot's environment, which has 'torch'"):
        LeRobotModel(str(tmp_path))


def test_a_picture_is_named_by_its_feature():
    assert parse_cameras(["observation.images.top = left"]) == {"observation.images.top": "left"}
    with pytest.raises(ConfigError, match="did you mean 'left'"):
        parse_cameras(["observation.images.top=lefft"])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "expected either MODULE:ATTRIBUTE or --lerobot PATH"),
        (
            ["my_model:Model", "--lerobot", "here"],
            "expected either MODULE:ATTRIBUTE or --lerobot PATH",
        ),
        (["my_model:Model", "--device", "cpu"], "--device and --camera are for --lerobot"),
    ],
)
def test_what_does_not_go_together_is_refused(arguments, says, capsys):
    assert main(["serve", *arguments]) != 0
    assert says in capsys.readouterr().err


def test_a_folder_that_is_not_there_is_said_before_libraries_are_asked_for():
    with pytest.raises(ConfigError, match="--lerobot /no/such: neither a folder nor OWNER/NAME"):
        LeRobotModel("/no/such")
