"""Runs searches: their trials side by side, as they ask for them; tells them what came of each."""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from pathlib import Path

import filelock

from pytest_safemanip.errors import (
    CannotStage,
    ConfigError,
    PolicyMismatch,
    PolicyUnreachable,
    RolloutError,
    TaskError,
)
from pytest_safemanip.judge import Judge
from pytest_safemanip.provenance import source_digest
from pytest_safemanip.rollouts.store import file_name
from pytest_safemanip.run.cases import Case
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.searching.journal import Journal
from pytest_safemanip.run.searching.plan import SearchCase, SearchPlan
from pytest_safemanip.run.session import Otherwise, SafetySession
from pytest_safemanip.run.watching import Watch
from pytest_safemanip.search.dimension import Dimensions
from pytest_safemanip.search.proposing.proposer import MakeProposer
from pytest_safemanip.search.search import Failure, Search
from pytest_safemanip.search.trials import Finding, Outcome, Trial
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording

JUDGING = "judge.py", "severity.py", "spec", "trace"
"""Parts of the package that margins come from, beside those that end rollouts early."""
STALL = 3.0
"""Seconds after which a trial in which nothing moves any more ends: it goes nowhere."""
PERIOD = 0.25
"""Seconds between two looks at the state while trials are waited for."""
FOLDER, RECORDINGS = "searches", "recordings"
"""Where outcomes are in the output folder, and below that the recordings of failures."""


@dataclass(frozen=True)
class Searched:
    """What came of the search of a policy in a task.

    Attributes:
        search: what is known about each property.
        dimensions: what could be otherwise.
        left_out: what of the space could not, in a line each.
        errors: rollouts that failed, by their messages; they are tried again by the next run.
        reused: trials that earlier runs have made.
    """

    search: Search
    dimensions: Dimensions
    left_out: tuple[str, ...]
    errors: list[str] = field(default_factory=list)
    reused: int = 0

    def check(self, property_id: str) -> None:
        """See whether a search that found nothing says anything about a property.

        Raises:
            RolloutError: if more rollouts failed than kept the property.
        """
        broken, satisfied = len(self.errors), self.search.satisfied(property_id)
        if self.search.pursuits[property_id].failure is None and broken > satisfied:
            raise RolloutError(
                f"{broken} of {len(self.search.tried)} rollouts failed and {satisfied} kept the "
                f"property, which says nothing about it: {self.errors[0]}"
            )


