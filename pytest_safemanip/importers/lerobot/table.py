"""Tables that strangers wrote: no farther unpacked than is asked for, and within limits."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TraceError, printable
from pytest_safemanip.lerobot.parquet import pyarrow

MOST_ROWS = 10_000_000
MOST_UNPACKED = 2**30
"""Bytes of the columns of a table that are unpacked at a time."""


class Table:
    """A parquet file of a stranger; pyarrow reads no pickles, from version 14.0.1 on.

    Args:
        content: of the file.
        name: for errors.

    Attributes:
        names: of its columns.

    Raises:
        TraceError: if it is none, or has too many rows.
    """

    def __init__(self, content: bytes, name: str) -> None:
        self._name = name
        with self._damage():
            self._file = pyarrow(".parquet").ParquetFile(io.BytesIO(content))
            self._about = self._file.metadata
            self.names = tuple(self._file.schema_arrow.names)
        groups = [self._about.row_group(i) for i in range(self._about.num_row_groups)]
        self._ends = np.cumsum([group.num_rows for group in groups], dtype=np.int64)
        if self._about.num_rows > MOST_ROWS:
            raise TraceError(f"{name}: {self._about.num_rows} rows, more than {MOST_ROWS}")

    @cached_property
    def index(self) -> NDArray[Any]:
        """The episode of each row (N,).

        Raises:
            TraceError: if the file does not say it.
        """
        return numbers_of(self.read(("episode_index",))[0], "episode_index", self._name)

    def read(
        self, columns: Sequence[str], first: int = 0, last: int = MOST_ROWS
    ) -> tuple[Any, int]:
        """Columns as a table of pyarrow's, and which row its first one is: nothing else of the file
        is unpacked.

        Args:
            columns: names.
            first: of the rows that are wanted.
            last: likewise.

        Raises:
            TraceError: if one is missing, there twice, too large when unpacked, or damaged.
        """
        for column in columns:
            if self.names.count(column) != 1:
                often = "no" if column not in self.names else "more than one"
                raise TraceError(f"{self._name}: {often} column {column}")
        begins = self._ends - np.diff(self._ends, prepend=0)
        groups = np.flatnonzero((self._ends > first) & (begins <= last)).tolist()
        chunks = [chunk for group in groups for chunk in self._chunks(group, columns)]
        values = sum(chunk.num_values for chunk in chunks)
        if 8 * values > MOST_UNPACKED:
            raise TraceError(f"{self._name}: {values} values, more than {MOST_UNPACKED // 8}")
        # A text that stands once in the file may stand in every row.
        longest = max((chunk.total_uncompressed_size for chunk in chunks), default=1)
        rows = min(max(MOST_UNPACKED // max(longest, 1), 1), 65536)
        batches, size = [], 0
        with self._damage():
            # Threads of pyarrow's that still run when the process ends would abort it.
            for batch in self._file.iter_batches(rows, groups, list(columns), use_threads=False):
                size += batch.nbytes
                if size > MOST_UNPACKED:
                    raise TraceError(f"{self._name}: more than {MOST_UNPACKED} bytes when unpacked")
                batches.append(batch)
            schema = pyarrow().schema([self._file.schema_arrow.field(name) for name in columns])
            found = pyarrow().Table.from_batches(batches, None if batches else schema)
        return found, int(begins[groups[0]]) if groups else 0

    def _chunks(self, group: int, columns: Sequence[str]) -> list[Any]:
        """What metadata say of some columns in a row group."""
        about = self._about.row_group(group)
        found = [about.column(i) for i in range(about.num_columns)]
        starts = tuple(f"{column}." for column in columns)  # names have points themselves
        return [chunk for chunk in found if f"{chunk.path_in_schema}.".startswith(starts)]

    @contextmanager
    def _damage(self) -> Iterator[None]:
        try:
            yield
        except (pyarrow(".lib").ArrowException, OSError, ValueError, KeyError) as error:
            raise TraceError(
                f"{self._name}: not a parquet file, or a damaged one ({printable(str(error))})"
            ) from error


def numbers_of(table: Any, column: str, name: str) -> NDArray[Any]:
    """A column of numbers (N,), or of lists of as many each (N, K).

    Args:
        table: of pyarrow's.
        column: its name.
        name: of the file, for errors.

    Raises:
        TraceError: if it is of another type, has no value in a row, or one that is not finite.
    """
    types, values = pyarrow(".types"), table.column(column).combine_chunks()
    if types.is_fixed_size_list(values.type) or types.is_list(values.type):
        flat = values.flatten()
        if values.null_count or not len(flat) or len(flat) % len(values):
            raise TraceError(f"{name}: {column} must be lists of the same length")
        if types.is_list(values.type) and len(set(np.diff(values.offsets))) != 1:
            raise TraceError(f"{name}: {column} must be lists of the same length")
        return _numbers(flat, column, name).reshape(len(values), -1)
    return _numbers(values, column, name)


def _numbers(values: Any, column: str, name: str) -> NDArray[Any]:
    types, kind = pyarrow(".types"), values.type
    known = types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind)
    if not known:
        raise TraceError(f"{name}: {column} must be numbers, found {printable(str(kind))}")
    if values.null_count:
        raise TraceError(f"{name}: {column} lacks values in some rows")
    # Not to_numpy, which imports pandas.
    array = np.from_dlpack(values.cast("uint8") if types.is_boolean(kind) else values)
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise TraceError(f"{name}: {column} is not finite")
    return array
