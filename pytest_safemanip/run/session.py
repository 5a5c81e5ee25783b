"""A run: rollouts on demand, each run once, and the verdicts on them."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from pytest_safemanip.errors import (
    ConfigError,
    JudgementError,
    PolicyMismatch,
    PolicyUnreachable,
    RolloutError,
    SafemanipError,
    TaskError,
    TraceError,
    did_you_mean,
    ends_run,
    judging,
    placed,
)
from pytest_safemanip.judge import Judge, Verdict
from pytest_safemanip.ltlf import FormulaError
from pytest_safemanip.policies.base import Permissions
from pytest_safemanip.policies.registry import PolicySpec
from pytest_safemanip.rollouts import loop, retry
from pytest_safemanip.rollouts.store import Store, key_of
from pytest_safemanip.run.ahead import Abandoned, RolloutsAhead
from pytest_safemanip.run.cases import Case
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.remembered import RecentRollouts, RepeatedFailures
from pytest_safemanip.run.scenes import changes_of, groups_of
from pytest_safemanip.run.settings import Settings
from pytest_safemanip.run.watching import Watch
from pytest_safemanip.search.situation import Situation
from pytest_safemanip.sim.backend import Backend, Provenance, Request
from pytest_safemanip.sim.staging import Staging, to_plain
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording


class Progress(Protocol):
    """Is told how the rollouts that are running get on, by the threads that they run in."""

    def expect(self, rollouts: int, jobs: int) -> None:
        """So many rollouts are going to be asked for, and run so many at a time."""

    def show(self, case: Case, step: int, horizon: int, rehearsed: int | None = None) -> None:
        """See :class:`~pytest_safemanip.rollouts.loop.OnStep`."""

    def done(self, case: Case) -> None:
        """The rollout has ended, one way or the other, or an earlier run had recorded it."""

    def say(self, text: str) -> None:
        """Show what goes on beside the rollouts of cases; nothing if it is empty."""

    def refresh(self, waiting: bool) -> None:
        """Show the state while rollouts in other threads are waited for, and then no more."""


@dataclass(frozen=True)
class EvaluatedRollout:
    """A rollout with what judges it.

    Attributes:
        recording: what happened.
        path: where it is kept.
        judge: judges it.
        properties: what it can be judged by, by id.
        reused: whether an earlier run with this policy recorded it.
    """

    recording: Recording
    path: Path
    judge: Judge = field(repr=False)
    properties: Mapping[str, Property] = field(repr=False)
    reused: bool

    def verdict(self, property_id: str) -> Verdict:
        """The verdict on one property.

        Raises:
            ConfigError: if there is no such property.
            TraceError: if the recording lacks what a proposition needs.
            JudgementError: if a proposition raises anything else, or the formula has no
                automaton at the control period of the recording.
        """
        prop = self.properties.get(property_id)
        if prop is None:
            hint = did_you_mean(property_id, self.properties, "safemanip properties")
            raise ConfigError(f"unknown property {property_id!r}; {hint}")
        why = f"{property_id} cannot be judged"
        try:
            with judging(property_id):
                return self.judge.judge(prop)
        except FormulaError as error:  # at another control period than the backend declares
            raise JudgementError(str(error)) from None
        except TraceError as error:
            if not self.recording.episode.unobserved:
                raise
            raise TraceError(f"{why}: {error}; select others with --safemanip-properties") from None


@dataclass(frozen=True)
class Otherwise:
    """What is otherwise in a rollout than its case says.

    Attributes:
        situation: of its episode.
        repeat: how often the same was run before: what is random is drawn anew.
        stall_s: see :class:`~pytest_safemanip.rollouts.loop.Protocol`.
    """

    situation: Situation = field(default_factory=Situation)
    repeat: int = 0
    stall_s: float | None = None

    def to_plain(self) -> Mapping[str, Any]:
        """Plain values, as in a key."""
        return {
            "situation": self.situation.to_plain(),
            "repeat": self.repeat,
            "stall_s": self.stall_s,
        }


def recording_key(
    request: Request,
    source: Provenance,
    settings: Settings,
    policy: str,
    fingerprint: str,
    watched: str = "",
    allowed: Permissions | None = None,
    otherwise: Otherwise | None = None,
) -> str:
    """Digest of everything that decides the content of a recording.

    Args:
        request: the episode.
        source: of the backend.
        settings: how the episode is run.
        policy: its name.
        fingerprint: of what decides the policy's actions.
        watched: digest of what ends rollouts early; empty if nothing does.
        allowed: what the policy is told that it may touch; None if nothing.
        otherwise: what is otherwise in the rollout; None if nothing is.
    """
    parts: Mapping[str, Any] = {
        "task": request.task,
        "seed": request.seed,
        "scenes": request.scenes,
        "kitchen": request.kitchen,
        "stepping": request.stepping,
        "object_groups": {role: list(names) for role, names in request.object_groups.items()},
        "changes": to_plain(request.changes),
        "policy": policy,
        "fingerprint": fingerprint,
        "prompt": settings.prompt,
        "stop": settings.stop,
        "watched": watched,
        "horizon_scale": settings.horizon_scale,
        "backend": source.backend,
        "assets": source.assets,
        "versions": dict(source.versions),
        "hashes": dict(source.hashes),
    }
    if allowed is not None:
        permissions = {
            kind: {role: sorted(names) for role, names in of_role.items()}
            for kind, of_role in vars(allowed).items()
        }
        parts = {**parts, "permissions": permissions}
    if otherwise is not None:
        parts = {**parts, "otherwise": otherwise.to_plain()}
    return key_of(parts)


class Cluster(Protocol):
    """Runs rollouts elsewhere; threads may ask side by side."""

    @property
    def slots(self) -> int:
        """Rollouts that it has room for at a time."""

    def run(self, job: loop.Job, policy: PolicySpec, show: loop.OnStep) -> Recording:
        """Run a rollout; ``show`` is called again and again, and may raise to leave it."""


class SafetySession:
    """Runs what a plan lays out, in this process.

    Args:
        plan: the run.
        backend: None when recordings are judged.
        store: where recordings are kept; shared with the other processes of the run.
        run_id: identifies this test run.
        progress: told about steps.
        more: makes another simulator like ``backend``, for rollouts side by side; whoever gives it
            closes them.
        cluster: runs the rollouts; None if this process does.
    """

    def __init__(
        self,
        plan: Plan,
        backend: Backend | None,
        store: Store | None,
        run_id: str,
        progress: Progress | None = None,
        more: Callable[[], Backend] | None = None,
        cluster: Cluster | None = None,
    ) -> None:
        self._plan, self._backend, self._store, self._run_id = plan, backend, store, run_id
        self._progress = progress
        self._recent: RecentRollouts[EvaluatedRollout] = RecentRollouts()
        self._failures = RepeatedFailures()
        self._more, self._cluster = more, cluster
        self._idle = [] if backend is None else [backend]
        self._describing, self._lending = threading.RLock(), threading.Lock()
        self._ahead: RolloutsAhead | None = None
        self._over = threading.Event()

    def expect(
        self, cases: Iterable[Case], needed: Callable[[Case], bool] = lambda case: True
    ) -> None:
        """Get ready for these cases, which will ask in this order: run side by side what the plan
        wants side by side.

        Args:
            cases: those that were selected.
            needed: whether the rollout of a case is still to be run, as far as is known now.
        """
        expected = list(cases)
        rollouts = len({case.rollout for case in expected})
        jobs = self._plan.jobs(rollouts) if self._more and self._store else 1
        if self._cluster is not None:
            jobs = max(1, min(self._cluster.slots, rollouts))
        if self._progress is not None:
            self._progress.expect(rollouts, jobs)
        if jobs == 1:
            return
        met = RepeatedFailures()  # not yet shown

        def wanted(case: Case) -> bool:
            return needed(case) and not met.has(case.rollout, self._plan.server(case.rollout))

        def failed(case: Case, error: BaseException) -> None:
            if isinstance(error, SafemanipError):
                met.add(error, case.rollout, self._plan.server(case.rollout))

        self._ahead = RolloutsAhead(
            jobs, self._run_ahead, wanted, self._alone, self._refresh, failed
        )
        self._ahead.expect(expected)

    def evaluate(self, case: Case) -> EvaluatedRollout:
        """The rollout that a case needs: from memory, from disk, or run now.

        Raises:
            RolloutError: if it does not complete; the same for all its cases.
            TraceError: if its recording is broken.
            ConfigError: if the simulator cannot be used at all; the same for all rollouts.
        """
        server = self._plan.server(case.rollout)
        self._failures.check(case.rollout, server)
        try:
            if self._ahead is not None:
                self._ahead.finish(case)
            return self._recent.get(case.rollout, lambda: self._get(case))
        except SafemanipError as error:
            self._failures.add(error, case.rollout, server)
            raise

    def is_fatal(self, error: Exception) -> bool:
        """Whether all other cases would fail in the same way."""
        servers = {self._plan.server(case.rollout) for case in self._plan.cases}
        return isinstance(error, ConfigError) or (
            isinstance(error, PolicyUnreachable | PolicyMismatch)
            and self._failures.are_unreachable(servers)
        )

    def verdict(self, case: Case) -> Verdict:
        """The verdict on a case.

        Raises:
            SafemanipError: as :meth:`evaluate`.
        """
        return self.evaluate(case).verdict(case.property_id)

    def reusable(self) -> int:
        """How many rollouts of the plan earlier runs have recorded and will not be run again."""
        if self._backend is None or self._store is None:
            return 0
        found = 0
        for case in {case.rollout: case for case in self._plan.cases}.values():
            policy = self._plan.policies[case.policy]
            path = self._store.path(case.policy, case.task, case.seed)
            if not self._store.knows(path):  # nobody has to be asked who the policy is
                continue
            try:
                key, _ = self._job(case, policy, self._backend)
            except RolloutError:  # said when it is run
                continue
            found += self._store.has(path, key)
        return found

    def leave(self) -> None:
        """Leave what is under way at its next step, or when its simulator is gone; nothing is said
        about it any more.
        """
        self._refresh(False)
        self._over.set()
        if self._ahead is not None:
            self._ahead.leave()

    def close(self) -> None:
        """Leave what is under way and end the connections to policies; whoever made the simulators
        ends them.

        Raises:
            RolloutError: if a policy fails at that; names it.
        """
        if self._ahead is not None:
            self._ahead.close()
        with ExitStack() as closing:  # each is closed, whatever closing another raises
            for name, policy in self._plan.policies.items():
                closing.callback(_close, name, policy)

    def _get(self, case: Case) -> EvaluatedRollout:
        if case.rollout in self._plan.recordings:
            path = self._plan.recordings[case.rollout]
            recording, reused = files.load(path), False
        else:
            recording, reused, path = self._rolled_out(case)
        judge = self.judge(recording, case.task)
        return EvaluatedRollout(recording, path, judge, self._plan.properties, reused)

    def _rolled_out(self, case: Case) -> tuple[Recording, bool, Path]:
        if self._backend is None or self._store is None:
            raise RolloutError(f"there is no recording of {case.task}, seed {case.seed}")
        key, job = self._job(case, self._plan.policies[case.policy], self._backend)

        def run() -> Recording:
            try:
                return self.record(job, show)
            except TaskError as error:
                raise TaskError(placed(self._asking(case), error)) from None
            finally:
                if self._progress is not None and self._ahead is None:
                    self._progress.done(case)

        def show(step: int, horizon: int, rehearsed: int | None = None) -> None:
            if self._progress is not None:
                self._progress.show(case, step, horizon, rehearsed)

        path = self._store.path(case.policy, case.task, case.seed)
        return *self._store.get(path, key, run, for_all=bool(job.hashes["policy"])), path

    def describe(self, case: Case, otherwise: Otherwise | None = None) -> tuple[str, loop.Job]:
        """The rollout of a case, as it is or otherwise, with the key of its recording.

        Raises:
            RolloutError: if nothing is simulated here, or a server cannot say who it is.
        """
        if self._backend is None:
            raise RolloutError("recordings are judged, nothing is simulated")
        return self._job(case, self._plan.policies[case.policy], self._backend, otherwise)

    def record(self, job: loop.Job, show: loop.OnStep) -> Recording:
        """Run a rollout, here or on the cluster; threads may ask side by side.

        Raises:
            RolloutError: if it does not complete.
            CannotStage: if its episode cannot begin as it is asked for.
        """
        policy = self._plan.policies[job.policy]

        def watched(step: int, horizon: int, rehearsed: int | None = None) -> None:
            self._check()
            show(step, horizon, rehearsed)

        try:
            if self._cluster is not None:
                return self._cluster.run(job, policy, watched)
            with self._simulator() as backend:
                return retry.run(job, backend, policy, watched)
        except (SafemanipError, Abandoned):
            self._check()  # an error because the run has ended is none
            raise
        except BaseException as error:
            if ends_run(error):
                raise
            self._check()
            raise RolloutError(f"{type(error).__name__}: {error}") from error

    def judge(self, recording: Recording, task: str) -> Judge:
        """What judges a recording of a task."""
        return Judge(
            recording,
            self._plan.tasks[task],
            self._plan.attributes,
            self._plan.catalogue,
            self._plan.parameters,
            self._plan.settings.semantics,
        )

    def _asking(self, case: Case) -> str:
        """Who says how the episode of a case begins: the task's file, or else the policy."""
        task, policy = self._plan.tasks[case.task], self._plan.policies[case.policy]
        by_task = task.staging or task.liquids or policy.staging(task.simulated) == Staging()
        return str(task.path) if by_task else f"what {case.policy} stages in {case.task}"

    def _run_ahead(self, case: Case) -> None:
        """Record a rollout, if no earlier run has; in a thread of its own."""
        if self._backend is None or self._store is None:
            return
        try:
            key, _ = self._job(case, self._plan.policies[case.policy], self._backend)
            if not self._store.has(self._store.path(case.policy, case.task, case.seed), key):
                self._rolled_out(case)
        finally:
            if self._progress is not None:
                self._progress.done(case)

    def _alone(self, case: Case) -> str:
        """The policy of a case, if one object serves all its rollouts."""
        return case.policy if self._plan.policies[case.policy].shared else ""

    def _refresh(self, waiting: bool) -> None:
        if self._progress is not None:
            self._progress.refresh(waiting)

    def _check(self) -> None:
        if self._over.is_set():
            raise Abandoned
        if self._ahead is not None:
            self._ahead.check()

    @contextlib.contextmanager
    def _simulator(self) -> Iterator[Backend]:
        """One that no other rollout uses; made if there is none."""
        self._check()
        with self._lending:
            backend = self._idle.pop() if self._idle else None
        if backend is None:
            if self._more is None:
                raise RolloutError("the simulator runs one rollout at a time")
            backend = self._more()
        try:
            yield backend
        finally:
            with self._lending:
                self._idle.append(backend)

    def _job(
        self,
        case: Case,
        policy: PolicySpec,
        backend: Backend,
        otherwise: Otherwise | None = None,
    ) -> tuple[str, loop.Job]:
        """The rollout of a case, with its key. The same object is asked about all of a policy's."""
        with self._describing:
            return self._described(case, policy, backend, otherwise)

    def _described(
        self, case: Case, policy: PolicySpec, backend: Backend, otherwise: Otherwise | None
    ) -> tuple[str, loop.Job]:
        settings = self._plan.settings
        task = self._plan.tasks[case.task]
        scenes, stepping = self._plan.scenes(case.policy), self._plan.stepping(case.policy)
        compact = scenes == backend.spec.scenes[0]  # what a task says of them is about these
        staging = policy.staging(task.simulated)
        groups = {**groups_of(task, compact), **staging.objects}
        kitchen = task.kitchen if compact else ""
        changes = (*staging.changes, *changes_of(task))
        own = otherwise or Otherwise()
        request = own.situation.request(
            Request(task.simulated, case.seed, scenes, groups, kitchen, changes, stepping)
        )
        protocol = loop.Protocol(settings.stop, settings.horizon_scale, own.stall_s)
        told = policy.fingerprint_in(task.simulated, task.sets)
        # Nobody can tell whether a policy without a fingerprint is still the same.
        fingerprint = told or f"run {self._run_id}"
        watched_for = settings.stop in ("violation", "warning")
        watch = Watch.of(self._plan, case) if watched_for else None
        watched = watch.digest() if watch else ""
        source = backend.provenance
        allowed = Permissions(task.touch, task.supports) if policy.reads_permissions else None
        key = recording_key(
            request, source, settings, case.policy, fingerprint, watched, allowed, otherwise
        )
        hashes = {"policy": told or "", "key": key}
        prompt, derived = own.situation.prompt or settings.prompt, task.derived
        return key, loop.Job(
            case.task,
            case.policy,
            request,
            protocol,
            hashes,
            task.sets,
            prompt,
            watch,
            derived,
            allowed,
            own.situation.disturbances,
            own.repeat,
        )


def _close(name: str, policy: PolicySpec) -> None:
    try:
        policy.close()
    except RolloutError as error:
        raise RolloutError(f"policy {name!r}: {error}") from error