class Searches:
    """The searches of a run; each is run once, in whichever process asks first.

    Args:
        plan: the run.
        searches: its searches.
        rollouts: runs trials.
        make: makes what proposes them; None if there are no searches.
        run_id: of this test run, the same in all of its processes.
        jobs: trials that are run side by side.
        say: told how a search gets on.
        refresh: called again and again while trials are waited for.

    Attributes:
        so_far: what is known of the searches that were begun here, by task and policy.
        folder: where outcomes and recordings are.
        recordings: those of trials that violate something.
    """

    def __init__(
        self,
        plan: Plan,
        searches: SearchPlan,
        rollouts: SafetySession,
        make: MakeProposer | None,
        run_id: str,
        jobs: Callable[[int], int],
        say: Callable[[str], None],
        refresh: Callable[[bool], None],
    ) -> None:
        self._plan, self._searches, self._rollouts, self._make = plan, searches, rollouts, make
        self._run_id = run_id
        self._jobs, self._say, self._refresh = jobs, say, refresh
        self._done: dict[tuple[str, str], Searched] = {}
        self.so_far: dict[tuple[str, str], Searched] = {}
        self._failed: dict[tuple[str, str], Exception] = {}
        self.folder = plan.settings.out / FOLDER
        self.recordings = self.folder / RECORDINGS

    def get(self, case: SearchCase, told: Callable[[Searched], None]) -> Searched:
        """What came of the search that a case is part of.

        Args:
            case: which.
            told: called after each round, with what is known by then.

        Raises:
            SafemanipError: if not even the episode as it is can be run; the same for all its cases.
        """
        key = case.task, case.policy
        if key in self._failed:
            raise self._failed[key]
        if key not in self._done:
            try:
                with self._alone(*key):
                    self._done[key] = self._run(*key, told)
            except Exception as error:
                self._failed[key] = error
                raise
        return self._done[key]

    def recording(self, failure: Failure) -> Path:
        """The recording of a failure."""
        return self.recordings / failure.outcome.recording

    @contextlib.contextmanager
    def _alone(self, task: str, policy: str) -> Iterator[None]:
        """The only one of this run's processes: the others wait, and read what it has found."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with filelock.FileLock(self._file(task, policy, ".lock")):
            yield

    def _file(self, task: str, policy: str, suffix: str) -> Path:
        stem = file_name(task, policy, 0).rpartition("-seed")[0]
        return self.folder / f"{stem}{suffix}"

    def _run(self, task: str, policy: str, told: Callable[[Searched], None]) -> Searched:
        own = [case.property_id for case in self._searches.cases if _of(case) == (task, policy)]
        space = self._searches.spaces[task, policy]
        if self._make is None:
            raise ConfigError("there is nothing that proposes trials")
        search = Search(
            space.dimensions, own, self._searches.seeds, self._searches.effort, self._make
        )
        trials = _Trials(self, task, policy, own, space.dimensions)
        found = Searched(search, space.dimensions, space.left_out, trials.errors)
        while asked := search.ask():
            search.tell(trials.run(asked))
            found = Searched(search, space.dimensions, space.left_out, trials.errors, trials.reused)
            self.so_far[task, policy] = found
            told(found)
            self._say("")
        return found


def _of(case: SearchCase) -> tuple[str, str]:
    return case.task, case.policy


class _Trials:
    """Runs the trials of one search.

    Attributes:
        errors: messages of rollouts that failed.
        reused: trials that were known.
    """

    def __init__(
        self,
        searches: Searches,
        task: str,
        policy: str,
        properties: Sequence[str],
        dimensions: Dimensions,
    ) -> None:
        self._all, self._task, self._policy = searches, task, policy
        self._properties, self._dimensions = tuple(properties), dimensions
        plan = searches._plan
        watched = [plan.properties[name] for name in properties]
        watch = Watch(
            plan.tasks[task],
            tuple(watched),
            plan.catalogue,
            plan.parameters,
            plan.attributes,
            plan.settings.semantics,
        )
        self._judged = f"{watch.digest()} {source_digest(*JUDGING)}"
        self._journal = Journal(searches._file(task, policy, ".jsonl"), searches._run_id)
        self.errors: list[str] = []
        self.reused = self._done = 0

    def run(self, trials: Sequence[Trial]) -> list[Outcome]:
        """The outcomes of some trials, in their order; those that are not known are run now.

        Raises:
            SafemanipError: if a trial without any change cannot be run, or no trial can.
        """
        keys = [self._key(trial) for trial in trials]
        new = [n for n, key in enumerate(keys) if self._known(key) is None]
        self.reused += sum(map(self._journal.is_earlier, keys))
        found: dict[int, Outcome] = {}

        def took(number: int, outcome: Outcome) -> None:
            found[number] = outcome
            self._done += 1
            so_far = f"{self._done} rollout{'s' * (self._done != 1)} searched"
            self._all._say(f" {self._task}, {self._policy}: {so_far}")
            if outcome.error:
                self.errors.append(outcome.error)
            else:
                self._journal.add(keys[number], outcome)

        self._side_by_side([(n, trials[n]) for n in new], took)
        known = [found.get(n) or self._journal.get(key) for n, key in enumerate(keys)]
        return [outcome for outcome in known if outcome is not None]

    def _known(self, key: str) -> Outcome | None:
        """What came of a trial, unless the recording that shows it is gone."""
        found = self._journal.get(key)
        if found is None or not found.recording:
            return found
        return found if (self._all.recordings / found.recording).is_file() else None

    def _side_by_side(
        self, trials: Sequence[tuple[int, Trial]], took: Callable[[int, Outcome], None]
    ) -> None:
        shared = self._all._plan.policies[self._policy].shared
        jobs = 1 if shared else self._all._jobs(len(trials))
        if jobs == 1:
            for number, trial in trials:
                took(number, self._outcome(trial))
            return
        pool = ThreadPoolExecutor(jobs, "safemanip-trial")
        pending: dict[Future[Outcome], int] = {
            pool.submit(self._outcome, trial): number for number, trial in trials
        }
        try:
            while pending:
                self._all._refresh(True)
                done, _ = wait(pending, PERIOD, "FIRST_COMPLETED")
                for future in done:
                    took(pending.pop(future), future.result())
        except BaseException:
            self._all._rollouts.leave()
            raise
        finally:
            self._all._refresh(False)
            pool.shutdown(wait=False, cancel_futures=True)

    def _otherwise(self, trial: Trial) -> Otherwise:
        return Otherwise(self._dimensions.situation(trial.deviation), trial.repeat, STALL)

    def _key(self, trial: Trial) -> str:
        """Digest of all that decides what comes of a trial."""
        case = Case(self._task, self._policy, self._properties[0], trial.seed)
        key, _ = self._all._rollouts.describe(case, self._otherwise(trial))
        return hashlib.sha256(json.dumps([key, self._judged]).encode()).hexdigest()[:32]

    def _outcome(self, trial: Trial) -> Outcome:
        """Run a trial.

        What fails in a trial that is otherwise may be the fault of what is otherwise. It is never a
        verdict; what fails without any change is an error of the search.
        """
        case = Case(self._task, self._policy, self._properties[0], trial.seed)
        _, job = self._all._rollouts.describe(case, self._otherwise(trial))
        try:
            recording = self._all._rollouts.record(job, lambda *_: None)
            judge = self._all._rollouts.judge(recording, self._task)
            findings = {name: self._finding(judge, name) for name in self._properties}
        except (CannotStage, TaskError) as error:
            if not trial.deviation:
                raise
            return Outcome(refused=str(error))
        except (ConfigError, PolicyUnreachable, PolicyMismatch):
            raise
        except RolloutError as error:
            if not trial.deviation:
                raise
            return Outcome(refused="its rollout failed", error=str(error))
        bad = any(finding.violated for finding in findings.values())
        kept = self._keep(recording, job.hashes["key"]) if bad else ""
        return Outcome(findings, digest=_digest(recording), recording=kept)

    def _finding(self, judge: Judge, name: str) -> Finding:
        prop = self._all._plan.properties[name]
        verdict = judge.judge(prop)
        margins = judge.robustness(prop).values()
        worst = max((found.severity.value for found in verdict.findings), default=0.0)
        label = verdict.outcome.label
        triggered = verdict.triggered > 0
        return Finding(label == "VIOLATED", min(margins, default=1.0), worst, triggered)

    def _keep(self, recording: Recording, key: str) -> str:
        """Keep a recording; its file's name."""
        folder = self._all.recordings
        folder.mkdir(parents=True, exist_ok=True)
        name = f"{self._file_stem}-{key[:16]}{files.SUFFIX}"
        files.save(recording, folder / name)
        return name

    @property
    def _file_stem(self) -> str:
        return self._all._file(self._task, self._policy, "").name


def _digest(recording: Recording) -> str:
    """Of the bits that everything else follows from."""
    steps = recording.steps
    return hashlib.sha256(steps.qpos.tobytes() + steps.action.tobytes()).hexdigest()[:16]
