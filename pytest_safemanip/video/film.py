"""From a recording and its storyboard to a file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.codec import decode_request
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.video.encoding import open_encoder
from pytest_safemanip.video.halves import drawn
from pytest_safemanip.video.imaging import Image, pillow
from pytest_safemanip.video.lanes import LanePicture
from pytest_safemanip.video.storyboard import Storyboard

DRAWN = ("robocasa",)
"""Backends whose recordings can be drawn."""
FRAMES_PER_SECOND = 10
CAPTION = 40
"""Height of the two lines above the scene, pixels."""
SHOWN_FOR = 1.0
"""A violation may last a single step; its caption stays on for so long, s."""
WARNING, PLAIN = "#c22b1e", "#222222"
FRAME = 4
"""Width of the frame around the scene while a violation is shown, pixels."""

Progress = Callable[[int, int], None]
"""Is told how many pictures are drawn, and of how many."""


def request_of(recording: Recording, path: Path) -> Request:
    """The episode of a recording, for the simulator.

    Raises:
        ConfigError: if it cannot be drawn.
    """
    episode = recording.episode
    if episode.backend not in DRAWN:
        raise ConfigError(
            f"{path}: recorded with the backend {episode.backend!r}; only recordings of "
            f"{', '.join(DRAWN)} can be drawn"
        )
    if not episode.request:
        raise ConfigError(f"{path}: the recording does not say what the simulator was asked for")
    return decode_request(episode.request)


def stride_of(period: float) -> int:
    """How many steps there are from a picture to the next, for a control period in seconds."""
    return max(1, round(1 / (FRAMES_PER_SECOND * period)))


def shoot(
    recording: Recording,
    board: Storyboard,
    shot: Any,
    cameras: Sequence[str],
    path: Path,
    progress: Progress,
) -> Path:
    """Draw a recording.

    Args:
        recording: what happened.
        board: what is shown beside the scene.
        shot: the scene of its episode.
        cameras: names of those whose pictures stand side by side.
        path: the file that is written, ``.mp4`` or ``.gif``; its folder is made.
        progress: is told of every picture.

    Returns:
        The path.

    Raises:
        ConfigError: if the scene is another one, or a library is missing.
    """
    shot.check(recording.scene)

    def views(step: int) -> list[Image]:
        shot.pose(recording.steps.qpos[step])
        return [shot.take(camera) for camera in cameras]

    return compose(board, views, (shot.size, shot.size * len(cameras)), path, progress)


def compose(
    board: Storyboard,
    views: Callable[[int], Sequence[Image]],
    size: tuple[int, int],
    path: Path,
    progress: Progress,
) -> Path:
    """Put pictures of the scene and a storyboard together.

    Args:
        board: what is shown beside the scene.
        views: the pictures of a step, which stand side by side.
        size: height and width of them all, pixels.
        path: as for :func:`shoot`.
        progress: likewise.

    Returns:
        The path.

    Raises:
        ConfigError: if a library is missing.
    """
    stride = stride_of(board.period)
    steps = range(0, board.length, stride)
    path.parent.mkdir(parents=True, exist_ok=True)
    sheet = _Sheet(board, stride, *size)

    def draw(number: int) -> Image:
        return sheet.compose(views(steps[number]), steps[number])

    height, width, _ = sheet.shape
    with open_encoder(path, (width, height), 1 / (stride * board.period)) as encoder:
        for number, picture in enumerate(drawn(draw, sheet.shape, len(steps))):
            encoder.add(picture)
            progress(number + 1, len(steps))
    return path


class _Sheet:
    """Puts pictures together: captions, the scene (height, width), lanes.

    Attributes:
        shape: of a picture: even height, even width, 3.
    """

    def __init__(self, board: Storyboard, stride: int, height: int, width: int) -> None:
        self._board, self._stride = board, stride
        self._held = round(SHOWN_FOR / board.period)
        self._drawn = pillow()
        self._font = self._drawn.ImageFont.load_default(13)
        self._lanes = LanePicture(board, width)
        self._scene = slice(CAPTION, CAPTION + height), slice(0, width)
        total = CAPTION + height + self._lanes.height
        self.shape = total + total % 2, width + width % 2, 3

    def compose(self, views: Sequence[Image], step: int) -> Image:
        """The picture of a step, with the scene from these sides."""
        picture = np.full(self.shape, 255, np.uint8)
        scene = picture[self._scene]
        scene[:] = np.concatenate(views, axis=1)
        unsafe = self._board.unsafe(step - self._held, step + self._stride - 1)
        if unsafe:
            red = self._drawn.ImageColor.getrgb(WARNING)
            for edge in (scene[:FRAME], scene[-FRAME:], scene[:, :FRAME], scene[:, -FRAME:]):
                edge[:] = red
        rows, columns = self._scene
        picture[: rows.start, columns] = self._caption(step, unsafe, columns.stop)
        picture[rows.stop :, columns][: self._lanes.height] = self._lanes.at(step)
        return picture

    def _caption(self, step: int, unsafe: Sequence[str], width: int) -> Image:
        board = self._board
        when = f"step {step}, {step * board.period:.2f} s"
        when += ", settling" if step >= board.acting else ""
        strip = self._drawn.Image.new("RGB", (width, CAPTION), WARNING if unsafe else "white")
        pen, ink = self._drawn.ImageDraw.Draw(strip), "white" if unsafe else PLAIN
        pen.text((6, 3), board.title, fill=ink, font=self._font)
        said = f"VIOLATED {', '.join(unsafe)}  " if unsafe else ""
        pen.text((6, 20), said + when, fill=ink, font=self._font)
        return np.asarray(strip)
