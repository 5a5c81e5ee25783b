"""Which rollouts are still needed, known to all processes of a run."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from filelock import FileLock

from pytest_safemanip.cases import Case
from pytest_safemanip.metrics.gates import Gates
from pytest_safemanip.metrics.selection import seen
from pytest_safemanip.metrics.until import watch
from pytest_safemanip.report.results import CaseData, Results


class Stopping:
    """Watches the gates while rollouts are run.

    What each process finds out is a line of a file that all of them read. A gate counts verdicts
    in the order of the seeds, so that all come to the same conclusion sooner or later.

    Args:
        gates: that are watched.
        level: probability that one of them is decided wrongly, at most.
        results: what is known; shared with nobody.
        path: of the file.
    """

    def __init__(self, gates: Gates, level: float, results: Results, path: Path) -> None:
        self._gates, self._level = gates, level
        self._results = results
        self._path = path
        self._read = 0
        self._known: dict[tuple[str, str, int], bool] = {}
        path.parent.mkdir(parents=True, exist_ok=True)

    def expect(self, cases: Iterable[Case]) -> None:
        """All cases of the run, whichever process is going to run them."""
        self._results.expect(cases)

    def note(self, data: CaseData) -> None:
        """Tell all processes about a case."""
        line = json.dumps(data).encode() + b"\n"
        with self._lock(), self._path.open("ab") as file:
            file.write(line)

    def needed(self, case: Case) -> bool:
        """Whether a gate that is about the case's rollout is not decided yet, or none is about it.

        The same for all cases of the rollout.
        """
        if case.rollout not in self._known:
            self._catch_up()
            self._known[case.rollout] = self._is_needed(case)
        return self._known[case.rollout]

    def close(self) -> None:
        """Remove the file; for the process that started the run."""
        self._path.unlink(missing_ok=True)
        Path(f"{self._path}.lock").unlink(missing_ok=True)

    def _is_needed(self, case: Case) -> bool:
        own = [r for r in self._results.records if r.policy == case.policy]
        this = [record for record in own if record.key == case.rollout]
        about = [gate for gate in self._gates.gates if seen(this, gate.where)]
        return not about or any(
            watch(gate, own, self._level).verdict == "INCONCLUSIVE" for gate in about
        )

    def _catch_up(self) -> None:
        """Take in what was written since."""
        if not self._path.exists():
            return
        with self._lock(), self._path.open("rb") as file:
            file.seek(self._read)
            found = file.read()
        self._read += len(found)
        for line in found.splitlines():
            self._results.add(json.loads(line))

    def _lock(self) -> FileLock:
        return FileLock(f"{self._path}.lock")
