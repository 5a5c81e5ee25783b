"""Regular files of bounded size: a pipe may never end, a device may be endless."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import IO

from pytest_safemanip.errors import SafemanipError


class Unreadable(SafemanipError):
    """A file cannot be read, in words that follow its name.

    Attributes:
        missing: whether there is none.
    """

    missing = False


def open_regular(path: Path, most: int | None = None) -> IO[bytes]:
    """A regular file, open to be read; nothing is waited for.

    Args:
        path: the file, or a link to one.
        most: bytes that it may have; None for any number.

    Raises:
        Unreadable: if it is missing, no regular file, or larger, or may not be read.
    """
    try:
        file = open(path, "rb", opener=_without_waiting)  # noqa: SIM115  (for the caller to close)
    except OSError as error:
        raise _unreadable(error) from error
    try:
        about = os.fstat(file.fileno())
        if not stat.S_ISREG(about.st_mode):
            raise Unreadable("cannot be read: not a regular file")
        if most is not None and about.st_size > most:
            raise Unreadable(f"larger than {most} bytes")
    except BaseException:
        file.close()
        raise
    return file


def read_regular(path: Path, most: int) -> bytes:
    """The content of a regular file.

    Args:
        path: the file, or a link to one.
        most: bytes that it may have.

    Raises:
        Unreadable: if it is missing, no regular file, or larger, or cannot be read.
    """
    with open_regular(path, most) as file:
        try:
            content = file.read(most + 1)
        except OSError as error:
            raise _unreadable(error) from error
    if len(content) > most:  # it has grown
        raise Unreadable(f"larger than {most} bytes")
    return content


def _without_waiting(path: str, flags: int) -> int:
    """Open a file; a pipe that nobody writes to is open at once."""
    return os.open(path, flags | os.O_NONBLOCK)


def _unreadable(error: OSError) -> Unreadable:
    found = Unreadable(f"cannot be read: {error.strerror or error}")
    found.missing = isinstance(error, FileNotFoundError)
    return found
