"""Writes datasets of LeRobot's, one episode after the other."""

from __future__ import annotations

import contextlib
import json
import shutil
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.lerobot import extras, layout, statistics
from pytest_safemanip.lerobot.conventions import (
    ACTION,
    DESCRIPTION,
    DONE,
    IMAGES,
    NAME,
    REWARD,
    STATE,
    modality,
    to_dataset,
)
from pytest_safemanip.lerobot.extras import Extras
from pytest_safemanip.lerobot.parquet import write_columns, write_indexed
from pytest_safemanip.lerobot.statistics import OfImages, Statistics
from pytest_safemanip.sim.robocasa.robot import ROBOT_MODEL

Array = NDArray[Any]


class Encoder(Protocol):
    """Writes a file of moving pictures; used in a ``with`` statement."""

    def __enter__(self) -> Encoder: ...

    def __exit__(self, *about: Any) -> None: ...

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Append a picture (H, W, 3)."""


@dataclass(frozen=True)
class Rows:
    """The rows of an episode, one for each action.

    Attributes:
        instruction: what the robot was told.
        state: before each action, in the order of datasets (N, 16).
        action: in the environment's order (N, 12).
        success: whether the task's own check held after it (N,).
        images: those of the observation before each action, by feature; empty if not drawn.
        extras: for RoboCasa's tools, and for reading it again.
    """

    instruction: str
    state: Array
    action: Array
    success: NDArray[np.bool_]
    images: Iterable[Mapping[str, NDArray[np.uint8]]]
    extras: Extras


class DatasetWriter:
    """A dataset of one task; used in a ``with`` statement. It is there once it is whole.

    Args:
        folder: of the dataset; may not be there yet.
        version: ``v2.1``, as RoboCasa365's are, or ``v3.0``.
        task: name of the task.
        fps: steps in a second.
        encoder: opens a video file; None if there are no images.

    Raises:
        ConfigError: if the folder is there already.
    """

    def __init__(
        self,
        folder: Path,
        version: str,
        task: str,
        fps: int,
        encoder: Callable[[Path], Encoder] | None = None,
    ) -> None:
        if folder.exists():
            raise ConfigError(f"{folder} is there already; remove it, or name another folder")
        # Whoever was killed left a folder behind, and containers give the same process ids again.
        self._target, self.folder = folder, folder.with_name(f".{folder.name}.{uuid4().hex[:12]}")
        self.lengths: list[int] = []
        self._layout, self._task, self._fps = layout.LAYOUTS[version], task, fps
        self._encoder, self._drawn = encoder, encoder is not None
        self._texts: dict[str, int] = {}
        self._columns: list[dict[str, Array]] = []
        self._statistics: list[dict[str, Statistics]] = []
        self._instructions: list[str] = []

    def __enter__(self) -> DatasetWriter:
        return self

    def __exit__(self, *about: object) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)

    def add(self, rows: Rows) -> None:
        """Write an episode.

        Raises:
            OSError: if it cannot be written.
        """
        index, count = len(self.lengths), len(rows.action)
        done = np.arange(count) == count - 1
        task = self._texts.setdefault(rows.instruction, len(self._texts))
        columns = {
            STATE: rows.state.astype(np.float64),
            ACTION: to_dataset(rows.action).astype(np.float64),
            REWARD: rows.success.astype(np.float32),
            DONE: done,
            DESCRIPTION: np.full(count, task),
            "timestamp": (np.arange(count) / self._fps).astype(np.float32),
            "frame_index": np.arange(count),
            "episode_index": np.full(count, index),
            "index": np.arange(count) + sum(self.lengths),
            "task_index": np.full(count, task),
        }
        found = {name: statistics.of_rows(values) for name, values in columns.items()}
        found |= self._write_images(index, rows.images)
        extras.write_episode(self.folder, index, rows.extras)
        self.lengths.append(count)
        self._columns.append(columns)
        self._statistics.append(found)
        self._instructions.append(rows.instruction)

    def close(self, env_args: Mapping[str, Any]) -> None:
        """Write what is known of the whole.

        Args:
            env_args: see :func:`~pytest_safemanip.lerobot.extras.write_dataset`.
        """
        name = len(self._texts)  # as RoboCasa has it: behind all instructions
        for index, columns in enumerate(self._columns):
            columns[NAME] = np.full(self.lengths[index], name)
            self._statistics[index][NAME] = statistics.of_rows(columns[NAME])
            write_columns(self.folder / self._layout.data_file(index), columns)
        texts = [*self._texts, self._task]
        about = layout.info(self._layout, self._fps, self._drawn, self.lengths, len(texts))
        self._json(layout.INFO, about)
        self._json(layout.MODALITY, modality())
        self._json("meta/embodiment.json", _embodiment(self._fps))
        whole = {
            feature: statistics.of_rows(np.concatenate([c[feature] for c in self._columns]))
            for feature in self._columns[0]
        }
        for feature in (f for f in self._statistics[0] if f not in whole):
            whole[feature] = statistics.pooled([found[feature] for found in self._statistics])
        self._json(layout.STATISTICS, {f: _plain(found) for f, found in whole.items()})
        if self._layout is layout.V21:
            self._write_lists(texts)
        else:
            self._write_tables(texts)
        extras.write_dataset(self.folder, env_args, sum(self.lengths))
        self.folder.rename(self._target)

    def _write_images(
        self, index: int, images: Iterable[Mapping[str, NDArray[np.uint8]]]
    ) -> dict[str, Statistics]:
        if self._encoder is None:
            return {}
        looked = {feature: OfImages() for feature in IMAGES.values()}
        with contextlib.ExitStack() as writing:
            files = {}
            for feature in looked:
                path = self.folder / self._layout.video_file(index, feature)
                path.parent.mkdir(parents=True, exist_ok=True)
                files[feature] = writing.enter_context(self._encoder(path))
            for pictures in images:
                for feature, picture in pictures.items():
                    files[feature].add(picture)
                    looked[feature].add(picture)
        return {feature: found.result() for feature, found in looked.items()}

    def _write_lists(self, texts: list[str]) -> None:
        """The lists of version 2.1."""
        episodes = list(enumerate(zip(self.lengths, self._instructions, strict=True)))
        self._lines("meta/tasks.jsonl", [{"task_index": i, "task": t} for i, t in enumerate(texts)])
        self._lines(
            "meta/episodes.jsonl",
            [{"episode_index": i, "tasks": [text], "length": n} for i, (n, text) in episodes],
        )
        self._lines(
            "meta/episodes_stats.jsonl",
            [
                {"episode_index": i, "stats": {f: _plain(s) for f, s in found.items()}}
                for i, found in enumerate(self._statistics)
            ],
        )

    def _write_tables(self, texts: list[str]) -> None:
        """The tables of version 3.0."""
        write_indexed(self.folder / "meta/tasks.parquet", texts, "task_index", range(len(texts)))
        ends = np.cumsum(self.lengths).tolist()
        places = [layout.chunk_and_file(index) for index in range(len(ends))]
        chunks, files = ([place[side] for place in places] for side in (0, 1))
        columns: dict[str, Any] = {
            "episode_index": list(range(len(ends))),
            "tasks": [[text] for text in self._instructions],
            "length": self.lengths,
            "data/chunk_index": chunks,
            "data/file_index": files,
            "dataset_from_index": [end - n for end, n in zip(ends, self.lengths, strict=True)],
            "dataset_to_index": ends,
            "meta/episodes/chunk_index": [0] * len(ends),
            "meta/episodes/file_index": [0] * len(ends),
        }
        for feature in IMAGES.values() if self._drawn else ():
            columns |= {
                f"videos/{feature}/chunk_index": chunks,
                f"videos/{feature}/file_index": files,
                f"videos/{feature}/from_timestamp": [0.0] * len(ends),
                f"videos/{feature}/to_timestamp": [n / self._fps for n in self.lengths],
            }
        for feature, kinds in self._statistics[0].items():
            for kind in kinds:
                values = [found[feature][kind].tolist() for found in self._statistics]
                columns[f"stats/{feature}/{kind}"] = values
        write_columns(self.folder / "meta/episodes/chunk-000/file-000.parquet", columns)

    def _json(self, name: str, content: Any) -> None:
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(content, indent=4))

    def _lines(self, name: str, items: list[Any]) -> None:
        text = "".join(json.dumps(item) + "\n" for item in items)
        (self.folder / name).write_text(text)


def _plain(found: Statistics) -> dict[str, Any]:
    return {name: values.tolist() for name, values in found.items()}


def _embodiment(fps: int) -> dict[str, Any]:
    return {
        "robot_name": ROBOT_MODEL,
        "robot_type": ROBOT_MODEL,
        "record_frequency": float(fps),
        "body_controller_frequency": float(fps),
        "hand_controller_frequency": float(fps),
        "embodiment_tag": "robocasa_panda_omron",
    }
