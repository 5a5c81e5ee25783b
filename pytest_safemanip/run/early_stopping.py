"""Which rollouts are still needed, known to all processes of a run."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from filelock import FileLock

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.early_stopping import watch
from pytest_safemanip.metrics.gates import Gates
from pytest_safemanip.metrics.records import RolloutKey
from pytest_safemanip.metrics.selection import select
from pytest_safemanip.run.cases import Case
from pytest_safemanip.run.results import CaseData, Results


class EarlyStopping:
    """Watches the gates while rollouts are run.

    What each process finds out is a line of a file that all of them read. A gate counts verdicts
    in the order of the seeds, so that all come to the same conclusion sooner or later.

    Args:
        gates: that are watched.
        alpha: probability that one of them is decided wrongly, at most.
        results: what is known; shared with nobody.
        path: of the file.
    """

    def __init__(self, gates: Gates, alpha: float, results: Results, path: Path) -> None:
        self._gates, self._alpha = gates, alpha
        self._results = results
        self._path = path
        self._read = 0
        self._known: dict[RolloutKey, bool] = {}
        path.parent.mkdir(parents=True, exist_ok=True)

    def expect(self, cases: Iterable[Case]) -> None:
        """All cases of the run, whichever process is going to run them."""
        self._results.expect(cases)

    def note(self, data: CaseData) -> None:
        """Tell all processes about a case.

        Raises:
            ConfigError: if the file cannot be written.
        """
        line = json.dumps(data).encode()
        try:
            with self._lock(), self._path.open("ab") as file:
                file.write(b"\n" + line + b"\n")  # whatever a process left that was killed here
        except OSError as error:
            raise ConfigError(f"{self._path}: cannot be written ({error.strerror})") from error

    def needed(self, case: Case) -> bool:
        """Whether a gate that is about the case's rollout is not decided yet, or none is about it.

        The same for all cases of the rollout.
        """
        if case.rollout not in self._known:
            self._known[case.rollout] = self.undecided(case)
        return self._known[case.rollout]

    def undecided(self, case: Case) -> bool:
        """The same as far as is known now, which later cases may change."""
        self._catch_up()
        return self._is_needed(case)

    def close(self) -> None:
        """Remove the file; for the process that started the run."""
        self._path.unlink(missing_ok=True)
        Path(f"{self._path}.lock").unlink(missing_ok=True)

    def _is_needed(self, case: Case) -> bool:
        own = [r for r in self._results.records if r.policy == case.policy]
        this = [record for record in own if record.key == case.rollout]
        about = [gate for gate in self._gates.gates if select(this, gate.where)]
        return not about or any(
            watch(gate, own, self._alpha).verdict == "INCONCLUSIVE" for gate in about
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
            try:
                data = json.loads(line)
            except ValueError:
                continue  # a process was killed while it wrote
            self._results.add(data)

    def _lock(self) -> FileLock:
        return FileLock(f"{self._path}.lock")
