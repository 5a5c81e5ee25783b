from __future__ import annotations

import dataclasses
import threading
import time

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, PolicyUnreachable, RolloutError, TraceError
from pytest_safemanip.metrics.records import RolloutKey
from pytest_safemanip.plugin.read_settings import read_settings
from pytest_safemanip.rollouts.store import Store
from pytest_safemanip.run.plan import Extensions, make_plan
from pytest_safemanip.run.remembered import KEPT, RecentRollouts, RepeatedFailures
from pytest_safemanip.run.session import SafetySession
from pytest_safemanip.sim.backend import Provenance
from pytest_safemanip.sim.staging import Fill
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


class ByTask(Policy):
    weights = "1"

    def fingerprint_in(self, task):
        return f"weights {self.weights} of {task}"


class Fails(Policy):
    def act(self, observation):
        if self.seed == 1:
            raise ValueError("the network exploded")
        return np.zeros(12)


class Suite:
    """A run on toy worlds; every run has its own session, all share one folder."""

    def __init__(self, folder, defaults):
        self.folder, self.defaults = folder, defaults
        self.known = {"steady": Policy, "unknown": Unknown, "fails": Fails, "by_task": ByTask}

    def plan(self, policies=("steady",), seeds=(0, 1, 2, 3), **changed):
        settings = dataclasses.replace(
            self.defaults, policies=policies, seeds=seeds, tasks=(TASK,), **changed
        )
        return make_plan(settings, Extensions(self.known, (), {}))

    def session(self, plan, world, run="one", progress=None, more=None):
        return SafetySession(plan, world, Store(self.folder, run), run, progress, more)

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


def test_a_policy_that_says_other_weights_in_a_task_is_run_again_in_it(suite, monkeypatch):
    chosen = {"policies": ("by_task",), "seeds": (0,)}
    assert suite.ran("one", **chosen) == [0]
    monkeypatch.setattr(ByTask, "fingerprint", "other weights, of other tasks")
    assert suite.ran("two", **chosen) == []
    monkeypatch.setattr(ByTask, "weights", "2")
    assert suite.ran("three", **chosen) == [0]


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
    found = session.evaluate(plan.cases[0])
    assert found.path == plan.recordings[plan.cases[0].rollout]
    assert files.load_episode(found.path).policy == "steady"


def test_a_case_without_a_recording_and_without_a_simulator_is_an_error(suite):
    session = SafetySession(suite.plan(), None, None, "judging")
    with pytest.raises(RolloutError, match=f"there is no recording of {TASK}, seed 0"):
        session.verdict(suite.plan().cases[0])


def test_progress_is_told_from_setting_up_to_the_end_also_of_a_failure(suite):
    class Told:
        def __init__(self):
            self.steps, self.ended = [], 0

        def show(self, case, step, horizon, rehearsed=None):
            self.steps.append((case.seed, step, horizon))

        def done(self, case):
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


def test_what_a_task_has_liquids_in_is_filled_before_the_episode(suite):
    world, plan = toy.World(), suite.plan(seeds=(0,))
    task = dataclasses.replace(plan.tasks[TASK], liquids={"water": "obj"})
    suite.session(dataclasses.replace(plan, tasks={TASK: task}), world).verdict(plan.cases[0])
    assert world.requests[0].changes == (Fill("water", "obj"),)


def test_the_stepping_asked_for_wins_over_what_the_policy_wants_and_is_recorded(suite):
    for asked, used in (("", "fast"), ("exact", "exact"), ("fast", "fast")):
        world = toy.World()
        suite.ran(f"asked {asked}", world, seeds=(0,), stepping=asked)
        plan = suite.plan(stepping=asked)
        found = suite.session(plan, toy.World()).evaluate(plan.cases[0])
        assert found.recording.episode.stepping == used
        assert {request.stepping for request in world.requests} <= {used}


def test_closing_leaves_the_simulator_to_whoever_made_it(suite):
    world = toy.World()
    suite.session(suite.plan(), world).close()
    assert not world.closed


def test_a_rollout_is_made_again_only_when_newer_ones_have_taken_its_place():
    recent, made = RecentRollouts(2), []

    def get(seed):
        return recent.get(RolloutKey("p", "T", seed), lambda: made.append(seed) or seed)

    assert [get(seed) for seed in (0, 0, 1, 0, 2, 1, 2, 0)] == [0, 0, 1, 0, 2, 1, 2, 0]
    assert made == [0, 1, 2, 0]


def test_what_could_not_be_made_is_not_kept():
    recent, key = RecentRollouts(), RolloutKey("p", "T", 0)

    def fail():
        raise RolloutError("the gripper is stuck")

    with pytest.raises(RolloutError):
        recent.get(key, fail)
    assert recent.get(key, lambda: "made") == "made"


