from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, RolloutError
from pytest_safemanip.policies.simple import Random
from pytest_safemanip.rollouts import loop as rollout
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.trace import files
from pytest_safemanip.trace.hazard import Hazard
from tests import toy
from tests.toy import ACTION_SIZE

REST_STEPS = round(rollout.REST_SECONDS / toy.DT)
TAIL_STEPS = round(rollout.TAIL_SECONDS / toy.DT)


class Plays:
    """Plays back what it is given, the last answer again and again."""

    def __init__(self, *answers):
        self.answers = answers or (np.zeros(ACTION_SIZE),)
        self.episodes, self.seen = [], []

    def reset(self, episode):
        self.episodes.append(episode)

    def act(self, observation):
        answer = self.answers[min(len(self.seen), len(self.answers) - 1)]
        self.seen.append(observation)
        if isinstance(answer, Exception):
            raise answer
        return answer


def job(seed=0, **protocol):
    return rollout.Job(
        "PickPlaceCounterToCabinet",
        "plays",
        Request("PickPlaceCounterToCabinet", seed, "compact"),
        rollout.Protocol(**protocol),
        {"policy": "p", "key": "k"},
    )


def run(world=None, policy=None, seed=0, **protocol):
    return rollout.run(job(seed, **protocol), world or toy.World(), policy or Plays())


def ramp(*values):
    """Actions that can be told apart by their first entry."""
    actions = np.zeros((len(values), ACTION_SIZE))
    actions[:, 0] = values
    return actions


def test_a_rollout_ends_at_the_first_successful_step():
    recording = run(toy.World(succeeds_at=4))
    assert (recording.acting, recording.success) == (5, True)
    assert recording.episode.ended == "success"


def test_or_goes_on_to_the_horizon_if_that_is_asked_for():
    recording = run(toy.World(succeeds_at=4), stop="horizon")
    assert (recording.acting, recording.success) == (11, True)
    assert recording.episode.ended == "horizon"


class Watcher:
    """Ends a rollout at an unsafe step, or before an action; keeps what it was told."""

    def __init__(self, at=None, before=None):
        self.at, self.before, self.told, self.asked = at, before, [], []

    def __call__(self, scene, robot):
        return self

    def unsafe(self, step, action):
        self.told.append(action)
        return len(self.told) - 1 == self.at

    def warns(self, action, before):
        self.asked.append((action, len(before)))
        return f"near {len(before)}" if len(before) == self.before else ""


def watched(at):
    watch = Watcher(at)
    return watch, watch.told


@pytest.mark.parametrize(("at", "acting"), [(3, 4), (0, 2)])
def test_a_watched_rollout_ends_at_its_first_unsafe_step_and_is_watched_until_it_rests(at, acting):
    watch, told = watched(at)
    watching = dataclasses.replace(job(stop="violation"), watch=watch)
    recording = rollout.run(watching, toy.World(rests_from=20), Plays())
    assert (recording.acting, recording.episode.ended) == (acting, "violation")
    assert len(recording.steps) - 1 == 19 + REST_STEPS
    assert [action is None for action in told] == [True] + [False] * (acting - 1)


def test_a_watched_rollout_that_stays_safe_ends_at_success():
    watch, _ = watched(None)
    watching = dataclasses.replace(job(stop="violation"), watch=watch)
    recording = rollout.run(watching, toy.World(succeeds_at=4), Plays())
    assert (recording.acting, recording.episode.ended) == (5, "success")


@pytest.mark.parametrize("before", [0, 3])
def test_the_action_that_is_warned_of_is_not_taken_and_the_robot_holds_still_instead(before):
    watch, world = Watcher(before=before), toy.World(rests_from=0)
    watching = dataclasses.replace(job(stop="warning"), watch=watch)
    recording = rollout.run(watching, world, Plays())
    assert (recording.acting, recording.episode.ended) == (before + 1, "warning")
    assert recording.episode.warned == f"near {before}"
    assert [count for _, count in watch.asked] == list(range(before + 1))
    taken = [action.tolist() for action in world.actions]
    assert taken[:before] == [action.tolist() for action, _ in watch.asked[:before]]
    assert len(recording.steps) - recording.acting == REST_STEPS


def test_without_success_it_ends_at_the_horizon():
    recording = run(toy.World(horizon=7))
    assert (recording.acting, recording.success) == (8, False)
    assert (recording.episode.ended, recording.episode.horizon) == ("horizon", 7)


@pytest.mark.parametrize(("scale", "steps"), [(0.5, 5), (2.0, 20), (0.01, 1)])
def test_the_horizon_is_scaled_and_at_least_one_step(scale, steps):
    policy = Plays()
    recording = run(policy=policy, horizon_scale=scale)
    assert recording.acting - 1 == recording.episode.horizon == steps
    assert policy.episodes[0].horizon == steps


def test_a_scene_at_rest_is_watched_for_half_a_second():
    recording = run(toy.World(rests_from=0))
    assert len(recording.steps) - recording.acting == REST_STEPS


