"""A model in another process, over a websocket, and the same actions here: the same rollout."""

from __future__ import annotations

import contextlib
import dataclasses
import socket
import subprocess
import sys

import numpy as np
import pytest

from pytest_safemanip.rollouts.store import Store
from pytest_safemanip.run.option_values import parse_policies
from pytest_safemanip.run.plan import Extensions, make_plan
from pytest_safemanip.run.session import SafetySession
from pytest_safemanip.trace import files

GRIPPED = [6, 11]  # gripper and mode of the base
MODEL = """
import sys
from pathlib import Path

import numpy as np
from pytest_safemanip.trace import files

class Script:
    '''Gives the expert's actions of a rollout, five at a time, and looks at what it is shown.'''

    def __init__(self):
        steps = files.load(Path({path!r})).steps
        self.actions = steps.action[1:].astype(float)
        self.actions[:, {gripped}] = (self.actions[:, {gripped}] + 1) / 2

    def reset(self, seed):
        self.calls = 0

    def infer(self, request):
        names = ("image", "wrist_image", "right_image")
        images = [request[f"observation/{{name}}"] for name in names]
        assert all(image.shape == (224, 224, 3) and image.std() > 5 for image in images)
        first = 5 * self.calls
        self.calls += 1
        return {{"actions": self.actions[first : first + 5]}}
"""


@pytest.fixture
def script(tmp_path, rollouts):
    """A rollout whose gripper is told to open or to close, nothing between, as by the protocol."""
    recording = rollouts.get("OpenDrawer").recording
    action = recording.steps.action.copy()
    action[:, GRIPPED] = np.where(action[:, GRIPPED] > 0.0, 1.0, -1.0)
    steps = dataclasses.replace(recording.steps, action=action)
    path = tmp_path / "script" / "a.rollout"
    path.parent.mkdir()
    files.save(dataclasses.replace(recording, steps=steps), path)
    return path


@pytest.fixture
def address(tmp_path, script):
    (tmp_path / "model.py").write_text(MODEL.format(path=str(script), gripped=GRIPPED))
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
    command = [sys.executable, "-m", "pytest_safemanip", "serve", "model:Script"]
    with contextlib.ExitStack() as stack:
        server = stack.enter_context(
            subprocess.Popen(
                [*command, "--port", str(port)], cwd=tmp_path, stdout=subprocess.PIPE, text=True
            )
        )
        stack.callback(server.kill)
        server.stdout.readline()
        yield f"ws://127.0.0.1:{port}"


def rolled_out(rollouts, policy, folder):
    """A rollout by a policy as it is named on the command line."""
    policies, servers, _ = parse_policies([policy], {})
    settings = dataclasses.replace(
        rollouts.plan("OpenDrawer").settings,
        policies=policies,
        servers=servers,
        out=folder,
        stepping="exact",
        horizon_scale=0.05,  # drawing three images takes a software renderer a quarter second
    )
    plan = make_plan(settings, Extensions({}, (), {}))
    session = SafetySession(plan, rollouts.backend, Store(folder / "recordings", "run"), "run")
    recording = session.evaluate(plan.cases[0]).recording
    plan.policies[policies[0]].close()
    return recording


def test_over_the_wire_and_here_it_is_the_same_rollout(tmp_path, rollouts, script, address):
    here = rolled_out(rollouts, f"recording:{script.parent}", tmp_path / "here")
    there = rolled_out(rollouts, f"openpi={address}", tmp_path / "there")
    assert here.acting > 20
    for field in dataclasses.fields(here.steps):
        one, other = getattr(here.steps, field.name), getattr(there.steps, field.name)
        if field.name != "contacts":
            assert np.array_equal(one, other), field.name
    for field in dataclasses.fields(here.steps.contacts):
        one, other = (getattr(r.steps.contacts, field.name) for r in (here, there))
        assert np.array_equal(one, other), field.name
    assert there.episode.served["seeded"] == "yes"
    assert there.episode.served["clipped"] == "0"
