"""Pictures of tasks, and of a recording as it went on: what a policy meets, seen by a person.

    python -m pytest_safemanip.pictures [TASK ...] [--seeds N] [--cameras NAMES] [--out DIR]
    python -m pytest_safemanip.pictures --video RECORDING

A sheet has a row for each task and seed and a column for each camera. Needs the extras ``robocasa``
and ``servers`` (for Pillow), and one of the GL libraries that observations need.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip import resources
from pytest_safemanip.arguments import parse_seeds
from pytest_safemanip.cases import select_tasks
from pytest_safemanip.errors import ConfigError, SafemanipError
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.codec import decode_request
from pytest_safemanip.spec.task import Task
from pytest_safemanip.spec.tasks import load_tasks
from pytest_safemanip.trace import files
from pytest_safemanip.trace.episode import Episode

ROWS = 6
"""Of a sheet; the next row begins a new one."""
CAPTION = 34
"""Height of the lines of text above a row, pixels."""
FRAMES_PER_SECOND = 10
CAMERAS = ("room", "close", "left", "right", "wrist", "solid")
"""The room over the robot's shoulder, the task's things from near by without the robot, the three
that policies see, and the near things again as what collides."""

Image = NDArray[np.uint8]


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw what was asked for.

    Returns:
        0, or 2 if it cannot be drawn.
    """
    chosen = _parser().parse_args(arguments)
    try:
        pillow = _pillow()
        for path in _video(chosen, pillow) if chosen.video else _sheets(chosen, pillow):
            print(path)  # noqa: T201
    except SafemanipError as error:
        print(f"error: {error}", file=sys.stderr)  # noqa: T201
        return 2
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m pytest_safemanip.pictures",
        description="Contact sheets of tasks as they begin, or an animated picture of a recording.",
    )
    parser.add_argument("tasks", nargs="*", metavar="TASK", help="as --safemanip-tasks; all")
    parser.add_argument("--seeds", default="1", help="as --safemanip-seeds; 1")
    parser.add_argument("--scenes", default="compact", choices=("compact", "target", "pretrain"))
    parser.add_argument("--assets", default="auto", choices=("auto", "official", "primitive"))
    parser.add_argument(
        "--cameras", default="room,close,left,wrist", help=f"of {', '.join(CAMERAS)}"
    )
    parser.add_argument("--size", type=int, default=256, help="of each picture, pixels; 256")
    parser.add_argument("--out", type=Path, default=Path("pictures"), help="a folder; pictures")
    parser.add_argument("--video", type=Path, metavar="RECORDING", help="a .rollout file")
    return parser


def _pillow() -> Any:
    try:
        for module in ("PIL.Image", "PIL.ImageDraw"):
            importlib.import_module(module)
        return importlib.import_module("PIL")
    except ImportError as error:
        raise ConfigError(
            f"pictures are written with Pillow: pip install 'pytest-safemanip[servers]' ({error})"
        ) from error


def _sheets(chosen: argparse.Namespace, pillow: Any) -> Iterator[Path]:
    tasks = select_tasks(load_tasks([resources.folder("tasks")]), chosen.tasks or ["all"])
    seeds = parse_seeds(chosen.seeds)
    cameras = _cameras(chosen.cameras)
    studio = _studio(chosen)
    rows, number = [], 1
    try:
        for task in tasks:
            for seed in seeds:
                with studio.visit(_request(task, seed, chosen.scenes)) as shot:
                    text = f"{task.name}, seed {seed}\n{shot.instruction}"
                    pictures = [shot.take(camera) for camera in cameras]
                rows.append(_captioned(pillow, np.concatenate(pictures, axis=1), text))
                if len(rows) == ROWS:
                    yield _write(pillow, rows, chosen.out / f"sheet-{number:02d}.png")
                    rows, number = [], number + 1
        if rows:
            yield _write(pillow, rows, chosen.out / f"sheet-{number:02d}.png")
    finally:
        studio.close()


def _video(chosen: argparse.Namespace, pillow: Any) -> Iterator[Path]:
    recording = files.load(chosen.video)
    episode, steps = recording.episode, recording.steps
    request = _request_of(episode, chosen.video)
    cameras = _cameras(chosen.cameras)
    studio = _studio(chosen)
    period = recording.scene.control_period
    stride = max(1, round(1 / (FRAMES_PER_SECOND * period)))
    frames = []
    try:
        with studio.visit(request) as shot:
            shot.check(recording.scene)
            for step in range(0, len(steps), stride):
                shot.pose(steps.qpos[step])
                pictures = [shot.take(camera) for camera in cameras]
                text = f"{episode.task}, {episode.policy}, seed {episode.seed}\n"
                text += f"step {step}, {step * period:.2f} s"
                text += ", settling" if steps.tail[step] else ""
                frames.append(_captioned(pillow, np.concatenate(pictures, axis=1), text))
    finally:
        studio.close()
    path: Path = chosen.out / f"{chosen.video.stem}.gif"
    path.parent.mkdir(parents=True, exist_ok=True)
    first, *rest = (pillow.Image.fromarray(frame) for frame in frames)
    first.save(
        path, save_all=True, append_images=rest, duration=round(1000 * stride * period), loop=0
    )
    yield path


def _cameras(text: str) -> list[str]:
    cameras = text.split(",")
    for camera in cameras:
        if camera not in CAMERAS:
            raise ConfigError(f"--cameras: {camera!r} is none of {', '.join(CAMERAS)}")
    return cameras


def _studio(chosen: argparse.Namespace) -> Any:
    # With a GL library named that is not there, MuJoCo cannot be imported; see graphics.py.
    wanted = os.environ.pop("MUJOCO_GL", "")
    from pytest_safemanip.sim.robocasa.studio import Studio

    return Studio(chosen.assets, chosen.size, wanted)


def _request_of(episode: Episode, path: Path) -> Request:
    """The episode of a recording."""
    if episode.request:
        return decode_request(episode.request)
    tasks = load_tasks([resources.folder("tasks")])
    if episode.task not in tasks:
        raise ConfigError(f"{path}: task {episode.task!r} is not among the shipped ones")
    return _request(tasks[episode.task], episode.seed, episode.scenes)


def _request(task: Task, seed: int, scenes: str) -> Request:
    if scenes == "compact":
        return Request(task.name, seed, scenes, task.object_groups, task.kitchen)
    return Request(task.name, seed, scenes)


def _captioned(pillow: Any, picture: Image, text: str) -> Image:
    """A picture (h, w, 3) below two lines of text."""
    strip = pillow.Image.new("RGB", (picture.shape[1], CAPTION), "white")
    pillow.ImageDraw.Draw(strip).multiline_text((4, 2), text, fill="black")
    return np.concatenate((np.asarray(strip), picture))


def _write(pillow: Any, rows: Sequence[Image], path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    pillow.Image.fromarray(np.concatenate(rows)).save(path)
    return path


if __name__ == "__main__":
    sys.exit(main())
