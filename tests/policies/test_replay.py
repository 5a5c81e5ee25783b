"""Recorded actions, done again."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, RolloutError, TraceError
from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.policies.registry import resolve
from pytest_safemanip.policies.replay import Replay
from pytest_safemanip.trace import files
from tests import toy

OPENS = dataclasses.replace(toy.episode(), task="OpenDrawer", seed=3)


def recorded(path, about=OPENS, length=6, tail=2):
    action = np.zeros((length, 12), np.float32)
    action[1:, 0] = np.arange(1, length)
    action[:, 6] = 1.0
    files.save(toy.recording(length, tail, about=about, action=action), path)


def begin(policy, task="OpenDrawer", seed=3):
    policy.reset(EpisodeInfo(task, seed, "", 10, toy.SCENE, toy.ROBOT))


def act(policy, index):
    return policy.act(Observation(index, "", toy.at_rest(), dict))


def test_the_actions_of_the_acting_part_are_given_again_and_then_it_holds_still(tmp_path):
    recorded(tmp_path / "a.rollout")
    policy = Replay(tmp_path)
    assert policy.tasks == ("OpenDrawer",)
    begin(policy)
    assert [act(policy, n)[0] for n in range(5)] == [1, 2, 3, 0, 0]
    assert act(policy, 4)[[6, 11]].tolist() == [1.0, -1.0]


@pytest.mark.parametrize(
    ("recorded_as", "wanted"), [(("fast", "fast"), "fast"), (("fast", "exact"), "exact")]
)
def test_it_is_simulated_as_its_recordings_were(tmp_path, recorded_as, wanted):
    for seed, stepping in enumerate(recorded_as):
        about = dataclasses.replace(OPENS, seed=seed, stepping=stepping)
        recorded(tmp_path / f"{seed}.rollout", about)
    assert Replay(tmp_path).stepping == wanted
    assert resolve(f"recording:{tmp_path}", {}).stepping == wanted


def test_an_episode_that_was_not_recorded_is_an_error_of_the_rollout(tmp_path):
    recorded(tmp_path / "a.rollout")
    with pytest.raises(RolloutError, match="there is no recording of OpenDrawer, seed 4"):
        begin(Replay(tmp_path), seed=4)


def test_a_folder_without_recordings_or_with_two_of_an_episode_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"no \*.rollout file is in there"):
        Replay(tmp_path)
    recorded(tmp_path / "a.rollout")
    recorded(tmp_path / "b.rollout", dataclasses.replace(OPENS, policy="other"))
    with pytest.raises(
        ConfigError, match=r"b\.rollout and .*a\.rollout have the same task and seed"
    ):
        Replay(tmp_path)


def test_a_broken_recording_is_no_policy(tmp_path):
    (tmp_path / "a.rollout").write_bytes(b"broken")
    with pytest.raises(ConfigError, match=r"a\.rollout: not a recording"):
        Replay(tmp_path)
    recorded(tmp_path / "a.rollout")
    policy = Replay(tmp_path)
    (tmp_path / "a.rollout").write_bytes(b"broken")
    with pytest.raises(TraceError, match=r"a\.rollout: not a recording"):
        begin(policy)
