"""Where LeRobot's two present layouts have their files, and what ``meta/info.json`` says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pytest_safemanip.lerobot.conventions import (
    ACTION,
    ACTION_PARTS,
    DESCRIPTION,
    DONE,
    IMAGES,
    NAME,
    REWARD,
    STATE,
    STATE_PARTS,
)
from pytest_safemanip.sim.robocasa import observation
from pytest_safemanip.sim.robocasa.robot import ROBOT_MODEL, SPEC

CHUNK = 1000
"""Most files of a folder."""
INFO, STATISTICS, MODALITY = "meta/info.json", "meta/stats.json", "meta/modality.json"


@dataclass(frozen=True)
class Layout:
    """A version of LeRobot's format; here every episode is a file of its own.

    Attributes:
        version: as ``info.json`` has it.
        data: path of a file of rows.
        video: path of a file of images.
        sizes: what ``info.json`` says of the sizes of files.
    """

    version: str
    data: str
    video: str
    sizes: Mapping[str, int]

    def data_file(self, index: int) -> str:
        """The rows of an episode."""
        return self.data.format(**_names(index))

    def video_file(self, index: int, feature: str) -> str:
        """The images of an episode."""
        return self.video.format(**_names(index), video_key=feature)


V21 = Layout(
    "v2.1",
    "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
    "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4",
    {},
)
V30 = Layout(
    "v3.0",
    "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
    "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4",
    {"data_files_size_in_mb": 100, "video_files_size_in_mb": 200},
)
LAYOUTS = {layout.version: layout for layout in (V21, V30)}


def chunk_and_file(index: int) -> tuple[int, int]:
    """Where an episode's files are numbered."""
    return divmod(index, CHUNK)


def features(fps: int, drawn: bool) -> dict[str, Any]:
    """The columns of a dataset, as ``info.json`` describes them.

    Args:
        fps: steps in a second.
        drawn: whether it has images.
    """
    size = observation.IMAGE_SIZE
    images = {
        "dtype": "video",
        "shape": [size, size, 3],
        "names": ["height", "width", "channel"],
        "info": {
            "video.height": size,
            "video.width": size,
            "video.channels": 3,
            "video.fps": fps,
            "video.codec": "h264",
            "video.pix_fmt": "yuv420p",
            "video.is_depth_map": False,
            "has_audio": False,
        },
    }
    entries = [entry.name for entry in SPEC.robot.actions.entries]
    actions = [name for part in ACTION_PARTS.values() for name in entries[part]]
    states = [f"{part}_{i}" for part, length in STATE_PARTS.items() for i in range(length)]
    return {
        **(dict.fromkeys(IMAGES.values(), images) if drawn else {}),
        STATE: {"dtype": "float64", "shape": [len(states)], "names": states},
        ACTION: {"dtype": "float64", "shape": [len(actions)], "names": actions},
        REWARD: _number("float32"),
        DONE: _number("bool"),
        DESCRIPTION: _number("int64"),
        NAME: _number("int64"),
        "timestamp": _number("float32"),
        **{
            name: _number("int64")
            for name in ("frame_index", "episode_index", "index", "task_index")
        },
    }


def info(layout: Layout, fps: int, drawn: bool, lengths: list[int], tasks: int) -> dict[str, Any]:
    """The content of ``meta/info.json``.

    Args:
        layout: of the files.
        fps: steps in a second.
        drawn: whether there are images.
        lengths: rows of each episode.
        tasks: number of texts that say what is to be done.
    """
    videos = len(IMAGES) * len(lengths) if drawn else 0
    counts = {"total_videos": videos, "total_chunks": -(-len(lengths) // CHUNK)}
    return {
        "codebase_version": layout.version,
        "robot_type": ROBOT_MODEL,
        "total_episodes": len(lengths),
        "total_frames": sum(lengths),
        "total_tasks": tasks,
        **(counts if layout is V21 else {}),
        "chunks_size": CHUNK,
        **layout.sizes,
        "fps": fps,
        "splits": {"train": f"0:{len(lengths)}"},
        "data_path": layout.data,
        "video_path": layout.video if drawn else None,
        "features": features(fps, drawn),
    }


def _number(kind: str) -> dict[str, Any]:
    return {"dtype": kind, "shape": [1], "names": None}


def _names(index: int) -> dict[str, int]:
    chunk, file = chunk_and_file(index)
    return {
        "episode_chunk": chunk,
        "episode_index": index,
        "chunk_index": chunk,
        "file_index": file,
    }
