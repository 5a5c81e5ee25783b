"""The recordings of a run on disk: each rollout is run once, whoever asks first.

There is one file for each (task, policy, seed). It is used again when everything that decides its
content is the same (its key), and replaced otherwise.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import filelock

from pytest_safemanip.errors import ConfigError, RolloutError, SafemanipError, TraceError
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording

_SAFE = str.maketrans({":": "~", "/": ","})
"""What file systems and upload services refuse, by what no policy's name contains."""


def key_of(parts: Mapping[str, Any]) -> str:
    """Digest of everything that decides a recording's content."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def prepare_output(folder: Path) -> None:
    """Make the output folder, which version control is not to see.

    Raises:
        ConfigError: if it cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / ".gitignore").write_text("*\n")
    except OSError as error:
        raise ConfigError(
            f"--safemanip-out: cannot write to {folder} ({error.strerror}); name another folder"
        ) from error


class Store:
    """Recordings in a folder, shared by the processes of a run.

    Args:
        folder: where they are; made if missing.
        run: identifies this test run, the same in all of its processes.
    """

    def __init__(self, folder: Path, run: str) -> None:
        self.folder = folder
        self._run = run
        self._locks = folder / ".locks"
        self._locks.mkdir(parents=True, exist_ok=True)

    def path(self, policy: str, task: str, seed: int) -> Path:
        """The file of a rollout."""
        return self.folder / f"{task}-{policy.translate(_SAFE)}-seed{seed}{files.SUFFIX}"

    def get(self, path: Path, key: str, run: Callable[[], Recording]) -> Recording:
        """The recording with this key: from disk, or by running the rollout.

        A rollout that failed is not tried again within the same test run, nor is one whose
        process died while it ran.

        Raises:
            RolloutError: if the rollout does not complete.
        """
        with filelock.FileLock(self._locks / f"{path.name}.lock"):
            found = self._load(path, key)
            if found is not None:
                return found
            marker = self._locks / f"{path.name}.state"
            self._check_marker(marker, key)
            self._mark(marker, key, "the process that ran this rollout died")
            try:
                recording = run()
            except SafemanipError as error:
                self._mark(marker, key, str(error))
                raise
            except BaseException:
                marker.unlink(missing_ok=True)  # interrupted: nothing is known about the rollout
                raise
            files.save(recording, path)
            marker.unlink()
            return recording

    def _load(self, path: Path, key: str) -> Recording | None:
        if not path.exists():
            return None
        try:
            if files.load_episode(path).hashes.get("key") == key:
                return files.load(path)
        except TraceError:
            return None  # damaged, or of another version: it is recorded again
        return None

    def _check_marker(self, marker: Path, key: str) -> None:
        """Raise what is known about this rollout from another process of this run."""
        try:
            known = json.loads(marker.read_text())
        except (OSError, ValueError):
            return
        if known.get("run") == self._run and known.get("key") == key:
            raise RolloutError(str(known.get("error")))

    def _mark(self, marker: Path, key: str, error: str) -> None:
        marker.write_text(json.dumps({"run": self._run, "key": key, "error": error}))
