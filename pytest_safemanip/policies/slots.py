"""Slots at a server, shared by the threads and processes of a run."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import threading
from collections.abc import Iterator
from pathlib import Path

PERIOD = 0.002
"""Seconds between two looks at a slot that another process has."""


class Slots:
    """Numbered slots, each taken by one at a time; a process that dies gives its own back.

    Each is a file that is locked. ``filelock`` opens and closes it each time, 200 us instead of 2:
    too much for what is looked at every 2 ms beside simulators.

    Args:
        folder: for the files; made if missing.
        name: of what they are slots of; the same in all processes.
    """

    def __init__(self, folder: Path, name: str) -> None:
        self._folder, self._name = folder, hashlib.sha256(name.encode()).hexdigest()[:16]
        self._files: dict[int, int] = {}
        self._held: set[int] = set()
        self._returned = threading.Condition()

    def take(self, number: int) -> bool:
        """Take a slot if it is free. Never waits."""
        with self._returned:
            return self._take(number)

    def give_back(self, number: int) -> None:
        """Free a slot that was taken."""
        with self._returned:
            fcntl.flock(self._files[number], fcntl.LOCK_UN)
            self._held.discard(number)
            self._returned.notify()

    @contextlib.contextmanager
    def one(self, among: int) -> Iterator[None]:
        """Hold any of the first slots; waits until one is free.

        Args:
            among: how many slots there are.
        """
        with self._returned:
            while (number := self._first_free(among)) is None:
                ours = len(self._held) >= among
                self._returned.wait(None if ours else PERIOD)
        try:
            yield
        finally:
            self.give_back(number)

    def close(self) -> None:
        """Close the files, and free what is held."""
        with self._returned:
            while self._files:
                os.close(self._files.popitem()[1])
            self._held.clear()

    def _first_free(self, among: int) -> int | None:
        return next((number for number in range(among) if self._take(number)), None)

    def _take(self, number: int) -> bool:
        if number in self._held:
            return False
        if number not in self._files:
            self._folder.mkdir(parents=True, exist_ok=True)
            path = self._folder / f"{self._name}-{number}.lock"
            self._files[number] = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(self._files[number], fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        self._held.add(number)
        return True
