"""An episode of RoboCasa's that is set up again from what a dataset has of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_safemanip.sim.backend import Request

REQUEST = Request("CloseBlenderLid", 2, "compact", kitchen="full")


@pytest.fixture(scope="module")
def stored(assets_root: Path) -> Any:
    """An episode with one state, in a kitchen in which the seed decides where things stand."""
    from pytest_safemanip.sim.robocasa import environment
    from pytest_safemanip.sim.robocasa.playback import episode_meta, replaying

    env = environment.make(REQUEST, assets_root)
    meta = json.dumps(episode_meta.published(env.get_ep_meta(), REQUEST.kitchen))
    state = np.array(env.sim.get_state().flatten())
    return replaying.StoredEpisode(
        REQUEST.task, json.loads(meta), env.model.get_xml(), np.array([state])
    )


@pytest.fixture(scope="module")
def env(stored: Any, assets_root: Path) -> Any:
    """RoboCasa's environment of the episode."""
    from pytest_safemanip.sim.robocasa.playback.replaying import Replay

    return Replay(stored, assets_root)._env


def test_its_checks_ask_for_fixtures_where_the_model_has_them(env: Any) -> None:
    drawn = [env.fixtures[name] for name in env.fxtr_placements]
    assert {"Blender", "CoffeeMachine", "Toaster"} < {type(fixture).__name__ for fixture in drawn}
    for fixture in drawn:
        body = env.sim.model._model.body(fixture.root_body)
        assert np.allclose(fixture.pos, body.pos, atol=1e-9), fixture.name
        assert np.allclose(np.cos(np.array(fixture.euler)[2] / 2), abs(body.quat[0]))


def test_the_elbow_is_pulled_to_where_the_episode_began(stored: Any, env: Any) -> None:
    arm = env.robots[0].composite_controller.part_controllers["right"]
    assert (arm.initial_joint == stored.states[0, 1:][arm.qpos_index]).all()
