from __future__ import annotations

import threading
import time

import pytest

from pytest_safemanip.errors import RolloutError
from pytest_safemanip.run.ahead import AHEAD, Abandoned, RolloutsAhead
from pytest_safemanip.run.cases import Case

PROPERTIES = ("one", "two")


def cases(number, policy="p"):
    return [Case("T", policy, name, seed) for seed in range(number) for name in PROPERTIES]


class Runs:
    """What the rollouts do: each ends when it is told to, or at once."""

    def __init__(self, gated=False, failing=(), unwanted=(), alone=()):
        self.begun, self.ended, self.most = [], [], 0
        self.gates = {} if gated else None
        self.failing, self.unwanted, self.alone = set(failing), set(unwanted), set(alone)
        self.watched, self.failures, self.asking = [], [], set()
        self._changing = threading.Lock()

    def ahead(self, jobs, expected):
        found = RolloutsAhead(
            jobs,
            self.run,
            self.wanted,
            lambda case: case.policy if case.policy in self.alone else "",
            self.watched.append,
            lambda case, error: self.failures.append((case.seed, error)),
        )
        found.expect(expected)
        return found

    def gate(self, seed):
        with self._changing:
            return self.gates.setdefault(seed, threading.Event())

    def wanted(self, case):
        self.asking.add(threading.current_thread())
        return case.seed not in self.unwanted

    def run(self, case):
        with self._changing:
            self.begun.append(case.seed)
            self.most = max(self.most, len(self.begun) - len(self.ended))
        if self.gates is not None:
            assert self.gate(case.seed).wait(10)
        else:
            time.sleep(0.005)
        with self._changing:
            self.ended.append(case.seed)
        if case.seed in self.failing:
            raise RolloutError(f"seed {case.seed} failed")

    def until(self, begun):
        end = time.monotonic() + 10
        while len(self.begun) < begun:
            assert time.monotonic() < end
            time.sleep(0.001)


def in_thread(function, *arguments):
    thread = threading.Thread(target=function, args=arguments)
    thread.start()
    return thread


@pytest.mark.parametrize("jobs", [1, 2, 3, 8])
def test_each_rollout_is_run_once_and_no_more_at_a_time(jobs):
    runs, expected = Runs(), cases(12)
    ahead = runs.ahead(jobs, expected)
    for case in expected:
        ahead.finish(case)
        assert case.seed in runs.ended
    assert sorted(runs.begun) == list(range(12))
    assert runs.most <= jobs
    assert runs.asking <= {threading.current_thread()}
    assert runs.watched[-1] is False


def test_others_are_begun_while_one_is_waited_for_in_the_order_of_the_cases():
    runs = Runs(gated=True)
    expected = cases(9)
    ahead = runs.ahead(3, expected)
    asking = in_thread(ahead.finish, expected[0])
    runs.until(3)
    assert sorted(runs.begun) == [0, 1, 2]
    runs.gate(1).set()
    runs.until(4)
    assert sorted(runs.begun) == [0, 1, 2, 3]
    runs.gate(0).set()
    asking.join(10)
    assert sorted(runs.ended) == [0, 1]
    for seed in range(9):
        runs.gate(seed).set()
    ahead.close()


def test_no_more_than_some_are_run_ahead_of_the_one_that_is_asked_for():
    runs = Runs(gated=True)
    expected = cases(40)
    ahead = runs.ahead(2, expected)
    for seed in range(1, 40):
        runs.gate(seed).set()
    asking = in_thread(ahead.finish, expected[0])
    runs.until(1 + 2 * AHEAD)
    time.sleep(0.1)
    assert sorted(runs.begun) == list(range(1 + 2 * AHEAD))
    runs.gate(0).set()
    asking.join(10)


def test_an_order_that_was_not_expected_is_followed():
    runs, expected = Runs(), cases(10)
    ahead = runs.ahead(2, expected)
    for case in reversed(expected):
        ahead.finish(case)
        assert case.seed in runs.ended
    assert sorted(runs.begun) == list(range(10))


def test_what_is_not_wanted_is_not_begun_until_it_is_asked_for():
    runs = Runs(unwanted=(1, 2))
    ahead = runs.ahead(2, cases(4))
    for case in cases(4)[:2]:
        ahead.finish(case)
    ahead.finish(Case("T", "p", "one", 3))
    assert sorted(runs.begun) == [0, 3]
    ahead.finish(Case("T", "p", "one", 1))  # dropped: whoever asks runs it
    assert sorted(runs.begun) == [0, 3]


def test_a_rollout_that_fails_fails_its_own_cases_only():
    runs, expected = Runs(failing=(1,)), cases(4)
    ahead = runs.ahead(2, expected)
    ahead.finish(expected[0])
    with pytest.raises(RolloutError, match="seed 1 failed"):
        ahead.finish(expected[2])
    for case in expected[3:]:
        ahead.finish(case)
    assert sorted(runs.ended) == [0, 1, 2, 3]
    ((seed, error),) = runs.failures
    assert (seed, str(error)) == (1, "seed 1 failed")


def test_one_object_serves_one_rollout_at_a_time_and_others_go_on_beside_it():
    runs = Runs(gated=True, alone=("object",))
    expected = [*cases(3, "object"), *(Case("T", "p", "one", seed) for seed in (10, 11))]
    ahead = runs.ahead(2, expected)
    asking = in_thread(ahead.finish, expected[0])
    runs.until(2)
    assert sorted(runs.begun) == [0, 10]
    runs.gate(0).set()
    asking.join(10)
    for seed in (1, 2, 10, 11):
        runs.gate(seed).set()
    for case in expected:
        ahead.finish(case)
    assert sorted(runs.ended) == [0, 1, 2, 10, 11]


def test_ctrl_c_ends_the_waiting_and_what_is_under_way_leaves_at_its_next_step():
    begun, left = [], []

    def run(case):
        begun.append(case.seed)
        for _ in range(2000):
            try:
                ahead.check()
            except Abandoned:
                left.append(case.seed)
                raise
            time.sleep(0.005)

    def watch(waiting):
        if len(begun) == 2:
            raise KeyboardInterrupt

    ahead = RolloutsAhead(
        2, run, lambda case: True, lambda case: "", watch, lambda case, error: None
    )
    ahead.expect(cases(4))
    with pytest.raises(KeyboardInterrupt):
        ahead.finish(cases(4)[0])
    ahead.close()
    assert sorted(left) == sorted(begun) == [0, 1]
