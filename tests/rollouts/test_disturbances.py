"""What goes wrong between policy and simulator."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import CannotStage, ConfigError
from pytest_safemanip.rollouts import loop
from pytest_safemanip.rollouts.disturbances.of_actions import ActionNoise, Latency, Slip
from pytest_safemanip.rollouts.disturbances.of_observations import Calibration, DroppedFrames
from pytest_safemanip.rollouts.disturbances.pushing import Push
from pytest_safemanip.sim.robocasa.observation import EEF_POSITION, LEFT
from pytest_safemanip.trace import files
from tests import toy
from tests.rollouts.test_loop import Plays, job, ramp

GRIP = toy.ROBOT.actions.index("gripper_close")
MODE = toy.ROBOT.actions.index("control_mode")


def run(*disturbances, policy=None, world=None, repeat=0, **protocol):
    asked = dataclasses.replace(job(**protocol), disturbances=disturbances, repeat=repeat)
    world = world or toy.World()
    return loop.run(asked, world, policy or Plays()), world


class Counts:
    """Tells its calls by the first entry of its actions, and closes the hand."""

    def reset(self, episode):
        self.seed, self.seen, self.looked = episode.seed, [], []

    def act(self, observation):
        self.seen.append(observation.step)
        self.looked.append(observation.gym())
        action = np.zeros(toy.ACTION_SIZE)
        action[0], action[GRIP] = 0.01 * len(self.seen), 1.0
        return action


def test_what_is_late_is_done_later_and_the_robot_holds_still_until_then():
    _, world = run(Latency(0.1), policy=Counts())
    assert [round(a[0], 3) for a in world.actions[:5]] == [0.0, 0.0, 0.01, 0.02, 0.03]


def test_what_a_policy_asked_last_is_done_though_it_has_ended():
    policy = Plays(ramp(0.1, 0.2, 0.3))
    policy.done = False
    original = policy.act

    def act(observation):
        policy.done = True
        return original(observation)

    policy.act = act
    recording, world = run(Latency(0.1), policy=policy)
    assert [round(a[0], 3) for a in world.actions[:5]] == [0.0, 0.0, 0.1, 0.2, 0.3]
    assert recording.episode.ended == "policy"


def test_noise_spares_switches_and_is_as_strong_as_it_says():
    world = toy.World(horizon=2000)
    run(ActionNoise(0.1), policy=Plays(np.zeros(toy.ACTION_SIZE)), world=world)
    told = np.array(world.actions[:2000])
    assert (told[:, [GRIP, MODE]] == 0.0).all()
    moves = np.delete(told, [GRIP, MODE], axis=1)
    assert moves.std(axis=0) == pytest.approx(0.1, rel=0.25)
    lag = np.corrcoef(moves[:-1, 0], moves[1:, 0])[0, 1]
    assert 0.6 < lag < 0.85


def test_noise_is_the_same_again_and_another_in_a_repeat():
    first, again, other = (run(ActionNoise(0.1), repeat=n)[1] for n in (0, 0, 1))
    assert np.array_equal(first.actions, again.actions)
    assert not np.array_equal(first.actions, other.actions)


def test_a_repeat_has_the_same_episode_and_another_seed_for_the_policy():
    policies = [Counts(), Counts()]
    worlds = [run(policy=p, repeat=n)[1] for n, p in enumerate(policies)]
    assert worlds[0].requests == worlds[1].requests
    assert policies[0].seed == 0 != policies[1].seed


def test_fingers_open_once_for_a_moment_after_they_closed():
    _, world = run(Slip(0.15, 0.1), policy=Counts())
    assert [a[GRIP] for a in world.actions[:8]] == [1, 1, -1, -1, -1, 1, 1, 1]


def test_a_frame_that_is_dropped_is_the_last_that_arrived():
    policy = Counts()
    run(DroppedFrames(1.0), policy=policy)
    assert len({id(step) for step in policy.seen}) == 1
    assert {int(seen[LEFT][0, 0, 0]) for seen in policy.looked} == {0}
    policy = Counts()
    run(DroppedFrames(0.5), policy=policy, world=toy.World(horizon=200))
    fresh = len({id(step) for step in policy.seen})
    assert 70 < fresh < 130


def test_the_hand_seems_elsewhere_to_scripts_and_in_the_state_alike():
    true, wrong = Counts(), Counts()
    run(policy=true)
    recording, _ = run(Calibration((0.02, 0.0, 0.0)), policy=wrong)
    shift = wrong.seen[0].eef_poses[0] - true.seen[0].eef_poses[0]
    assert shift[:3] == pytest.approx((0.02, 0.0, 0.0), abs=1e-6)
    apart = wrong.looked[3][EEF_POSITION] - true.looked[3][EEF_POSITION]
    assert apart == pytest.approx((0.02, 0.0, 0.0))
    kept = recording.steps.eef_poses[0, 0] - true.seen[0].eef_poses[0]
    assert not kept.any()  # what is judged is where it was


class Pushed(toy.World):
    """Notes what pushes it, and when."""

    def reset(self, request):
        self.pushes = []
        return super().reset(request)

    def push(self, entity, force):
        self.pushes.append((len(self.actions), entity, *np.round(force, 6)))


def test_a_push_is_an_impulse_in_a_direction_of_the_base_at_its_time():
    _, world = run(Push("obj", 0.2, 0.15, 90.0), world=Pushed())
    assert world.pushes == [(3, "mug", 0, 2.0, 0), (4, "mug", 0, 2.0, 0)]
    _, world = run(Push("robot", 0.2, 0.0, 0.0), world=Pushed())
    assert world.pushes[0] == (0, "robot", 2.0, 0, 0)


def test_what_cannot_be_pushed_is_refused():
    with pytest.raises(CannotStage, match="no role 'objj'; did you mean 'obj'"):
        run(Push("objj", 0.2, 0.1, 0.0), world=Pushed())
    with pytest.raises(ConfigError, match="nothing can push mug in this simulator"):
        run(Push("obj", 0.2, 0.1, 0.0))


def test_a_recording_says_what_went_wrong_and_survives_its_file():
    recording, _ = run(Latency(0.1), Push("obj", 0.2, 0.1, 0.0), world=Pushed(), repeat=3)
    again = files.from_bytes(files.to_bytes(recording)).episode
    assert again.repeat == 3
    assert list(again.disturbances) == [
        {"kind": "latency", "seconds": 0.1},
        {"kind": "push", "target": "obj", "impulse": 0.2, "at": 0.1, "towards": 0.0},
    ]


class Idles(Counts):
    """Moves for ten steps."""

    def act(self, observation):
        action = np.zeros(toy.ACTION_SIZE)
        action[0] = 0.5 * (observation.index < 10)
        return action


def test_a_rollout_ends_when_nothing_has_moved_for_long_enough():
    recording, _ = run(policy=Idles(), world=toy.World(horizon=100), stall_s=1.0)
    assert recording.episode.ended == "stalled"
    assert recording.acting == 10 + 20 + 1
    whole, _ = run(policy=Idles(), world=toy.World(horizon=100))
    assert (whole.episode.ended, whole.acting) == ("horizon", 101)


def test_it_waits_for_what_is_still_to_come():
    push = Push("obj", 0.2, 3.0, 0.0)
    recording, world = run(push, policy=Idles(), world=Pushed(horizon=100), stall_s=1.0)
    assert (recording.episode.ended, recording.acting) == ("stalled", 63)
    assert len(world.pushes) == 2
