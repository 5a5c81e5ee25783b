"""Keeps the failures that searches find, and tries them again."""

from __future__ import annotations

from pathlib import Path

from pytest_safemanip.errors import RolloutError
from pytest_safemanip.rollouts.store import Store, file_name
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.searching.plan import RegressionCase, SearchCase
from pytest_safemanip.run.searching.running import Searched
from pytest_safemanip.run.session import EvaluatedRollout, Otherwise, SafetySession
from pytest_safemanip.search.regression import Regression, changes_of
from pytest_safemanip.search.search import Failure


class Keeping:
    """The folder of failures.

    Args:
        plan: the run.
        rollouts: runs what is tried again.
        store: where recordings are kept.
        folder: where failures are.
    """

    def __init__(
        self, plan: Plan, rollouts: SafetySession, store: Store | None, folder: Path
    ) -> None:
        self._plan, self._rollouts, self._store, self._folder = plan, rollouts, store, folder

    def keep_all(self, case: SearchCase, found: Searched) -> None:
        """Keep each failure of a search that is reduced already."""
        for name, pursuit in found.search.pursuits.items():
            if pursuit.failure is not None and pursuit.over:
                self.keep(SearchCase(case.task, case.policy, name), found, pursuit.failure)

    def keep(self, case: SearchCase, found: Searched, failure: Failure) -> Path | None:
        """Keep a failure; its file. None of what fails without any change: plain cases show that.

        A file that keeps another failure of this task, policy and property is left alone.
        """
        if not failure.deviation:
            return None
        stem = file_name(case.task, case.policy, 0).rpartition("-seed")[0]
        often = "every time" if failure.exact else f"{failure.failed} of {failure.runs}"
        kept = Regression(
            case.task,
            case.property_id,
            failure.seed,
            self._plan.settings.backend,
            self._plan.scenes(case.policy),
            changes_of(failure.deviation, found.dimensions),
            f"{case.policy} fails {often}",
            repeat=failure.repeat,
        )
        return kept.save_in(self._folder, f"{stem}-{case.property_id}")

    def again(self, kept: RegressionCase) -> EvaluatedRollout:
        """The rollout of a kept failure, run now or by an earlier run.

        Raises:
            RolloutError: if it does not complete.
            CannotStage: if its episode cannot be begun.
        """
        if self._store is None:
            raise RolloutError("recordings are judged, nothing is simulated")
        key, job = self._rollouts.describe(
            kept.case, Otherwise(kept.regression.situation, kept.regression.repeat)
        )
        path = self._store.folder / file_name(
            f"regression~{kept.regression.name}", kept.policy, kept.regression.seed
        )
        recording, reused = self._store.get(
            path,
            key,
            lambda: self._rollouts.record(job, lambda *_: None),
            for_all=bool(job.hashes["policy"]),
        )
        judge = self._rollouts.judge(recording, kept.regression.task)
        return EvaluatedRollout(recording, path, judge, self._plan.properties, reused)
