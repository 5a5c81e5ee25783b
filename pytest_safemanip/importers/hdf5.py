"""HDF5 of strangers, read without following it anywhere else."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, TraceError, install_command, printable
from pytest_safemanip.importers.source import Source

SUFFIXES = (".hdf5", ".h5")
MAGIC = b"\x89HDF\r\n\x1a\n"
LARGEST_ARRAY = 2**30
LONGEST_TEXT = 16 * 2**20


class Group:
    """A group of a file: what hangs on it by hard links, and its attributes.

    Args:
        group: of h5py.
        path: where it is, for errors.
    """

    def __init__(self, group: Any, path: str) -> None:
        self._group, self.path = group, path

    def names(self) -> list[str]:
        """The names below it, numbers in the order of numbers.

        Raises:
            TraceError: if they cannot be read.
        """
        with _damage(self.path):
            found = list(self._group)
        if not all(isinstance(name, str) for name in found):
            raise TraceError(f"{self.path}: a name in it is not UTF-8")
        return sorted(found, key=lambda name: (len(name), name))

    def __contains__(self, name: str) -> bool:
        with _damage(self._of(name)):
            return name in self._group

    def group(self, name: str) -> Group:
        """A group below it.

        Raises:
            TraceError: if it is another thing, or elsewhere.
        """
        import h5py

        found = self._at(name)
        if not isinstance(found, h5py.Group):
            raise TraceError(f"{self._of(name)} is no group")
        return Group(found, self._of(name))

    def array(self, name: str) -> NDArray[np.float64]:
        """An array of numbers below it.

        Raises:
            TraceError: if it is another thing, of a type that is no number, too large, damaged, or
                kept in another file.
        """
        import h5py

        found, where = self._at(name), self._of(name)
        if not isinstance(found, h5py.Dataset) or found.shape is None:
            raise TraceError(f"{where} is no array")
        if found.dtype.kind not in "fiub":
            raise TraceError(f"{where} has the type {printable(str(found.dtype))}, not numbers")
        if found.is_virtual or found.external:
            raise TraceError(f"{where} is kept in another file, which is not read")
        size = max(found.size, math.prod(found.chunks or ()))  # a chunk is unpacked as a whole
        if size * 8 > LARGEST_ARRAY:
            raise TraceError(f"{where}: {size} numbers, more than the limit")
        with _damage(where):
            return np.asarray(found[()], np.float64)

    def text(self, name: str) -> str:
        """An attribute that is text; empty if there is none.

        Raises:
            TraceError: if it is no text, or too long.
        """
        where = f"attribute {printable(name)} of {self.path}"
        with _damage(where):
            attributes = self._group.attrs
            if name not in attributes:
                return ""
            if attributes.get_id(name).shape != ():  # many texts may be the same one in the file
                raise TraceError(f"{where} is no text")
            value = attributes[name]
            text = value.decode() if isinstance(value, bytes) else value
            if not isinstance(text, str):
                raise TraceError(f"{where} is no text")
            text.encode()  # h5py keeps what is not UTF-8 as surrogates
        if len(text) > LONGEST_TEXT:
            raise TraceError(f"{where} is longer than {LONGEST_TEXT} characters")
        return text

    def _at(self, name: str) -> Any:
        import h5py

        with _damage(self._of(name)):
            link = self._group.get(name, getlink=True)
            if link is None:
                raise TraceError(f"{self._of(name)} is missing")
            if not isinstance(link, h5py.HardLink):
                raise TraceError(f"{self._of(name)} is a link to elsewhere, which is not followed")
            return self._group[name]

    def _of(self, name: str) -> str:
        return f"{self.path.rstrip('/')}/{printable(name)}"


@contextmanager
def open_file(source: Source, name: str) -> Iterator[Group]:
    """The root group of a file of a source.

    Raises:
        ConfigError: if h5py is not installed.
        TraceError: if it is no HDF5, or damaged.
    """
    try:
        import h5py
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"h5py is not installed; install it with: {install_command('import')}"
        ) from error
    with source.open(name) as stream:
        with _damage(printable(name)):
            file = h5py.File(stream, "r")
        with file:
            yield Group(file, "/")


@contextmanager
def _damage(what: str) -> Iterator[None]:
    """h5py raises all of these on malformed files."""
    try:
        yield
    except (OSError, RuntimeError, ValueError, KeyError, TypeError, OverflowError) as error:
        raise TraceError(f"{what}: not HDF5, or a damaged one ({printable(str(error))})") from error
