"""What an importer may read: the files of one folder, of one wheel, or one file's folder."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import IO

from pytest_safemanip.decoding.files import Unreadable, open_regular
from pytest_safemanip.errors import ConfigError, TraceError, printable

MOST_FILES = 1_000_000
LARGEST_MEMBER = 2**30
MOST_TIMES = 100
"""So many times its compressed form a member of an archive may be: data are never that dull."""
ARCHIVES = (".whl", ".zip")
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


class Source:
    """The files that an importer may read, by their paths within the source.

    Nothing outside is read: a name that leads out of it, by ``..`` or by a link, is refused.

    Args:
        path: a folder, a wheel or zip, or a file, which stands for its folder; it may be a link
            itself, since somebody has named it.

    Raises:
        ConfigError: if it does not exist, is neither file nor folder, or is no wheel though it is
            called one.
    """

    def __init__(self, path: Path) -> None:
        if not path.exists():
            raise ConfigError(f"{path}: no such file or directory")
        if not path.is_file() and not path.is_dir():
            raise ConfigError(f"{path}: neither a file nor a folder")
        self.path = path
        self._named = path.name if path.is_file() else ""
        self._zip: zipfile.ZipFile | None = None
        if self._named and path.suffix in ARCHIVES:
            try:
                self._zip = zipfile.ZipFile(path)
            except zipfile.BadZipFile as error:
                raise ConfigError(f"{path}: not a zip archive, or a truncated one") from error
        self.root = path.parent if self._named else path

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Paths of the files that the user named: all of a folder or wheel, or the one file.

        Raises:
            ConfigError: if there are more than a million.
        """
        if self._zip is not None:
            return tuple(sorted(name for name in self._members if not name.endswith("/")))
        if self._named:
            return (self._named,)
        return tuple(sorted(self._walk()))

    def _walk(self) -> Iterator[str]:
        for count, path in enumerate(self.root.rglob("*")):
            if count >= MOST_FILES:
                raise ConfigError(f"{self.path}: more than {MOST_FILES} files; name a part of it")
            place = path.relative_to(self.root)
            # What begins with a point is half a dataset, or somebody's version control.
            if path.is_file() and not any(part.startswith(".") for part in place.parts):
                yield place.as_posix()

    def has(self, name: str) -> bool:
        """Whether there is a file of this path, named by the user or beside it."""
        try:
            where = self._place(name)
        except TraceError:
            return False
        return where in self._members if self._zip is not None else (self.root / where).is_file()

    @cached_property
    def _members(self) -> frozenset[str]:
        return frozenset(self._zip.namelist()) if self._zip is not None else frozenset()

    def read(self, name: str, most: int) -> bytes:
        """The content of a file.

        Raises:
            TraceError: if it leads out of the source, is larger than ``most`` bytes, or cannot be
                read.
        """
        with self.open(name, most) as stream:
            content = stream.read(most + 1)
        if len(content) > most:
            raise TraceError(f"{printable(name)}: more than {most} bytes")
        return content

    def open(self, name: str, most: int = LARGEST_MEMBER) -> IO[bytes]:
        """A file as a stream that can be sought in.

        Raises:
            TraceError: likewise; ``most`` is for members of archives, which are unpacked.
        """
        where = self._place(name)
        try:
            if self._zip is not None:
                about = self._zip.getinfo(where)
                if about.file_size > most:
                    raise TraceError(f"{printable(name)}: more than {most} bytes")
                if about.compress_type not in METHODS:
                    raise TraceError(f"{printable(name)}: packed in another way than deflated")
                if about.file_size > MOST_TIMES * about.compress_size + 2**20:
                    raise TraceError(
                        f"{printable(name)}: it unpacks to {about.file_size} bytes, more than "
                        f"{MOST_TIMES} times its size"
                    )
                return io.BytesIO(self._zip.read(where))
            return open_regular(self.root / where)
        except Unreadable as error:
            raise TraceError(f"{printable(name)}: {error}") from error
        except (OSError, KeyError, EOFError, RuntimeError, zlib.error, zipfile.BadZipFile) as error:
            why = getattr(error, "strerror", None) or error
            raise TraceError(f"{printable(name)}: cannot be read ({why})") from error

    def _place(self, name: str) -> str:
        """A name as it is in the source.

        Raises:
            TraceError: if it leads out of it.
        """
        parts = PurePosixPath(name).parts
        where = PurePosixPath(*parts).as_posix()
        if not parts or ".." in parts or where.startswith("/") or "\0" in name:
            raise TraceError(f"{printable(name)}: leads out of {self.path}")
        if self._zip is None and where != self._named:
            place = (self.root / where).resolve()
            if not place.is_relative_to(self.root.resolve()):
                raise TraceError(
                    f"{printable(name)}: leads out of {self.path}, by a link; no links are "
                    "followed: copy what they lead to (cp -rL)"
                )
        return where
