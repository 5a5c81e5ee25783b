"""The recordings of a run on disk: each rollout is run once, whoever asks first.

There is one file for each (task, policy, seed). It is used again when everything that decides its
content is the same (its key), and replaced otherwise.
"""

from __future__ import annotations

import contextlib
import glob
import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import filelock

from pytest_safemanip.errors import (
    ConfigError,
    RolloutError,
    SafemanipError,
    TraceError,
    WorkerDied,
)
from pytest_safemanip.rollouts.shared_store import SharedStore
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording

_SAFE = str.maketrans({":": "~", "/": ","})
"""Replacements for characters that file systems and upload services refuse."""


def key_of(parts: Mapping[str, Any]) -> str:
    """Digest of everything that decides a recording's content."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def file_name(task: str, policy: str, seed: int) -> str:
    """Name of the file of a rollout."""
    return f"{task}-{policy.translate(_SAFE)}-seed{seed}{files.SUFFIX}"


def prepare_output(folder: Path) -> None:
    """Make the output folder; one that is new is ignored by version control.

    Raises:
        ConfigError: if it cannot be written.
    """
    with _writable(folder):
        if not folder.is_dir():
            folder.mkdir(parents=True, exist_ok=True)
            (folder / ".gitignore").write_text("*\n")


class Store:
    """Recordings in a folder, shared by the processes of a run.

    Args:
        folder: where they are; made if missing.
        run_id: identifies this test run, the same in all of its processes.
        fresh: whether recordings of earlier runs are replaced, whatever their keys.
        shared: where they are kept for other machines, too.

    Raises:
        ConfigError: if the folder cannot be written.
    """

    def __init__(
        self, folder: Path, run_id: str, fresh: bool = False, shared: SharedStore | None = None
    ) -> None:
        self.folder, self._shared = folder, shared
        self._run_id, self._fresh = run_id, fresh
        self._locks = folder / ".locks"
        with _writable(folder):
            self._locks.mkdir(parents=True, exist_ok=True)

    def path(self, policy: str, task: str, seed: int) -> Path:
        """The file of a rollout."""
        return self.folder / file_name(task, policy, seed)

    def knows(self, path: Path) -> bool:
        """Whether there is a recording of this rollout, of whatever key."""
        return path.exists() or (self._shared is not None and self._shared.knows(path.name))

    def has(self, path: Path, key: str) -> bool:
        """Whether an earlier run left the recording with this key, and it is used again."""
        if self._fresh:
            return False
        try:
            if files.load_episode(path).hashes.get("key") == key:
                return True
        except (OSError, TraceError):
            pass  # none, or of no use
        return self._shared is not None and self._shared.has(path.name, key)

    def get(
        self, path: Path, key: str, run: Callable[[], Recording], for_all: bool = True
    ) -> tuple[Recording, bool]:
        """The recording with this key: from disk, or by running the rollout.

        A rollout that failed is not tried again within the same test run, nor is one whose
        process died while it ran.

        Args:
            path: of the file.
            key: of the recording.
            run: runs the rollout.
            for_all: whether another run may ever use it; if not, it is kept on this machine alone.

        Returns:
            The recording, and whether it is of an earlier test run.

        Raises:
            RolloutError: if the rollout does not complete.
        """
        with _room(path), filelock.FileLock(self._locks / f"{path.name}.lock"):
            marker = self._locks / f"{path.name}.state"
            known = self._known(marker, key)
            recorded = known is not None and not str(known)
            found = self._load(path, key) if recorded or not self._fresh else None
            if found is not None:
                self._share(path, key, for_all)
                return found, known is None
            if known is not None and not recorded:
                raise known
            self._mark(marker, key, WorkerDied("the process that ran this rollout died"))
            self._tidy(path)
            try:
                recording = run()
                files.save(recording, path)
            except SafemanipError as error:
                self._mark(marker, key, error)
                raise
            except BaseException:
                marker.unlink(missing_ok=True)  # interrupted: nothing is known about the rollout
                raise
            self._mark(marker, key, RolloutError())
            self._share(path, key, for_all)
            return recording, False

    def _tidy(self, path: Path) -> None:
        """Remove what a process left that died while it wrote this recording."""
        for scratch in self.folder.glob(f".{glob.escape(path.name)}.*"):
            scratch.unlink(missing_ok=True)

    def _share(self, path: Path, key: str, for_all: bool) -> None:
        if for_all and self._shared is not None and not self._shared.has(path.name, key):
            self._shared.put(path.name, key, path)

    def _load(self, path: Path, key: str) -> Recording | None:
        found = _read(path, key)
        if found is None and self._shared is not None and self._shared.fetch(path.name, key, path):
            found = _read(path, key)
            if found is None:
                self._shared.forget(path.name, key)
        return found

    def _known(self, marker: Path, key: str) -> RolloutError | None:
        """This run's result of a rollout: its error, one without words if it was recorded, or
        None.
        """
        try:
            known = json.loads(marker.read_text())
        except (OSError, ValueError):
            return None
        if known.get("run") == self._run_id and known.get("key") == key:
            error = RolloutError(str(known.get("error")))
            error.infrastructure = known.get("infrastructure") is True
            error.restarts = int(known.get("restarts", 0))
            return error
        return None

    def _mark(self, marker: Path, key: str, error: SafemanipError) -> None:
        restarts = error.restarts if isinstance(error, RolloutError) else 0
        about = {
            "error": str(error),
            "infrastructure": error.infrastructure,
            "restarts": restarts,
        }
        marker.write_text(json.dumps({"run": self._run_id, "key": key, **about}))


def _read(path: Path, key: str) -> Recording | None:
    if not path.exists():
        return None
    try:
        if files.load_episode(path).hashes.get("key") == key:
            return files.load(path)
    except TraceError:
        return None  # damaged, or of another version: it is recorded again
    return None


@contextlib.contextmanager
def _writable(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ConfigError(
            f"--safemanip-out: cannot write to {folder} ({error.strerror}); name another folder"
        ) from error


@contextlib.contextmanager
def _room(path: Path) -> Iterator[None]:
    """Says plainly that the disk is full; what a rollout itself raises is none of the disk's."""
    try:
        yield
    except OSError as error:
        raise RolloutError(
            f"{path}: cannot be kept ({error.strerror}); make room, or name another folder with "
            "--safemanip-out"
        ) from None