ONE, OTHER = RolloutKey("p", "T", 0), RolloutKey("p", "T", 1)
HERE, THERE = "tcp://here:1", "tcp://there:1"


@pytest.mark.parametrize(
    ("error", "repeated", "spared"),
    [
        (ConfigError("no assets"), [(ONE, HERE), (OTHER, HERE), (OTHER, THERE), (OTHER, "")], []),
        (PolicyUnreachable("nobody answers"), [(ONE, HERE), (OTHER, HERE)], [(OTHER, THERE)]),
        (RolloutError("it exploded"), [(ONE, HERE)], [(OTHER, HERE), (OTHER, THERE)]),
        (TraceError("it is damaged"), [(ONE, HERE)], [(OTHER, HERE), (OTHER, THERE)]),
    ],
)
def test_a_failure_is_met_again_by_those_that_would_fail_alike(error, repeated, spared):
    failures = RepeatedFailures()
    for rollout, server in repeated + spared:
        failures.check(rollout, server)
    failures.add(error, ONE, HERE)
    for rollout, server in repeated:
        with pytest.raises((ConfigError, RolloutError), match=str(error)) as again:
            failures.check(rollout, server)
        assert isinstance(again.value, ConfigError) == isinstance(error, ConfigError)
    for rollout, server in spared:
        failures.check(rollout, server)


def test_an_error_is_fatal_if_no_other_case_can_be_run(suite):
    plan = suite.plan(("steady", "fails"), (0,))
    for name, server in (("steady", HERE), ("fails", THERE)):
        served = dataclasses.replace(plan.policies[name], server=lambda task, sets, at=server: at)
        plan = dataclasses.replace(plan, policies={**plan.policies, name: served})

    class Unreachable(toy.World):
        def reset(self, request):
            raise PolicyUnreachable("nobody answers")

    plan = dataclasses.replace(
        plan, settings=dataclasses.replace(plan.settings, out=suite.folder / "out")
    )
    session = suite.session(plan, Unreachable())
    fatal = {}
    for case in plan.cases:
        with pytest.raises(RolloutError) as met:
            session.evaluate(case)
        fatal.setdefault(case.policy, session.is_fatal(met.value))
    assert fatal == {"steady": False, "fails": True}
    assert session.is_fatal(ConfigError("no assets"))
    assert not session.is_fatal(RolloutError("it exploded"))


class Draws(Policy):
    """Random, of its own generator."""

    def reset(self, episode):
        self.random = np.random.default_rng(episode.seed)

    def act(self, observation):
        return self.random.uniform(-1.0, 1.0, 12)


class Lonely(Policy):
    """One object for all rollouts: it must not be in two at a time."""

    def __init__(self):
        self.inside, self.most = 0, 0

    def reset(self, episode):
        self.left = 5

    def act(self, observation):
        self.inside += 1
        self.most = max(self.most, self.inside)
        time.sleep(0.002)
        self.inside -= 1
        self.left -= 1
        return np.full(12, 0.1 * self.left)


class SideBySide:
    """A run with several toy worlds."""

    def __init__(self, suite, policies, jobs, progress=None):
        self.worlds = [toy.World()]
        self.plan = suite.plan(policies, tuple(range(6)), jobs=jobs)
        self.session = suite.session(self.plan, self.worlds[0], "one", progress, self._another)

    def _another(self):
        self.worlds.append(toy.World())
        return self.worlds[-1]

    def outcomes(self, cases=None):
        cases = self.plan.cases if cases is None else cases
        self.session.expect(cases)
        found = {}
        for case in cases:
            try:
                found[case] = self.session.verdict(case).outcome.label
            except RolloutError as error:
                found[case] = str(error)
        self.session.close()
        return found

    def ran(self):
        return sorted(request.seed for world in self.worlds for request in world.requests)


@pytest.mark.parametrize("jobs", [2, 5])
def test_side_by_side_verdicts_and_recordings_are_those_of_one_after_the_other(
    suite, tmp_path, jobs
):
    both = ("steady", "draws")
    suite.known["draws"] = Draws
    one = SideBySide(suite, both, 1)
    verdicts = one.outcomes()
    before = {path.name: path.read_bytes() for path in suite.folder.glob("*.rollout")}
    assert len(before) == 12
    assert len(one.worlds) == 1
    suite.folder = tmp_path / "again"
    beside = SideBySide(suite, both, jobs)
    assert beside.outcomes() == verdicts
    assert len(beside.worlds) <= jobs
    assert beside.ran() == sorted([*range(6)] * 2)
    after = {path.name: path.read_bytes() for path in suite.folder.glob("*.rollout")}
    assert after == before


