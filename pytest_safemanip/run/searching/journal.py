"""The outcomes of a search on disk, a line each: an interrupted search goes on where it stopped."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.search.trials import Outcome

FORMAT = 1
"""Changes with what is written; the first line says it."""
LONGEST = 100_000
"""Characters of a line."""
REMEDY = "delete the file, and the search begins anew"


class Journal:
    """Outcomes by the key of their rollout, in a file that is only added to.

    Args:
        path: the file; there may be none yet.
        run_id: of this test run, which is written beside each outcome.

    Raises:
        ConfigError: if it holds something else, or is of another version. A last line that was cut
            off is none.
    """

    def __init__(self, path: Path, run_id: str) -> None:
        self._path, self._run_id = path, run_id
        self._known: dict[str, Outcome] = {}
        self._runs: dict[str, str] = {}
        lines = _lines(path)
        if lines[:-1]:
            _check_format(lines[0], path)
        for number, line in enumerate(lines[1:-1], start=2):
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
            if file.tell() == 0:
                file.write(f"{json.dumps({'format': FORMAT})}\n")
            line = {"key": key, "run": self._run_id, "outcome": outcome.to_json()}
            file.write(f"{json.dumps(line)}\n")


def _lines(path: Path) -> list[str]:
    """The lines of the file; what is after the last line's end is one, too."""
    try:
        return path.read_text(encoding="utf-8").split("\n") if path.exists() else [""]
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read ({error}); {REMEDY}") from error


def _check_format(line: str, path: Path) -> None:
    values = _parsed(line)
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        raise ConfigError(f"{path}: not of this version of pytest-safemanip; {REMEDY}")


def _parsed(line: str) -> Any:
    try:
        return json.loads(line) if len(line) < LONGEST else None
    except (ValueError, RecursionError):
        return None


def _read(line: str, place: str) -> tuple[str, str, Outcome]:
    values = _parsed(line)
    try:
        outcome = Outcome.from_json(values["outcome"], place)
        return str(values["key"]), str(values["run"]), outcome
    except (TypeError, KeyError, ConfigError) as error:
        raise ConfigError(f"{place}: no outcome of a trial; {REMEDY}") from error
