"""The live line under pytest-xdist: workers write down how far they are, the main process reads it.

xdist carries nothing but test reports from workers to the main process, and those come when a
rollout is over. So each worker has a small file in the output folder, which the run removes when it
ends.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import threading
import time
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

from pytest_safemanip.metrics.records import RolloutKey
from pytest_safemanip.plugin.progress.line import PERIOD, is_seen, rewritten
from pytest_safemanip.run.cases import SUITE, Case, is_case_id, parse_node_id
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.under_way import Pace, UnderWay

FOLDER = "progress"
"""Of the output folder."""
WORKER_INPUT = "safemanip_progress"
"""Where a worker is told that somebody looks."""


def folder_of(out: Path, run_id: str) -> Path:
    """Where the workers of a run write."""
    return out / FOLDER / run_id


class WorkerProgress:
    """Writes down how far a worker's rollout is.

    Args:
        plan: the run.
        path: its file.
    """

    def __init__(self, plan: Plan, path: Path) -> None:
        self._plan, self._path = plan, path
        self._state = UnderWay()
        self._said = ""
        self._written = 0.0

    def expect(self, rollouts: int, jobs: int) -> None:
        """The main process knows how many there are."""

    def show(self, case: Case, step: int, horizon: int, rehearsed: int | None = None) -> None:
        """See :class:`~pytest_safemanip.run.session.Progress`."""
        served = bool(self._plan.server(case.rollout))
        self._state.note(case.rollout, step, horizon, time.time(), served, rehearsed)
        self._write(at_once=step == 0 and not rehearsed)

    def done(self, case: Case) -> None:
        """See :class:`~pytest_safemanip.run.session.Progress`."""
        self._state.end(case.rollout)
        self._write(at_once=True)

    def say(self, text: str) -> None:
        """See :class:`~pytest_safemanip.run.session.Progress`."""
        self._said = text
        self._write(at_once=True)

    def refresh(self, waiting: bool) -> None:
        """A worker runs one rollout at a time."""

    def _write(self, at_once: bool) -> None:
        now = time.monotonic()
        if not at_once and now - self._written < PERIOD:
            return
        self._written = now
        running = [
            [*rollout, r.step, r.horizon, r.since, r.served, r.rehearsed]
            for rollout, r in self._state.running.items()
        ]
        state = self._state
        content = {"run": state.run, "steps": state.steps, "running": running, "said": self._said}
        scratch = self._path.with_suffix(f".{os.getpid()}")
        with contextlib.suppress(OSError):  # a line that nobody sees harms nobody
            self._path.parent.mkdir(parents=True, exist_ok=True)
            scratch.write_text(json.dumps(content))
            scratch.replace(self._path)


class WorkersProgress:
    """Shows what the workers wrote, while the main process waits for their reports.

    Args:
        config: pytest's.
        folder: where they write.
    """

    def __init__(self, config: pytest.Config, folder: Path) -> None:
        self._config, self._folder = config, folder
        self._expected: set[RolloutKey] = set()
        self._ended: set[RolloutKey] = set()
        self._writing = threading.Lock()
        self._over = threading.Event()
        self._pace = Pace()
        self._thread: threading.Thread | None = None

    @pytest.hookimpl(optionalhook=True)
    def pytest_configure_node(self, node: Any) -> None:
        """Tell a worker that somebody looks."""
        node.workerinput[WORKER_INPUT] = is_seen(self._config)

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_node_collection_finished(self, ids: list[str]) -> None:
        """Begin to look when there is something to run."""
        self._expected |= {parse_node_id(i).rollout for i in ids if is_case_id(i)}
        ours = any(i.startswith(f"{SUITE}::") for i in ids)
        if self._thread is None and ours and is_seen(self._config):
            self._thread = threading.Thread(target=self._watch, daemon=True)
            self._thread.start()

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_logstart(self) -> Generator[None]:
        """Make way for what pytest writes; likewise below."""
        with self._aside():
            yield

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> Generator[None]:
        """A rollout of which a case is reported has ended."""
        if is_case_id(report.nodeid):
            self._ended.add(parse_node_id(report.nodeid).rollout)
        with self._aside():
            yield

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_logfinish(self) -> Generator[None]:
        """See above."""
        with self._aside():
            yield

    @pytest.hookimpl(tryfirst=True)
    def pytest_keyboard_interrupt(self) -> None:
        """Stop before pytest says so."""
        self._stop()

    @pytest.hookimpl(tryfirst=True)
    def pytest_sessionfinish(self) -> None:
        """Leave nothing behind, on the screen and on disk."""
        self._stop()
        shutil.rmtree(self._folder, ignore_errors=True)
        with contextlib.suppress(OSError):
            self._folder.parent.rmdir()  # unless another run writes there

    def text(self, now: float) -> str:
        """What there is to say.

        Args:
            now: the time, as in the workers' files.
        """
        state, said = UnderWay(done=len(self._ended & self._expected)), []
        for path in self._folder.glob("*.json"):
            with contextlib.suppress(OSError, ValueError, TypeError, KeyError):
                found = json.loads(path.read_text())
                running = {
                    RolloutKey(policy, task, seed): values
                    for policy, task, seed, *values in found["running"]
                }
                for rollout, values in running.items():
                    if rollout not in self._ended:
                        state.note(rollout, *values)
                state.run += found["run"]
                state.steps += found["steps"]
                if found["said"]:
                    said.append(str(found["said"]))
        if self._expected:
            said.insert(0, state.text(len(self._expected), self._pace, now))
        return ";".join(said)

    def _watch(self) -> None:
        while not self._over.wait(PERIOD):
            text = self.text(time.time())
            with self._writing:
                if not self._over.is_set():
                    self._write(text)

    @contextlib.contextmanager
    def _aside(self) -> Generator[None]:
        if self._thread is None:
            yield
            return
        with self._writing:
            self._write("")
            yield

    def _stop(self) -> None:
        if self._thread is not None and not self._over.is_set():
            with self._writing:
                self._over.set()
                self._write("")
            self._thread.join()

    def _write(self, text: str) -> None:
        line = rewritten(self._config, text)
        if line:
            # The main process captures nothing while it waits.
            writer = self._config.get_terminal_writer()
            writer._file.write(line)
            writer.flush()
