"""Reads LeRobot's datasets of versions 2.0, 2.1 and 3.0, written by anybody."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TraceError, printable
from pytest_safemanip.importers.source import Source
from pytest_safemanip.lerobot.layout import INFO
from pytest_safemanip.lerobot.parquet import pyarrow
from pytest_safemanip.trace.typed import shown

VERSIONS = ("v2.0", "v2.1", "v3.0")
MOST_JSON, MOST_TABLE, MOST_UNPACKED = 64 * 2**20, 512 * 2**20, 2 * 2**30
MOST_ROWS, MOST_FPS = 10_000_000, 10_000
EPISODES = "meta/episodes"
_FIELD = re.compile(r"\{(\w+)(?::0(\d)d)?\}")
_FEATURE = re.compile(r"\w[\w.-]{0,99}")
_PLACES, _START = ("chunk_index", "file_index"), "from_timestamp"


@dataclass(frozen=True)
class EpisodeEntry:
    """Where an episode of a dataset is.

    Attributes:
        index: its number.
        texts: what the robot was told.
        file: path of the file with its rows, within the dataset.
        length: number of rows.
        videos: by feature of images, the file of moving pictures and where in it the episode
            begins, s.
    """

    index: int
    texts: tuple[str, ...]
    file: str
    length: int
    videos: Mapping[str, tuple[str, float]]


class Dataset:
    """A dataset.

    Args:
        source: where it is.
        folder: its folder in the source, empty or ending in ``/``.

    Raises:
        TraceError: if it is none, or of another version.
    """

    def __init__(self, source: Source, folder: str) -> None:
        self._source, self.folder = source, folder
        self._known: tuple[str, Any] = "", None
        info = self.json(INFO)
        if not isinstance(info, dict):
            raise TraceError(f"{INFO}: must be a mapping")
        version, fps, pattern = (info.get(key) for key in ("codebase_version", "fps", "data_path"))
        if version not in VERSIONS:
            raise TraceError(
                f"{INFO}: codebase_version {shown(version)}, known are {', '.join(VERSIONS)}"
            )
        if not isinstance(fps, int | float) or not 0 < fps <= MOST_FPS:
            raise TraceError(f"{INFO}: fps must be a number above 0, found {shown(fps)}")
        if not isinstance(pattern, str):
            raise TraceError(f"{INFO}: data_path must be a text, found {shown(pattern)}")
        self.version, self.fps, self._pattern = str(version), float(fps), pattern
        self._videos, self._filmed = info.get("video_path"), _filmed(info.get("features"))
        if self._filmed and not isinstance(self._videos, str):
            raise TraceError(f"{INFO}: video_path must be a text, found {shown(self._videos)}")

    def has(self, name: str) -> bool:
        """Whether it has a file."""
        return self._source.has(self.folder + name)

    def read(self, name: str, most: int) -> bytes:
        """The content of a file.

        Raises:
            TraceError: if it is not there, leads out of the source or is larger.
        """
        return self._source.read(self.folder + name, most)

    def json(self, name: str) -> Any:
        """The content of a JSON file.

        Raises:
            TraceError: if it cannot be read.
        """
        return _parsed(self.read(name, MOST_JSON), name)

    @cached_property
    def episodes(self) -> tuple[EpisodeEntry, ...]:
        """Its episodes.

        Raises:
            TraceError: if they are not listed as its version does.
        """
        return tuple(self._tables() if self.version == "v3.0" else self._lists())

    def rows(self, episode: EpisodeEntry, columns: Sequence[str]) -> dict[str, NDArray[Any]]:
        """Columns of an episode, those that there are: arrays (N,) or (N, K).

        Raises:
            TraceError: if they are not arrays of numbers, or not as many as the dataset says.
        """
        table = self._table(episode.file)
        place = np.flatnonzero(_array(table, "episode_index", episode.file) == episode.index)
        if len(place) != episode.length:
            raise TraceError(
                f"{episode.file}: {len(place)} rows of episode {episode.index}, the dataset says "
                f"{episode.length}"
            )
        wanted = [name for name in columns if name in table.column_names]
        return {name: _array(table, name, episode.file)[place] for name in wanted}

    def _lists(self) -> Iterator[EpisodeEntry]:
        name = f"{EPISODES}.jsonl"
        for line in self.read(name, MOST_JSON).splitlines():
            entry = _parsed(line, name) if line.strip() else None
            if entry is None:
                continue
            if not isinstance(entry, dict):
                raise TraceError(f"{name}: {shown(entry)} is no episode")
            yield self._entry(entry, name)

    def _tables(self) -> Iterator[EpisodeEntry]:
        start = f"{self.folder}{EPISODES}/"
        for path in (name for name in self._source.names if name.startswith(start)):
            name = path.removeprefix(self.folder)
            if PurePosixPath(name).suffix != ".parquet":
                continue
            wanted = ("episode_index", "tasks", "length", *(f"data/{key}" for key in _PLACES))
            table = self._table(name)
            filmed = [f"videos/{f}/{k}" for f in self._filmed for k in (*_PLACES, _START)]
            needed = (*wanted, *filmed)
            if missing := [column for column in needed if column not in table.column_names]:
                raise TraceError(f"{name}: no column {printable(missing[0])}")
            for entry in table.select(needed).to_pylist():
                yield self._entry(entry, name)

    def _entry(self, entry: Mapping[str, Any], name: str) -> EpisodeEntry:
        index, length = (_count(entry.get(key), name) for key in ("episode_index", "length"))
        texts = entry.get("tasks")
        if not isinstance(texts, list) or not all(isinstance(text, str) for text in texts):
            raise TraceError(f"{name}: tasks must be texts, found {shown(texts)}")
        known = {"episode_index": index, "episode_chunk": index // 1000}

        def places(of: str) -> dict[str, int]:
            """The numbers in the names of an episode's files."""
            found = _PLACES if self.version == "v3.0" else ()
            return known | {key: _count(entry.get(f"{of}/{key}"), name) for key in found}

        videos = {
            feature: (
                _filled(str(self._videos), {**places(f"videos/{feature}"), "video_key": feature}),
                _seconds(entry.get(f"videos/{feature}/{_START}", 0.0), name),
            )
            for feature in self._filmed
        }
        file = _filled(self._pattern, places("data"))
        return EpisodeEntry(index, tuple(texts), file, length, videos)

    def _table(self, name: str) -> Any:
        if self._known[0] != name:  # of version 3.0, many episodes are in one file
            self._known = name, read_table(self.read(name, MOST_TABLE), name)
        return self._known[1]


