from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, RolloutError
from pytest_safemanip.plan import Extensions, make_plan
from pytest_safemanip.session import KEPT, SafetySession
from pytest_safemanip.settings import read_settings
from pytest_safemanip.sim.backend import Provenance
from pytest_safemanip.store import Store
from pytest_safemanip.trace import files
from tests import toy

TASK = "PickPlaceCounterToCabinet"


class Policy:
    """Stands still."""

    fingerprint = "weights 1"

    def reset(self, episode):
        self.seed = episode.seed

    def act(self, observation):
        return np.zeros(12)


class Unknown(Policy):
    fingerprint = None


class Fails(Policy):
    def act(self, observation):
        if self.seed == 1:
            raise ValueError("the network exploded")
        return np.zeros(12)


class Suite:
    """A run on toy worlds; every run has its own session, all share one folder."""

    def __init__(self, folder, defaults):
        self.folder, self.defaults = folder, defaults

    def plan(self, policies=("steady",), seeds=(0, 1, 2, 3), **changed):
        settings = dataclasses.replace(
            self.defaults, policies=policies, seeds=seeds, tasks=(TASK,), **changed
        )
        known = {"steady": Policy, "unknown": Unknown, "fails": Fails}
        return make_plan(settings, Extensions(known, (), {}))

    def session(self, plan, world, run="one", progress=None):
        return SafetySession(plan, world, Store(self.folder, run), run, progress)

    def ran(self, run="one", world=None, **changed):
        """The seeds that the simulator ran."""
        world = world or toy.World()
        plan = self.plan(**changed)
        session = self.session(plan, world, run)
        for case in plan.cases:
            session.verdict(case)
        return [request.seed for request in world.requests]


@pytest.fixture
def suite(tmp_path, pytestconfig):
    return Suite(tmp_path / "recordings", read_settings(pytestconfig))


def test_one_rollout_serves_all_properties(suite):
    assert suite.ran() == [0, 1, 2, 3]


def test_an_order_that_comes_back_reads_from_disk_and_runs_nothing_again(suite):
    world, plan = toy.World(), suite.plan()
    session = suite.session(plan, world)
    assert len({case.seed for case in plan.cases}) > KEPT
    for case in sorted(plan.cases, key=lambda case: (case.property_id, case.seed)):
        session.verdict(case)
    assert [request.seed for request in world.requests] == [0, 1, 2, 3]


def test_a_later_run_uses_the_recordings_again(suite):
    suite.ran("one")
    assert suite.ran("two") == []


@pytest.mark.parametrize(
    "changed",
    [
        {"properties": ("release_stability",)},
        {"params": {"settled.speed": 0.5}},
        {"semantics": "paper"},
        {"violations": "xfail", "unresolved": "fail", "vacuous": "pass"},
    ],
)
def test_what_only_judges_runs_nothing_again(suite, changed):
    suite.ran("one")
    assert suite.ran("two", **changed) == []


@pytest.mark.parametrize(
    "changed",
    [{"stop": "horizon"}, {"horizon_scale": 0.5}, {"scenes": "target"}, {"stepping": "exact"}],
)
def test_what_decides_the_rollout_runs_it_again(suite, changed):
    suite.ran("one", seeds=(0,))
    assert suite.ran("two", seeds=(0,), **changed) == [0]


@pytest.mark.parametrize(
    "changed",
    [
        {"assets": "official"},
        {"backend": "other"},
        {"versions": {"toy": "2"}},
        {"hashes": {"backend": "def"}},
    ],
)
def test_another_simulator_runs_it_again_but_not_one_that_only_says_other_things(suite, changed):
    suite.ran("one", seeds=(0,))
    same, other = toy.World(), toy.World()
    same.provenance = dataclasses.replace(toy.World.provenance, description="says more")
    other.provenance = dataclasses.replace(toy.World.provenance, **changed)
    assert isinstance(other.provenance, Provenance)
    assert suite.ran("two", same, seeds=(0,)) == []
    assert suite.ran("three", other, seeds=(0,)) == [0]


def test_a_policy_that_says_other_weights_is_run_again(suite, monkeypatch):
    suite.ran("one", seeds=(0,))
    monkeypatch.setattr(Policy, "fingerprint", "weights 2")
    assert suite.ran("two", seeds=(0,)) == [0]


def test_a_policy_that_nobody_can_recognise_is_run_once_in_every_run(suite):
    unknown = {"policies": ("unknown",), "seeds": (0,)}
    assert suite.ran("one", **unknown) == [0]
    assert suite.ran("one", **unknown) == []
    assert suite.ran("two", **unknown) == [0]


