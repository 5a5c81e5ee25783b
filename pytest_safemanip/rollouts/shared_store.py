"""Recordings that several machines share: an object store, or a folder that all of them see.

Each is stored under its key, so that nothing is ever replaced but what is damaged, and a listing
tells what there is. Files that come from there are untrusted like any other: they are checked when
they are read.
"""

from __future__ import annotations

import os
import tempfile
import threading
import uuid
import warnings
from functools import cached_property
from pathlib import Path

from pytest_safemanip.errors import ConfigError, first_line, install_command
from pytest_safemanip.trace.files import SUFFIX

MAX_BYTES = 512 * 2**20
"""Sanity bound on a recording's file."""


class NotShared(UserWarning):
    """A recording is on this machine alone, since the store could not be written."""


class SharedStore:
    """A folder of recordings at a URL. Threads and processes may share it.

    Args:
        url: of the folder, as fsspec understands it: ``s3://bucket/folder``, ``gs://``,
            ``file:///mnt/all``.

    Raises:
        ConfigError: if the library of that protocol is missing, or the folder cannot be listed.
    """

    def __init__(self, url: str) -> None:
        self.url = url if url.endswith("://") else url.rstrip("/")
        try:
            import fsspec
        except ModuleNotFoundError:
            raise ConfigError(
                f"--safemanip-store needs fsspec: {install_command('store')}"
            ) from None
        try:
            self._files, self._root = fsspec.core.url_to_fs(self.url)
        except (ImportError, ValueError) as error:
            raise ConfigError(f"--safemanip-store: {self.url}: {first_line(error)}") from error
        if not self._root.strip("/") or ".." in self._root.split("/"):
            raise ConfigError(
                f"--safemanip-store: {url}: expected a bucket or folder, as in s3://bucket/folder"
            )
        slash = "/" if self._root.startswith("/") else ""
        self._top = slash + self._root.lstrip("/").partition("/")[0]
        self._lock = threading.Lock()

    def knows(self, name: str) -> bool:
        """Whether there is a recording with this name, of whatever key.

        Raises:
            ConfigError: if the store cannot be listed.
        """
        return _folder(self._place(name, "")) in self._folders

    def has(self, name: str, key: str) -> bool:
        """Whether the recording with this name and key is there; as of the first question.

        Raises:
            ConfigError: if the store cannot be listed.
        """
        return self._place(name, key) in self._listing

    def fetch(self, name: str, key: str, path: Path) -> bool:
        """Copy a recording from there, whole or not at all.

        Args:
            name: of the file.
            key: of the recording.
            path: where it is put.

        Returns:
            Whether it was there.

        Raises:
            ConfigError: if the store cannot be read.
        """
        if not self.has(name, key):
            return False
        place = self._place(name, key)
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, scratch = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        os.close(handle)
        try:
            if self._files.info(place)["size"] > MAX_BYTES:
                raise ConfigError(f"{self.url}: {place} is larger than {MAX_BYTES} bytes")
            self._files.get_file(place, scratch)
            os.chmod(scratch, 0o644)
            os.replace(scratch, path)
        except FileNotFoundError:
            return False  # somebody has removed it since
        except OSError as error:
            raise ConfigError(f"--safemanip-store: {self.url}: {first_line(error)}") from error
        finally:
            Path(scratch).unlink(missing_ok=True)
        return True

    def put(self, name: str, key: str, path: Path) -> None:
        """Copy a recording there. What fails is a warning: nothing is lost, it is here."""
        place = self._place(name, key)
        try:
            self._files.makedirs(_folder(place), exist_ok=True)
            self._put_whole(str(path), place)
        except Exception as error:  # each protocol's library has errors of its own
            warnings.warn(
                NotShared(f"{path.name} is not in {self.url}: {first_line(error)}"), stacklevel=2
            )
            return
        with self._lock:
            self._listing.add(place)
            self._folders.add(_folder(place))

    def forget(self, name: str, key: str) -> None:
        """What is there is damaged: it is to be put there again."""
        with self._lock:
            self._listing.discard(self._place(name, key))

    def _put_whole(self, path: str, place: str) -> None:
        """Object stores show a file when all of it is there; folders show what is half copied, and
        for ever if the process is killed.
        """
        if "file" not in self._files.protocol:
            self._files.put_file(path, place)
            return
        scratch = f"{place}.{uuid.uuid4().hex}"
        try:
            self._files.put_file(path, scratch)
            os.replace(scratch, place)
        finally:
            Path(scratch).unlink(missing_ok=True)

    def _place(self, name: str, key: str) -> str:
        return f"{self._root}/{name.removesuffix(SUFFIX)}/{key[:32]}{SUFFIX}"

    @cached_property
    def _folders(self) -> set[str]:
        return {_folder(place) for place in self._listing}

    @cached_property
    def _listing(self) -> set[str]:
        try:
            # Writing would make a bucket whose name was misspelt.
            if not self._files.exists(self._top):
                raise ConfigError(
                    f"--safemanip-store: {self.url}: there is no bucket or folder {self._top!r}"
                )
            return set(self._files.find(self._root))
        except ConfigError:
            raise
        except FileNotFoundError:
            return set()
        except Exception as error:
            raise ConfigError(
                f"--safemanip-store: {self.url} cannot be listed: {first_line(error)}"
            ) from error


def _folder(place: str) -> str:
    return place.rpartition("/")[0]
