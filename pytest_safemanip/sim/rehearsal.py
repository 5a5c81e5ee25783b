"""Rehearsing: a script tries control steps in the simulator, and takes them back or keeps them.

Privileged knowledge, for scripts. What is kept is what the rollout gets when the same actions are
asked for next, step by step: it is not simulated again, and has the same bits as if it were.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from pytest_safemanip.errors import RolloutError
from pytest_safemanip.sim.backend import Action, ActionSpec
from pytest_safemanip.trace.steps import Step

MOST_OPEN = 100
"""Trials within one another: the simulator puts its state aside for each."""


@runtime_checkable
class Rehearses(Protocol):
    """A backend whose steps can be tried. Trials may be nested."""

    def begin_trial(self) -> None:
        """From here on, steps are tried.

        Raises:
            ConfigError: if the simulator has no such service.
            RolloutError: if the simulator fails.
        """

    def undo_trial(self) -> None:
        """End the newest trial: the state is what it was at its beginning."""

    def keep_trial(self) -> None:
        """End the newest trial: its actions are expected next, by the trial around it or by the
        rollout. Other ones are simulated from where they differ.
        """

    def step(self, action: Action) -> Step:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""


@dataclass
class Rehearsal:
    """What a policy is given of a backend that rehearses, while it acts. Each trial is to be undone
    or kept before the policy answers: the rollout goes on from where it was.

    Attributes:
        backend: the backend.
        actions: the action space; what is outside is clipped, as in the rollout.
        horizon: control steps of the episode.
        patient: whether the rollout goes on after success.
        told: is told how many steps were rehearsed, when a trial begins and at each of them.
    """

    backend: Rehearses
    actions: ActionSpec
    horizon: int
    patient: bool
    told: Callable[[int], None] = lambda steps: None
    _acts: bool = field(default=False, init=False)
    _open: int = field(default=0, init=False)
    _rehearsed: int = field(default=0, init=False)

    @contextlib.contextmanager
    def acting(self, where: str) -> Iterator[None]:
        """A context in which the policy acts, and may rehearse.

        Args:
            where: begins the message about a trial that is left open.

        Raises:
            RolloutError: when the context ends with an open trial.
        """
        self._acts = True
        try:
            yield
        finally:
            self._acts = False
        if self._open:
            raise RolloutError(
                f"{where}: it acts while it rehearses: 'undo' or 'keep' each trial that it begins "
                f"({self._open} left open)"
            )

    def begin(self) -> None:
        """See :meth:`Rehearses.begin_trial`.

        Raises:
            RolloutError: if too many are open, or the policy does not act; likewise below.
        """
        self._check_acts()
        if self._open >= MOST_OPEN:
            raise RolloutError(
                f"the policy rehearses in {MOST_OPEN} trials within one another: 'undo' or 'keep' "
                "each before more begin"
            )
        self.told(self._rehearsed)
        self.backend.begin_trial()
        self._open += 1

    def step(self, action: Action) -> Step:
        """The state that an action (A,) leads to.

        Raises:
            RolloutError: if it is not one valid action, or no trial is open.
        """
        self._check_open("rehearses a step outside of a trial")
        asked = self.actions.chunk(action, "the policy rehearses")
        if len(asked) > 1:
            raise RolloutError(f"the policy rehearses {len(asked)} actions at once: one is a step")
        self._rehearsed += 1
        self.told(self._rehearsed)
        return self.backend.step(np.clip(asked[0], self.actions.low, self.actions.high))

    def undo(self) -> None:
        """See :meth:`Rehearses.undo_trial`.

        Raises:
            RolloutError: if none is open; likewise :meth:`keep`.
        """
        self._close()
        self.backend.undo_trial()

    def keep(self) -> None:
        """See :meth:`Rehearses.keep_trial`."""
        self._close()
        self.backend.keep_trial()

    def _close(self) -> None:
        self._check_open("ends a trial")
        self._open -= 1

    def _check_open(self, does: str) -> None:
        self._check_acts()
        if not self._open:
            raise RolloutError(f"the policy {does}, and none has begun: call 'begin' first")

    def _check_acts(self) -> None:
        if not self._acts:
            raise RolloutError(
                "the policy rehearses while it does not act: do so within 'act' alone, with the "
                "rehearsal of the observation that it gets"
            )


@dataclass
class _Trial:
    """Steps since a trial began.

    Attributes:
        depth: how many states the simulator had put aside before it.
        done: what was asked for and answered.
        ahead: what the simulator has done already, since an inner trial was kept.
        since: of ``done``, how many had been when that inner trial began, ...
        aside: ... and how many states the simulator had put aside before it.
    """

    depth: int
    done: list[tuple[Action, Step]] = field(default_factory=list)
    ahead: list[tuple[Action, Step]] = field(default_factory=list)
    since: int = 0
    aside: int = 0


class Trials:
    """Book-keeping of trials for a simulator that can put its state aside and go back to it.

    Args:
        simulate: runs one control period.
        put_aside: keeps the present state.
        go_back: to the state that was put aside as this one, counted from 0; forgets it and those
            after it.
    """

    def __init__(
        self,
        simulate: Callable[[Action], Step],
        put_aside: Callable[[], None],
        go_back: Callable[[int], None],
    ) -> None:
        self._simulate, self._put_aside, self._go_back = simulate, put_aside, go_back
        self._depth, self._open = 0, [_Trial(0)]

    def forget(self) -> None:
        """Go back to before the first trial: an episode is over."""
        if self._depth:
            self._go_back(0)
        self._depth, self._open = 0, [_Trial(0)]

    def begin(self) -> None:
        """See :meth:`Rehearses.begin_trial`."""
        self.catch_up()
        self._put_aside()
        self._open.append(_Trial(self._depth))
        self._depth += 1

    def undo(self) -> None:
        """See :meth:`Rehearses.undo_trial`.

        Raises:
            RuntimeError: if there is no trial; likewise :meth:`keep`.
        """
        trial = self._newest()
        self._go_back(trial.depth)
        self._depth = trial.depth

    def keep(self) -> None:
        """See :meth:`Rehearses.keep_trial`."""
        trial = self._newest()
        around = self._open[-1]
        around.since, around.aside = len(around.done), trial.depth
        around.ahead = trial.done + trial.ahead

    def step(self, action: Action) -> Step:
        """What an action leads to, which is simulated if it was not yet."""
        trial = self._open[-1]
        if trial.ahead:
            known, step = trial.ahead[0]
            if known.tobytes() == action.tobytes():
                del trial.ahead[0]
                trial.done.append((known, step))
                return step
            self.catch_up()
        step = self._simulate(action)
        if len(self._open) > 1 or self._depth:
            trial.done.append((action.copy(), step))
        return step

    def catch_up(self) -> None:
        """Have the simulator where the rollout is, if it is ahead."""
        trial = self._open[-1]
        if not trial.ahead:
            return
        self._go_back(trial.aside)
        self._depth = trial.aside
        trial.ahead.clear()
        for action, _ in trial.done[trial.since :]:
            self._simulate(action)

    def _newest(self) -> _Trial:
        if len(self._open) < 2:
            raise RuntimeError("no trial has begun")
        return self._open.pop()