def read_table(content: bytes, name: str) -> Any:
    """A parquet file as a table of pyarrow's (which reads no pickles, from version 14.0.1 on).

    Raises:
        TraceError: if it is none, or too large when unpacked.
    """
    lib = pyarrow(".lib")
    try:
        file = pyarrow(".parquet").ParquetFile(io.BytesIO(content))
        about = file.metadata
        groups = [about.row_group(i).total_byte_size for i in range(about.num_row_groups)]
        if about.num_rows > MOST_ROWS or sum(groups) > MOST_UNPACKED:
            raise TraceError(f"{name}: {about.num_rows} rows of {sum(groups)} bytes are too many")
        return file.read()
    except (lib.ArrowException, OSError, ValueError, KeyError) as error:
        raise TraceError(f"{name}: not a parquet file, or a damaged one ({error})") from error


def find_datasets(source: Source) -> list[str]:
    """The folders of a source that are datasets, each empty or ending in ``/``."""
    return [
        name.removesuffix(INFO)
        for name in source.names
        if name == INFO or name.endswith(f"/{INFO}")
    ]


def _filmed(features: Any) -> tuple[str, ...]:
    """The features that are files of moving pictures; what has no plain name is none."""
    known = features.items() if isinstance(features, dict) else ()
    return tuple(
        name
        for name, about in known
        if isinstance(about, dict) and about.get("dtype") == "video" and _FEATURE.fullmatch(name)
    )


def _filled(pattern: str, values: Mapping[str, int | str]) -> str:
    """A path with its numbers; a format string of a stranger is not formatted."""

    def value(match: re.Match[str]) -> str:
        if match[1] not in values:
            raise TraceError(f"{INFO}: a path names {printable(match[1])!r}, which is not known")
        return str(values[match[1]]).zfill(int(match[2] or 0))

    return _FIELD.sub(value, pattern)


def _array(table: Any, column: str, name: str) -> NDArray[Any]:
    """A column of numbers (N,), or of lists of as many each (N, K)."""
    if column not in table.column_names:
        raise TraceError(f"{name}: no column {column}")
    types, values = pyarrow(".types"), table.column(column).combine_chunks()
    if types.is_fixed_size_list(values.type) or types.is_list(values.type):
        flat = values.flatten()
        if values.null_count or not len(values) or len(flat) % len(values):
            raise TraceError(f"{name}: {column} must be lists of the same length")
        lengths = set(pyarrow(".compute").list_value_length(values).to_pylist())
        if len(lengths) != 1:
            raise TraceError(f"{name}: {column} must be lists of the same length")
        return _numbers(flat, column, name).reshape(len(values), -1)
    return _numbers(values, column, name)


def _numbers(values: Any, column: str, name: str) -> NDArray[Any]:
    types, kind = pyarrow(".types"), values.type
    known = types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind)
    if not known or values.null_count:
        raise TraceError(f"{name}: {column} must be numbers, found {printable(str(kind))}")
    array = np.asarray(values.to_numpy(zero_copy_only=False))
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise TraceError(f"{name}: {column} is not finite")
    return array


def _count(value: object, name: str) -> int:
    if type(value) is not int or not 0 <= value <= MOST_ROWS:
        raise TraceError(f"{name}: an episode has an impossible number: {shown(value)}")
    return value


def _seconds(value: object, name: str) -> float:
    if not isinstance(value, float) or not 0.0 <= value <= MOST_ROWS:
        raise TraceError(f"{name}: an episode begins at {shown(value)} s of its moving pictures")
    return value


def _parsed(text: bytes, name: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise TraceError(f"{name}: not JSON ({error})") from error