def test_the_tail_lasts_until_everything_has_been_at_rest_for_half_a_second():
    recording = run(toy.World(rests_from=20))
    assert len(recording.steps) - 1 == 19 + REST_STEPS
    assert recording.steps.tail.tolist() == [False] * 11 + [True] * (19 + REST_STEPS - 10)


def test_a_scene_that_never_rests_is_watched_for_five_seconds():
    recording = run(toy.World(rests_from=None))
    assert len(recording.steps) - recording.acting == TAIL_STEPS


@pytest.mark.parametrize(("gripper", "mode"), [(1.0, -1.0), (-1.0, -1.0), (1.0, 1.0)])
def test_the_robot_holds_still_in_the_tail_with_its_hand_as_it_was(gripper, mode):
    action = np.full(ACTION_SIZE, 0.5)
    action[6], action[11] = gripper, mode
    world = toy.World(horizon=3)
    run(world, Plays(action))
    tail = np.array(world.actions[3:])
    assert len(tail) == REST_STEPS
    assert (tail[:, 6] == gripper).all()
    # In base mode the arm keeps its goal, which it has once it was moved in arm mode.
    assert (tail[:, 11] == (1.0 if mode < 0 else -1.0)).all()
    assert not np.delete(tail, (6, 11), axis=1).any()


def test_success_in_the_tail_is_no_success():
    recording = run(toy.World(succeeds_at=12, horizon=10))
    assert recording.steps.success.any()
    assert not recording.success


def test_a_chunk_is_executed_whole_before_the_policy_is_asked_again():
    policy = Plays(ramp(0.1, 0.2, 0.3), ramp(0.4, 0.5), ramp(0.6)[0])
    world = toy.World(horizon=7)
    recording = run(world, policy)
    assert [o.index for o in policy.seen] == [0, 3, 5, 6]
    played = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.6]
    assert [a[0] for a in world.actions[:7]] == played
    assert recording.steps.action[1:8, 0].tolist() == np.float32(played).tolist()
    assert not recording.steps.action[0].any()


def test_the_policy_is_not_asked_for_more_when_the_rollout_has_ended():
    answers = [FINE, FINE, ValueError("asked once too often")]
    assert run(toy.World(horizon=2), Plays(*answers)).acting == 3
    assert run(toy.World(succeeds_at=2), Plays(*answers)).acting == 3


def test_the_rest_of_a_chunk_is_dropped_at_the_end():
    for world in (toy.World(succeeds_at=2), toy.World(horizon=2)):
        recording = run(world, Plays(ramp(*np.linspace(0.1, 0.9, 9))))
        assert recording.acting == 3


def test_the_policy_sees_the_state_after_its_last_action():
    policy = Plays(ramp(1.0)[0])
    run(toy.World(horizon=3), policy)
    assert [o.step.eef_pose[0] for o in policy.seen] == pytest.approx([0.0, 0.05, 0.10])
    assert {o.instruction for o in policy.seen} == {"put it there"}


def test_seed_task_and_scene_reach_backend_and_policy():
    world, policy = toy.World(), Plays()
    recording = run(world, policy, seed=7)
    assert [(r.task, r.seed, r.scenes) for r in world.requests] == [
        ("PickPlaceCounterToCabinet", 7, "compact")
    ]
    (told,) = policy.episodes
    assert (told.task, told.seed, told.scene) == ("PickPlaceCounterToCabinet", 7, toy.SCENE)
    episode = recording.episode
    assert (episode.seed, episode.policy, episode.instruction) == (7, "plays", "put it there")
    assert episode.hashes == {"backend": "abc", "policy": "p", "key": "k", "start": "seed 7"}
    assert episode.patches == toy.PATCHES
    assert (episode.scenes, episode.stepping) == ("compact", "exact")
    assert (episode.backend, episode.assets, episode.versions) == ("toy", "primitive", {"toy": "1"})


def test_actions_out_of_range_are_clipped_before_they_are_executed():
    world = toy.World()
    recording = run(world, Plays(np.linspace(-3.0, 3.0, ACTION_SIZE)))
    executed = np.array(world.actions[:10])
    assert executed.min() == -1.0
    assert executed.max() == 1.0
    assert np.array_equal(recording.steps.action[1:11], executed.astype(np.float32))
    # Four entries on each side; of a chunk, those that were executed count.
    assert recording.episode.served == {"clipped": "80", "entries": "12"}
    chunk = run(toy.World(succeeds_at=2), Plays(ramp(0.5, 2.0, 3.0, 4.0)))
    assert chunk.episode.served == {"clipped": "1", "entries": "12"}
    assert run().episode.served == {}


class Tensor:
    """Refuses to be converted, as a tensor of torch that requires gradients does."""

    def __array__(self, dtype=None, copy=None):
        raise RuntimeError("Tensor that requires grad")


