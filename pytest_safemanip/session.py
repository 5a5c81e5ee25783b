"""A run: rollouts on demand, each run once, and the verdicts on them."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from filelock import FileLock

from pytest_safemanip import episodes, rollout
from pytest_safemanip.cases import Case
from pytest_safemanip.errors import (
    ConfigError,
    PolicyUnreachable,
    RolloutError,
    SafemanipError,
)
from pytest_safemanip.judge import Judge, Verdict
from pytest_safemanip.plan import Plan
from pytest_safemanip.policies.registry import PolicySpec
from pytest_safemanip.sim.backend import Backend, Request
from pytest_safemanip.sim.staging import to_plain
from pytest_safemanip.store import Store, key_of
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording

KEPT = 2
"""Rollouts kept in memory: neighbouring cases share one, and work stealing can split it."""


class Progress(Protocol):
    """Is told how the rollout that is running gets on."""

    def show(self, case: Case, step: int, horizon: int) -> None:
        """A control step was made; ``step`` is 0 before the first, and ``horizon`` too while the
        episode is set up.
        """

    def done(self) -> None:
        """The rollout has ended, one way or the other."""


@dataclass(frozen=True)
class Judged:
    """A rollout with what judges it.

    Attributes:
        recording: what happened.
        path: where it is kept.
        judge: gives its verdicts.
    """

    recording: Recording
    path: Path
    judge: Judge


class SafetySession:
    """Runs what a plan lays out, in this process.

    Args:
        plan: the run.
        backend: None when recordings are judged.
        store: where recordings are kept; shared with the other processes of the run.
        run: identifies this test run.
        progress: told about steps.
    """

    def __init__(
        self,
        plan: Plan,
        backend: Backend | None,
        store: Store | None,
        run: str,
        progress: Progress | None = None,
    ) -> None:
        self._plan, self._backend, self._store, self._run = plan, backend, store, run
        self._progress = progress
        self._judged: OrderedDict[tuple[str, str, int], Judged] = OrderedDict()
        self._failed: dict[tuple[str, str, int], SafemanipError] = {}
        self._unusable: ConfigError | None = None
        self._unreachable: dict[str, PolicyUnreachable] = {}

    def judged(self, case: Case) -> Judged:
        """The rollout that a case needs: from memory, from disk, or run now.

        Raises:
            RolloutError: if it does not complete; the same for all its cases.
            TraceError: if its recording is broken.
            ConfigError: if the simulator cannot be used at all; the same for all rollouts.
        """
        if self._unusable is not None:
            raise ConfigError(str(self._unusable))
        server = self._server(case)
        if server in self._unreachable:
            raise RolloutError(str(self._unreachable[server]).splitlines()[0])
        if case.rollout in self._failed:
            # The traceback was shown with the first case.
            raise RolloutError(str(self._failed[case.rollout]))
        if case.rollout not in self._judged:
            try:
                self._judged[case.rollout] = self._get(case)
            except ConfigError as error:
                self._unusable = error
                raise
            except PolicyUnreachable as error:
                self._unreachable[server] = error
                raise
            except SafemanipError as error:
                self._failed[case.rollout] = error
                raise
            while len(self._judged) > KEPT:
                self._judged.popitem(last=False)
        return self._judged[case.rollout]

    def hopeless(self, error: Exception) -> bool:
        """Whether all other cases would fail in the same way."""
        servers = {self._server(case) for case in self._plan.cases}
        return isinstance(error, ConfigError) or (
            isinstance(error, PolicyUnreachable) and servers <= set(self._unreachable)
        )

    def verdict(self, case: Case) -> Verdict:
        """The verdict on a case.

        Raises:
            SafemanipError: as :meth:`judged`.
        """
        return self.judged(case).judge.judge(self._plan.properties[case.property_id])

    def close(self) -> None:
        """End the simulator and the connections to policies."""
        for policy in self._plan.policies.values():
            policy.close()
        if self._backend is not None:
            self._backend.close()

    def _server(self, case: Case) -> str:
        """Where the policy of a case is; empty if it runs here, or is not run."""
        policy = self._plan.policies.get(case.policy)
        if policy is None or policy.server is None:
            return ""
        return str(policy.server(case.task, self._plan.tasks[case.task].sets))

    def _get(self, case: Case) -> Judged:
        if case.rollout in self._plan.recordings:
            path = self._plan.recordings[case.rollout]
            recording = files.load(path)
        else:
            recording, path = self._rolled_out(case)
        judge = Judge(
            recording,
            self._plan.tasks[case.task],
            self._plan.attributes,
            self._plan.catalogue,
            self._plan.parameters,
            self._plan.settings.semantics,
        )
        return Judged(recording, path, judge)

    def _rolled_out(self, case: Case) -> tuple[Recording, Path]:
        if self._backend is None or self._store is None:
            raise RolloutError(f"there is no recording of {case.task}, seed {case.seed}")
        backend = self._backend
        policy = self._plan.policies[case.policy]
        key, job = self._job(case, policy, backend)

        def run() -> Recording:
            try:
                with self._turn(policy, self._server(case)):
                    return episodes.run(job, backend, policy, show)
            except SafemanipError:
                raise
            except Exception as error:
                raise RolloutError(f"{type(error).__name__}: {error}") from error
            finally:
                if self._progress is not None:
                    self._progress.done()

        def show(step: int, horizon: int) -> None:
            if self._progress is not None:
                self._progress.show(case, step, horizon)

        path = self._store.path(case.policy, case.task, case.seed)
        return self._store.get(path, key, run), path

    def _job(self, case: Case, policy: PolicySpec, backend: Backend) -> tuple[str, rollout.Job]:
        settings = self._plan.settings
        task = self._plan.tasks[case.task]
        scenes = settings.scenes or policy.scenes
        stepping = settings.stepping or policy.stepping
        compact = scenes == "compact"
        staging = policy.staging(case.task)
        groups = {**(task.object_groups if compact else {}), **staging.objects}
        kitchen = task.kitchen if compact else ""
        request = Request(case.task, case.seed, scenes, groups, kitchen, staging.changes, stepping)
        protocol = rollout.Protocol(settings.stop, settings.horizon_scale)
        source = backend.provenance
        parts: Mapping[str, Any] = {
            "task": case.task,
            "seed": case.seed,
            "scenes": scenes,
            "kitchen": kitchen,
            "stepping": stepping,
            "object_groups": {role: list(names) for role, names in groups.items()},
            "changes": to_plain(staging.changes),
            "policy": case.policy,
            # Nobody can tell whether a policy without a fingerprint is still the same.
            "fingerprint": policy.fingerprint or f"run {self._run}",
            "prompt": settings.prompt,
            "stop": settings.stop,
            "horizon_scale": settings.horizon_scale,
            "backend": source.backend,
            "assets": source.assets,
            "versions": dict(source.versions),
            "hashes": dict(source.hashes),
        }
        key = key_of(parts)
        hashes = {"policy": policy.fingerprint or "", "key": key}
        return key, rollout.Job(
            case.task, case.policy, request, protocol, hashes, task.sets, settings.prompt
        )

    def _turn(self, policy: PolicySpec, server: str) -> AbstractContextManager[Any]:
        """One process at a time asks a server: the others would wait within their deadlines."""
        if not server or policy.shared:
            return nullcontext()
        folder = self._plan.settings.out / "locks"
        folder.mkdir(parents=True, exist_ok=True)
        return FileLock(folder / f"{key_of({'server': server})}.lock")
