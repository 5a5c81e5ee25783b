"""Rollouts side by side: run ahead of the cases that ask for them, each in a thread."""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections.abc import Callable, Iterable

from pytest_safemanip.metrics.records import RolloutKey
from pytest_safemanip.run.cases import Case

AHEAD = 4
"""Rollouts that may be begun ahead of the one that is asked for, for each run at a time."""
PERIOD = 0.25
"""Seconds between two looks at the state while a rollout is waited for."""
FAREWELL = 1.0
"""Seconds for rollouts that are under way to notice that the run has ended."""


class Abandoned(BaseException):
    """The run has ended before the rollout: nothing is known about it."""


class RolloutsAhead:
    """Runs rollouts in the order of the cases, some at a time, before they are asked for.

    Everything but ``run`` is called by the thread that asks, which starts the others: so nothing
    goes on while nobody waits, except for what was begun.

    Args:
        jobs: rollouts that are run at a time.
        run: runs a case's rollout and keeps what comes of it; raises what went wrong.
        wanted: whether a case's rollout is to be begun, as far as one can tell now.
        alone: those of which only one is run at a time give the same text; empty for others.
        watch: called with True again and again while a rollout is waited for, then with False.
        failed: told about what a rollout raised, as soon as it has.
    """

    def __init__(
        self,
        jobs: int,
        run: Callable[[Case], None],
        wanted: Callable[[Case], bool],
        alone: Callable[[Case], str],
        watch: Callable[[bool], None],
        failed: Callable[[Case, BaseException], None],
    ) -> None:
        self._jobs, self._run, self._wanted, self._alone = jobs, run, wanted, alone
        self._watch, self._failed = watch, failed
        self._waiting: dict[RolloutKey, Case] = {}
        self._place: dict[RolloutKey, int] = {}
        self._running: dict[RolloutKey, tuple[Case, threading.Thread]] = {}
        self._ended: queue.SimpleQueue[tuple[Case, BaseException | None]] = queue.SimpleQueue()
        self._errors: dict[RolloutKey, BaseException] = {}
        self._over = threading.Event()

    def expect(self, cases: Iterable[Case]) -> None:
        """The cases that are going to ask, in their order; no others are run ahead."""
        self._waiting = {}
        for case in cases:
            self._waiting.setdefault(case.rollout, case)
        self._place = {rollout: place for place, rollout in enumerate(self._waiting)}

    def finish(self, case: Case) -> None:
        """Wait until a case's rollout has been run; begin it now if it has not been, and others.

        Raises:
            BaseException: what the rollout raised; the first time that it is asked for.
        """
        first = self._waiting.pop(case.rollout, None)
        if first is not None:
            self._waiting = {case.rollout: first, **self._waiting}
        self._begin(case)
        while case.rollout in self._running or case.rollout in self._waiting:
            self._watch(True)
            with contextlib.suppress(queue.Empty):
                self._end(*self._ended.get(timeout=PERIOD))
            self._begin(case)
        self._watch(False)
        error = self._errors.pop(case.rollout, None)
        if error is not None:
            raise error

    def check(self) -> None:
        """Leave a rollout that is under way if the run has ended.

        Raises:
            Abandoned: if it has.
        """
        if self._over.is_set():
            raise Abandoned

    def leave(self) -> None:
        """End the run: nothing is begun any more, and what is under way leaves at its next step."""
        self._over.set()

    def close(self) -> None:
        """End the run, and wait a little for what is under way.

        A policy that is computing cannot be interrupted, and is left behind.
        """
        self.leave()
        end = time.monotonic() + FAREWELL
        for _, thread in self._running.values():
            thread.join(max(0.0, end - time.monotonic()))

    def _begin(self, asked: Case) -> None:
        """Begin what there is room for."""
        while not self._ended.empty():
            self._end(*self._ended.get())
        last = self._place.get(asked.rollout, 0) + AHEAD * self._jobs
        busy = {self._alone(case) for case, _ in self._running.values()} - {""}
        for rollout, case in list(self._waiting.items()):
            if len(self._running) >= self._jobs or self._place[rollout] > last:
                return
            if self._alone(case) in busy:
                continue
            del self._waiting[rollout]
            if rollout == asked.rollout or self._wanted(case):
                busy |= {self._alone(case)} - {""}
                thread = threading.Thread(target=self._thread, args=(case,), daemon=True)
                self._running[rollout] = case, thread
                thread.start()

    def _thread(self, case: Case) -> None:
        error: BaseException | None = None
        try:
            self.check()
            self._run(case)
        except BaseException as raised:
            error = raised
        self._ended.put((case, error))

    def _end(self, case: Case, error: BaseException | None) -> None:
        del self._running[case.rollout]
        if error is not None:
            self._errors[case.rollout] = error
            self._failed(case, error)