class Meets(Policy):
    """Acts once two rollouts are under way."""

    def __init__(self, barrier):
        self.barrier = barrier

    def act(self, observation):
        self.barrier.wait(10.0)
        return np.zeros(12)


def test_side_by_side_two_rollouts_are_under_way_at_once(suite):
    barrier = threading.Barrier(2)
    suite.known["meets"] = lambda: Meets(barrier)
    run = SideBySide(suite, ("meets",), 2)
    assert set(run.outcomes().values()) <= {"SATISFIED", "VACUOUS"}
    assert len(run.worlds) == 2


def test_side_by_side_a_rollout_that_fails_fails_its_own_cases_only(suite):
    found = SideBySide(suite, ("fails",), 3).outcomes()
    failed = {case.seed for case, outcome in found.items() if "exploded" in outcome}
    assert failed == {1}
    assert {case.seed for case in found} == set(range(6))


def test_side_by_side_only_what_was_selected_is_run(suite):
    run = SideBySide(suite, ("steady",), 3)
    run.outcomes([case for case in run.plan.cases if case.seed in (1, 4)])
    assert run.ran() == [1, 4]


def test_side_by_side_what_an_earlier_run_recorded_is_not_run_again(suite):
    suite.ran("before", seeds=(0, 1, 2))
    run = SideBySide(suite, ("steady",), 3)
    run.outcomes()
    assert run.ran() == [3, 4, 5]


def test_side_by_side_one_object_is_in_one_rollout_at_a_time(suite):
    lonely = Lonely()
    suite.known["lonely"] = lonely
    run = SideBySide(suite, ("lonely",), 3)
    assert set(run.outcomes().values()) <= {"VACUOUS", "SATISFIED", "VIOLATED"}
    assert lonely.most == 1
    assert len(run.worlds) == 1


def test_side_by_side_a_factory_that_gives_one_object_to_two_rollouts_is_refused(suite):
    only = Lonely()
    suite.known["lonely"] = lambda: only
    run = SideBySide(suite, ("lonely",), 3)
    refused = {
        outcome for outcome in run.outcomes().values() if "another rollout is using" in outcome
    }
    assert refused == {
        "policy 'lonely': what makes it gave the object that another rollout is using; "
        "make one for each rollout, or name the object itself"
    }
    assert only.most == 1


def test_side_by_side_a_simulator_that_cannot_be_used_is_not_tried_for_every_rollout(suite):
    class Absent(toy.World):
        def reset(self, request):
            self.requests.append(request)
            raise ConfigError("no assets for this kitchen")

    world, plan = Absent(), suite.plan(seeds=tuple(range(9)), jobs=2)
    session = suite.session(plan, world, more=lambda: world)
    session.expect(plan.cases)
    for case in plan.cases:
        with pytest.raises(ConfigError, match="no assets for this kitchen"):
            session.verdict(case)
    session.close()
    assert len(world.requests) <= 3


def test_side_by_side_ctrl_c_leaves_the_rollouts_unknown_and_keeps_what_was_recorded(suite):
    class Told:
        def expect(self, rollouts, jobs):
            self.expected = rollouts, jobs

        def show(self, case, step, horizon, rehearsed=None):
            time.sleep(0.01)

        def done(self, case):
            self.ended = case

        def refresh(self, waiting):
            if list(suite.folder.glob("*.rollout")):
                raise KeyboardInterrupt

    run = SideBySide(suite, ("steady",), 2, progress=Told())
    with pytest.raises(KeyboardInterrupt):
        run.outcomes()
    run.session.close()
    assert 1 <= len(list(suite.folder.glob("*.rollout"))) <= 3
    again = SideBySide(suite, ("steady",), 2)
    assert set(again.outcomes().values()) <= {"VACUOUS", "SATISFIED", "VIOLATED"}
    assert {*again.ran()} >= {3, 4, 5}


@pytest.mark.parametrize(
    ("jobs", "slots", "rollouts", "used"),
    [(1, 0, 9, 1), (4, 0, 9, 4), (4, 0, 3, 3), (None, 0, 99, 2), (None, 3, 99, 5), (4, 0, 0, 1)],
)
def test_as_many_rollouts_side_by_side_as_are_asked_for_or_are_of_use(
    suite, monkeypatch, jobs, slots, rollouts, used
):
    monkeypatch.setattr("os.sched_getaffinity", lambda pid: {0, 1})
    plan = suite.plan(jobs=jobs)
    served = dataclasses.replace(plan.policies["steady"], slots=slots)
    plan = dataclasses.replace(plan, policies={"steady": served})
    assert plan.jobs(rollouts) == used
