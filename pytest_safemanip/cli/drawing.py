"""What the pictures of tasks and of recordings have in common."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.run.scenes import changes_of, groups_of
from pytest_safemanip.sim.backend import BackendSpec, Request
from pytest_safemanip.spec.task import Task
from pytest_safemanip.video.imaging import CAMERAS, Image, pillow

CAPTION = 34
"""Height of the lines of text above a picture, pixels."""


def add_drawing(parser: argparse.ArgumentParser, cameras: str, where: str) -> None:
    """Declare the options of what is drawn and where it is written.

    Args:
        parser: of a subcommand.
        cameras: those that are drawn by default.
        where: what ``--out`` may be, in words.
    """
    parser.add_argument(
        "--cameras",
        default=cameras,
        metavar="NAME[,...]",
        help=f"of {', '.join(CAMERAS)}; default: %(default)s",
    )
    add_assets(parser)
    parser.add_argument(
        "--size", type=int, default=256, metavar="PIXELS", help="of a picture; %(default)s"
    )
    parser.add_argument(
        "-o",
        "--out",
        type=Path,
        default=Path("pictures"),
        metavar="PATH",
        help=f"{where}; default: %(default)s",
    )


def add_assets(parser: argparse.ArgumentParser) -> None:
    """Declare what scenes are made of."""
    parser.add_argument(
        "--assets",
        choices=("auto", "official", "primitive"),
        help="what scenes are made of: RoboCasa's own, stand-ins, or the former where they are "
        "(auto); default: as in the ini file",
    )


def parse_cameras(text: str) -> list[str]:
    """Names of cameras.

    Raises:
        ConfigError: if there is no such camera.
    """
    cameras = text.split(",")
    for camera in cameras:
        if camera not in CAMERAS:
            raise ConfigError(f"--cameras: {camera!r} is none of {', '.join(CAMERAS)}")
    return cameras


def task_request(task: Task, seed: int, scenes: str, spec: BackendSpec) -> Request:
    """The episode of a task; what its file says of kitchens is about the backend's first scenes."""
    compact = scenes == spec.scenes[0]
    groups, kitchen = groups_of(task, compact), task.kitchen if compact else ""
    return Request(task.simulated, seed, scenes, groups, kitchen, changes_of(task))


def draw(shot: Any, cameras: Sequence[str], text: str, colour: str = "white") -> Image:
    """The pictures of some cameras side by side (h, w, 3), below two lines of text.

    Args:
        shot: the scene.
        cameras: their names.
        text: the lines.
        colour: behind the text.
    """
    drawn = pillow()
    pictures = np.concatenate([shot.take(camera) for camera in cameras], axis=1)
    strip = drawn.Image.new("RGB", (pictures.shape[1], CAPTION), colour)
    drawn.ImageDraw.Draw(strip).multiline_text((4, 2), text, fill="black")
    return np.concatenate((np.asarray(strip), pictures))
