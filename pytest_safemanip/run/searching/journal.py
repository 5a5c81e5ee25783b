"""The outcomes of a search on disk, a line each: an interrupted search goes on where it stopped."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.search.trials import Outcome

LONGEST = 100_000
"""Characters of a line."""


class Journal:
    """Outcomes by the key of their rollout, in a file that is only added to.

    Args:
        path: the file; there may be none yet.
        run_id: of this test run, which is written beside each outcome.

    Raises:
        ConfigError: if it holds something else. A last line that was cut off is none.
    """

    def __init__(self, path: Path, run_id: str) -> None:
        self._path, self._run_id = path, run_id
        self._known: dict[str, Outcome] = {}
        self._runs: dict[str, str] = {}
        lines = path.read_text(encoding="utf-8").split("\n") if path.exists() else [""]
        for number, line in enumerate(lines[:-1], start=1):
            key, run, outcome = _read(line, f"{path}:{number}")
            self._known[key], self._runs[key] = outcome, run
        if lines[-1]:  # whoever wrote it was killed
            path.write_text("".join(f"{line}\n" for line in lines[:-1]), encoding="utf-8")

    def get(self, key: str) -> Outcome | None:
        """What came of a rollout, if that is known."""
        return self._known.get(key)

    def is_earlier(self, key: str) -> bool:
        """Whether an earlier test run has made a rollout."""
        return self._runs.get(key, self._run_id) != self._run_id

    def add(self, key: str, outcome: Outcome) -> None:
        """Note what came of a rollout."""
        self._known[key], self._runs[key] = outcome, self._run_id
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("a", encoding="utf-8") as file:
            line = {"key": key, "run": self._run_id, "outcome": outcome.to_json()}
            file.write(f"{json.dumps(line)}\n")


def _read(line: str, place: str) -> tuple[str, str, Outcome]:
    try:
        values: Any = json.loads(line) if len(line) < LONGEST else None
        key, run, outcome = values["key"], values["run"], values["outcome"]
    except (ValueError, TypeError, KeyError) as error:
        raise ConfigError(f"{place}: no outcome of a trial; delete the file") from error
    return str(key), str(run), Outcome.from_json(outcome, place)
