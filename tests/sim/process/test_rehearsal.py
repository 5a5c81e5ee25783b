"""Steps that are tried: taken back without a trace, or kept with the bits that they would have."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, precondition, rule

from pytest_safemanip.errors import RolloutError
from pytest_safemanip.policies.base import Observation
from pytest_safemanip.rollouts.loop import Job, Protocol, run
from pytest_safemanip.sim.backend import Backend, Provenance, Request
from pytest_safemanip.sim.process import ProcessBackend
from pytest_safemanip.sim.rehearsal import MOST_OPEN, Rehearsal, Rehearses, Trials
from tests.sim.process import children
from tests.toy import SPEC

MOVES = st.integers(0, 2).map(lambda number: np.array([float(number)]))


class TriedOrNot(RuleBasedStateMachine):
    """A world whose state is all that was done to it, beside the plainest idea of trials."""

    def __init__(self) -> None:
        super().__init__()
        self._state: tuple[float, ...] = ()
        self._aside: list[tuple[float, ...]] = []
        self.trials: Any = Trials(self._simulate, self._put_aside, self._go_back)
        self.world: list[tuple[float, ...]] = [()]  # the state of each open trial, ours first

    def _simulate(self, action: Any) -> Any:
        self._state += (float(action[0]),)
        return self._state

    def _put_aside(self) -> None:
        self._aside.append(self._state)

    def _go_back(self, depth: int) -> None:
        self._state = self._aside[depth]
        del self._aside[depth:]

    @rule(move=MOVES)
    def step(self, move: Any) -> None:
        self.world[-1] += (float(move[0]),)
        assert self.trials.step(move) == self.world[-1]

    @rule()
    def begin(self) -> None:
        self.trials.begin()
        self.world.append(self.world[-1])

    @precondition(lambda self: len(self.world) > 1)
    @rule()
    def undo(self) -> None:
        self.trials.undo()
        self.world.pop()

    @precondition(lambda self: len(self.world) > 1)
    @rule()
    def keep(self) -> None:
        self.trials.keep()
        self.world.pop()

    @precondition(lambda self: len(self.world) > 1)
    @rule(departs=st.booleans(), share=st.floats(0.0, 1.0))
    def keep_and_repeat(self, departs: bool, share: float) -> None:
        """What was kept is done again, to its end or to where something else is done."""
        kept = self.world.pop()[len(self.world[-1]) :]
        self.trials.keep()
        for number in kept[: round(share * len(kept))]:
            self.step(np.array([number]))
        if departs:
            self.step(np.array([3.0]))

    @rule()
    def look(self) -> None:
        self.trials.catch_up()
        assert self._state == self.world[-1]


TriedOrNot.TestCase.settings = settings(max_examples=150, stateful_step_count=40)
test_trials_leave_what_was_kept_and_nothing_else = TriedOrNot.TestCase


@pytest.fixture
def child(tmp_path: Path) -> Iterator[ProcessBackend]:
    name = f"{children.__name__}:simulator"
    made = ProcessBackend(name, {}, SPEC, Provenance("toy", "none"), tmp_path)
    yield made
    made.close()


def actions(count: int, seed: int = 0) -> Any:
    return np.random.default_rng(seed).uniform(-0.5, 0.5, (count, 12))


def test_a_trial_that_has_not_begun_cannot_end(child: ProcessBackend) -> None:
    with pytest.raises(RolloutError, match="before reset"):
        child.begin_trial()
    child.reset(Request("Task", 0, "compact"))
    with pytest.raises(RuntimeError, match="no trial"):
        child.undo_trial()


def test_a_simulator_that_is_killed_in_a_trial_dies_whole_and_starts_again(
    child: ProcessBackend,
) -> None:
    child.reset(Request("Task", 0, "compact"))
    pids = [child.pid]
    for _ in range(2):
        child.begin_trial()
        (pid,) = Path(f"/proc/{pids[-1]}/task/{pids[-1]}/children").read_text().split()
        pids.append(int(pid))
    os.kill(pids[-1], signal.SIGKILL)
    with pytest.raises(RolloutError, match="SIGKILL"):
        child.step(np.zeros(12))
    child.reset(Request("Task", 0, "compact"))
    child.begin_trial()
    (copy,) = Path(f"/proc/{child.pid}/task/{child.pid}/children").read_text().split()
    child.kill()
    deadline = time.monotonic() + 10.0
    while Path(f"/proc/{copy}/stat").exists() and time.monotonic() < deadline:
        if Path(f"/proc/{copy}/stat").read_text().split(")")[1].split()[0] in "ZX":
            break
        time.sleep(0.02)
    else:
        assert not Path(f"/proc/{copy}/stat").exists()


def test_a_new_episode_ends_all_trials(child: ProcessBackend) -> None:
    first = child.reset(Request("Task", 0, "compact"))
    for _ in range(3):
        child.begin_trial()
        child.step(np.ones(12))
    again = child.reset(Request("Task", 0, "compact"))
    assert again.fingerprint == first.fingerprint
    assert Path(f"/proc/{child.pid}/task/{child.pid}/children").read_text() == ""


def test_a_kitchen_is_what_it_was_before_a_trial_to_the_last_bit(backend: Backend) -> None:
    assert isinstance(backend, Rehearses)
    request, moves = Request("OpenDrawer", 0, "compact", stepping="fast"), actions(30)
    backend.reset(request)
    plain = [backend.step(move) for move in moves]

    backend.reset(request)
    rehearsal = Rehearsal(backend, backend.spec.robot.actions, 100, False)
    seen = [backend.step(move) for move in moves[:5]]
    with rehearsal.acting("here"):
        rehearsal.begin()
        for move in actions(20, seed=1):
            rehearsal.step(move)
        rehearsal.undo()
        rehearsal.begin()
        tried = [rehearsal.step(move) for move in moves[5:20]]
        rehearsal.begin()
        tried += [rehearsal.step(move) for move in moves[20:25]]
        rehearsal.keep()
        rehearsal.keep()
    for number, move in enumerate(moves[5:]):
        seen.append(backend.step(move))
        if number < 10:
            assert seen[-1] is tried[number]
    for one, other in zip(seen, plain, strict=True):
        for name in ("qpos", "qvel", "object_pose", "joint", "switch"):
            assert np.array_equal(getattr(one, name), getattr(other, name))
        assert np.array_equal(one.contacts.force, other.contacts.force)
        assert one.success == other.success


def test_what_is_outside_the_limits_is_clipped_as_in_a_rollout(child: ProcessBackend) -> None:
    child.reset(Request("Task", 0, "compact"))
    robot = child.spec.robot.actions
    rehearsal = Rehearsal(child, robot, 100, False)
    with rehearsal.acting("here"):
        rehearsal.begin()
        wild = rehearsal.step(np.full(12, 50.0))
        rehearsal.keep()
    assert child.step(np.clip(np.full(12, 50.0), robot.low, robot.high)) is wild


class Rehearsing:
    """A policy that does something with its rehearsal before it holds still."""

    def __init__(self, does: Callable[[Rehearsal], object]) -> None:
        self.does = does

    def act(self, observation: Observation) -> Any:
        assert observation.rehearsal is not None
        self.does(observation.rehearsal)
        return np.zeros(12)


def trial_with(action: Any) -> Callable[[Rehearsal], object]:
    """A trial of one action, taken back."""

    def does(rehearsal: Rehearsal) -> None:
        rehearsal.begin()
        rehearsal.step(action)
        rehearsal.undo()

    return does


@pytest.mark.parametrize(
    ("does", "message"),
    [
        (
            lambda r: r.begin(),
            "policy 'mine', step 0: it acts while it rehearses: 'undo' or",
        ),
        (lambda r: r.keep(), "the policy ends a trial, and none has begun: call 'begin' first"),
        (lambda r: r.step(np.zeros(12)), "rehearses a step outside of a trial, and none has begun"),
        (
            lambda r: [r.begin(), r.undo(), r.step(np.zeros(12))],
            "policy rehearses a step outside of a trial",
        ),
        (lambda r: [r.begin() for _ in range(MOST_OPEN + 1)], f"in {MOST_OPEN} trials within one"),
        (trial_with(np.zeros(3)), "rehearses: the action has shape (3,), expected (12,)"),
        (trial_with(np.zeros((4, 12))), "the policy rehearses 4 actions at once"),
        (trial_with(np.full(12, np.nan)), "action[0, 0] (end_effector_position_x) is not finite"),
        (trial_with(["up"] * 12), "the action is not an array of numbers (it has the type <U2)"),
    ],
    ids=[
        "left open",
        "none",
        "no trial",
        "taken back",
        "too many",
        "short",
        "chunk",
        "hole",
        "text",
    ],
)
def test_what_a_policy_does_wrong_in_a_trial_is_its_error_and_no_verdict(
    child: ProcessBackend, does: Callable[[Rehearsal], object], message: str
) -> None:
    job = Job("Task", "mine", Request("Task", 0, "compact"), Protocol(), {})
    with pytest.raises(RolloutError) as caught:
        run(job, child, Rehearsing(does))
    assert message in str(caught.value)
    assert not caught.value.infrastructure


class Lingering:
    """A policy that begins a trial in another method than ``act``."""

    def __init__(self, where: str, rehearsal: Rehearsal) -> None:
        self.where, self.rehearsal = where, rehearsal

    def begin_in(self, where: str) -> None:
        if where == self.where:
            self.rehearsal.begin()

    def reset(self) -> None:
        self.begin_in("reset")

    def act(self, observation: Observation) -> Any:
        return np.zeros(12)

    @property
    def done(self) -> bool:
        self.begin_in("done")
        return True

    @property
    def failure(self) -> str:
        self.begin_in("failure")
        return ""


@pytest.mark.parametrize("where", ["reset", "done", "failure"])
def test_a_policy_rehearses_only_while_it_acts(child: ProcessBackend, where: str) -> None:
    job = Job("Task", "mine", Request("Task", 0, "compact"), Protocol(), {})
    rehearsal = Rehearsal(child, child.spec.robot.actions, 100, False)
    with pytest.raises(RolloutError, match="rehearses while it does not act") as caught:
        run(job, child, Lingering(where, rehearsal))
    assert not caught.value.infrastructure
