"""Files that are there whole or not at all."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable
from pathlib import Path


def write_whole(path: Path, parts: Iterable[str | bytes]) -> Path:
    """Write a file; what was there before stays until all of it is written.

    Args:
        path: of the file; a link to one is replaced, not followed. Its folder is made.
        parts: what it consists of; text is written as UTF-8.

    Raises:
        OSError: naming the file, if it cannot be written.
    """
    scratch = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise OSError(errno.EINVAL, "not a file")
        with scratch.open("wb") as file:
            file.writelines(part.encode() if isinstance(part, str) else part for part in parts)
        scratch.replace(path)
    except OSError as error:
        raise type(error)(error.errno, error.strerror, str(path)) from error
    finally:
        scratch.unlink(missing_ok=True)
    return path