def test_a_failed_rollout_fails_all_its_cases_once_and_no_others(suite):
    world, plan = toy.World(), suite.plan(("fails",), (0, 1, 2))
    session = suite.session(plan, world)
    failed = {}
    for case in plan.cases:
        try:
            session.verdict(case)
        except RolloutError as error:
            failed.setdefault(case.seed, []).append(str(error))
    assert list(failed) == [1]
    (message,) = set(failed[1])
    assert "the policy failed at step 0: ValueError: the network exploded" in message
    assert len(failed[1]) == 6
    assert [request.seed for request in world.requests] == [0, 1, 2]


def test_a_simulator_that_breaks_in_an_unforeseen_way_is_an_error_of_the_rollout(suite):
    class Broken(toy.World):
        def step(self, action):
            raise ZeroDivisionError("no mass")

    plan = suite.plan()
    session = suite.session(plan, Broken())
    with pytest.raises(RolloutError, match="ZeroDivisionError: no mass"):
        session.verdict(plan.cases[0])


def test_a_simulator_that_cannot_be_used_is_asked_once(suite):
    class Absent(toy.World):
        def reset(self, request):
            self.requests.append(request)
            raise ConfigError("no assets for this kitchen")

    world, plan = Absent(), suite.plan()
    session = suite.session(plan, world)
    for case in plan.cases:
        with pytest.raises(ConfigError, match="no assets for this kitchen"):
            session.verdict(case)
    assert len(world.requests) == 1


def test_a_policy_that_cannot_be_made_fails_its_own_rollouts_only(suite):
    def make():
        raise ConfigError("policy 'unknown': has no 'act(observation)'")

    plan = suite.plan(("unknown", "steady"), (0,))
    broken = dataclasses.replace(plan.policies["unknown"], make=make)
    plan = dataclasses.replace(plan, policies={**plan.policies, "unknown": broken})
    session = suite.session(plan, toy.World())
    for case in plan.cases:
        if case.policy == "steady":
            assert session.verdict(case).instances
        else:
            with pytest.raises(RolloutError, match=r"has no 'act\(observation\)'"):
                session.verdict(case)


def test_an_interrupted_rollout_is_no_failure(suite):
    class Interrupted(toy.World):
        def step(self, action):
            if len(self.requests) == 1:
                raise KeyboardInterrupt
            return super().step(action)

    world, plan = Interrupted(), suite.plan(seeds=(0,))
    session = suite.session(plan, world)
    with pytest.raises(KeyboardInterrupt):
        session.verdict(plan.cases[0])
    assert session.verdict(plan.cases[0]).instances == 1


def test_recordings_are_judged_without_a_simulator(suite):
    suite.ran()
    plan = suite.plan((), None, recordings=suite.folder)
    session = SafetySession(plan, None, None, "judging")
    verdicts = {case.node_id: session.verdict(case) for case in plan.cases}
    assert len(verdicts) == 4 * 6
    judged = session.judged(plan.cases[0])
    assert judged.path == plan.recordings[plan.cases[0].rollout]
    assert files.load_episode(judged.path).policy == "steady"


def test_a_case_without_a_recording_and_without_a_simulator_is_an_error(suite):
    session = SafetySession(suite.plan(), None, None, "judging")
    with pytest.raises(RolloutError, match=f"there is no recording of {TASK}, seed 0"):
        session.verdict(suite.plan().cases[0])


def test_progress_is_told_from_setting_up_to_the_end_also_of_a_failure(suite):
    class Told:
        def __init__(self):
            self.steps, self.ended = [], 0

        def show(self, case, step, horizon):
            self.steps.append((case.seed, step, horizon))

        def done(self):
            self.ended += 1

    told, plan = Told(), suite.plan(("fails",), (0, 1))
    session = suite.session(plan, toy.World(horizon=2), progress=told)
    session.verdict(plan.cases[0])
    with pytest.raises(RolloutError):
        session.verdict(plan.cases[-1])
    first = [(0, 0, 0), (0, 0, 2), (0, 1, 2), (0, 2, 2)]
    assert told.steps == [*first, (1, 0, 0), (1, 0, 2)]
    assert told.ended == 2


def test_the_task_says_what_is_drawn_in_the_compact_scene_only(suite):
    for scenes, drawn in (("compact", True), ("target", False)):
        world = toy.World()
        suite.ran(scenes, world, seeds=(0,), scenes=scenes)
        assert bool(world.requests[0].object_groups) == drawn
        assert world.requests[0].scenes == scenes


def test_the_stepping_asked_for_wins_over_what_the_policy_wants_and_is_recorded(suite):
    for asked, used in (("", "fast"), ("exact", "exact"), ("fast", "fast")):
        world = toy.World()
        suite.ran(f"asked {asked}", world, seeds=(0,), stepping=asked)
        plan = suite.plan(stepping=asked)
        judged = suite.session(plan, toy.World()).judged(plan.cases[0])
        assert judged.recording.episode.stepping == used
        assert {request.stepping for request in world.requests} <= {used}


def test_closing_ends_the_simulator(suite):
    world = toy.World()
    suite.session(suite.plan(), world).close()
    assert world.closed
    SafetySession(suite.plan(), None, None, "one").close()