FINE = np.zeros(ACTION_SIZE)
HOLE = np.zeros((3, ACTION_SIZE))
HOLE[1, 6] = np.nan


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (np.zeros(7), "step 2: the action has shape (7,), expected (12,) or (H, 12): return"),
        (np.zeros((2, 7)), "step 2: the action has shape (2, 7)"),
        (np.zeros((0, ACTION_SIZE)), "step 2: the action has shape (0, 12)"),
        (np.zeros((1, 1, ACTION_SIZE)), "step 2: the action has shape (1, 1, 12)"),
        (np.zeros(()), "step 2: the action has shape ()"),
        (HOLE, "step 2: action[1, 6] (gripper_close) is not finite"),
        (
            np.full(ACTION_SIZE, np.inf),
            "step 2: action[0, 0] (end_effector_position_x) is not finite",
        ),
        (None, "step 2: the action is not an array of numbers (it has the type object)"),
        ("forward", "step 2: the action is not an array"),
        ({"arm": [0.0]}, "step 2: the action is not an array"),
        ([[0.0] * 12, [0.0]], "step 2: the action is not an array"),
        (["0.5"] * 12, "step 2: the action is not an array of numbers (it has the type <U3)"),
        (np.full(12, 0.5j), "(it has the type complex128)"),
        (np.zeros(12, "m8[s]"), "(it has the type timedelta64[s])"),
        (np.ma.masked_all(12), "(it has masked entries)"),
        ([10**400] * 12, "step 2: the action is not an array of numbers"),
        (Tensor(), "step 2: the action is not an array: RuntimeError: Tensor that requires grad"),
        (np.broadcast_to(FINE, (2_000_000_000, 12)), "in a row, at most 10000"),
        (ValueError("out of memory"), "the policy failed at step 2: ValueError: out of memory"),
        (KeyError("arm"), "the policy failed at step 2: KeyError: 'arm'"),
        (RolloutError("the server is gone"), "the server is gone"),
    ],
)
def test_an_answer_that_is_no_action_ends_the_rollout_with_the_step(answer, message):
    with pytest.raises(RolloutError) as caught:
        run(policy=Plays(FINE, FINE, answer))
    assert message in str(caught.value)


def test_what_the_policy_raised_is_kept_as_the_cause():
    error = ValueError("weights")
    with pytest.raises(RolloutError) as caught:
        run(policy=Plays(error))
    assert caught.value.__cause__ is error


def test_a_policy_that_fails_at_reset_is_an_error_of_the_rollout():
    policy = Plays()
    policy.reset = lambda episode: 1 / 0
    with pytest.raises(RolloutError, match="the policy failed at reset: ZeroDivisionError"):
        run(policy=policy)


def test_a_policy_that_cannot_do_the_task_says_so_itself():
    with pytest.raises(ConfigError, match="no plan"):
        run(policy=Plays(ConfigError("no plan")))


@pytest.mark.parametrize("step", [3, 12])
def test_a_simulator_that_fails_ends_the_rollout_also_in_the_tail(step):
    with pytest.raises(RolloutError, match=f"the simulator broke at step {step}"):
        run(toy.World(fails_at=step))


def test_an_impossible_state_is_never_recorded():
    class Breaks(toy.World):
        def step(self, action):
            state = super().step(action)
            if len(self.actions) == 4:
                state.object_pose[0, 2] = np.nan
            return state

    with pytest.raises(Exception, match="object_pose: not finite at step 4 of 'mug'"):
        run(Breaks())


def test_progress_is_told_before_the_first_action_and_after_every_step():
    told = []
    rollout.run(job(), toy.World(horizon=3), Plays(), lambda *now: told.append(now))
    assert told == [(0, 3), (1, 3), (2, 3), (3, 3)]


def test_the_same_seed_gives_the_same_bytes_whatever_ran_before():
    world = toy.World()
    first = files.to_bytes(run(world, Random(), seed=3))
    other = files.to_bytes(run(world, Random(), seed=4))
    assert files.to_bytes(run(world, Random(), seed=3)) == first
    assert files.to_bytes(run(toy.World(), Random(), seed=3)) == first
    assert other != first


class Knows(Plays):
    """Is done after some steps, and knows what it did wrong."""

    def __init__(self, done_after):
        super().__init__()
        self._done_after = done_after
        self.hazards = (Hazard("collision_contact", (), 1, 2),)

    @property
    def done(self):
        return len(self.seen) >= self._done_after


def test_a_policy_that_is_done_ends_the_acting_part():
    recording = run(policy=Knows(3))
    assert (recording.acting, recording.success) == (4, False)
    assert recording.episode.ended == "policy"
    assert len(recording.steps) > recording.acting


def test_it_goes_on_to_the_horizon_where_that_is_asked_for():
    recording = run(policy=Knows(3), stop="horizon")
    assert (recording.acting, recording.episode.ended) == (11, "horizon")


def test_success_with_the_last_step_of_a_policy_is_success():
    recording = run(toy.World(succeeds_at=3), Knows(3))
    assert (recording.acting, recording.episode.ended) == (4, "success")


def test_the_horizon_comes_before_a_policy_that_is_never_done():
    assert run(policy=Knows(99)).episode.ended == "horizon"


def test_hazards_that_a_policy_knows_are_kept():
    assert run(policy=Knows(3)).episode.hazards == (Hazard("collision_contact", (), 1, 2),)
    assert run().episode.hazards == ()
