"""Files of moving pictures: MP4 for people, GIF for pages that show no other."""

from __future__ import annotations

import contextlib
import importlib
import os
import subprocess
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

from pytest_safemanip.errors import ConfigError, RolloutError, install_command, printable
from pytest_safemanip.video.imaging import Image, pillow

SUFFIXES = (".mp4", ".gif")
COLOURS = 128
"""Of a GIF's picture."""
H264 = (
    *("-an", "-c:v", "libx264", "-pix_fmt", "yuv420p"),
    *("-preset", "veryfast", "-crf", "23"),
    *("-movflags", "+faststart"),  # plays before it is loaded whole
    *("-map_metadata", "-1"),
)
"""How pictures are encoded: as every browser and player shows them."""


class Encoder(Protocol):
    """Writes one file, picture by picture; used in a ``with`` statement. The file is there once
    it is whole, and not at all if the statement is left by an exception.
    """

    def __enter__(self) -> Encoder: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...

    def add(self, picture: Image) -> None:
        """Append a picture (h, w, 3), RGB, of even height and width."""


def check_encoder(path: Path) -> None:
    """Check that a file of this suffix can be written.

    Raises:
        ConfigError: if its suffix is unknown, or a library is missing.
    """
    if path.suffix not in SUFFIXES:
        raise ConfigError(f"{path}: a video's name ends in {' or '.join(SUFFIXES)}")
    pillow()
    if path.suffix == ".mp4":
        ffmpeg()


def open_encoder(path: Path, size: tuple[int, int], rate: float, keyframes: int = 0) -> Encoder:
    """What writes a file; its folder exists.

    Args:
        path: the file, ``.mp4`` or ``.gif``.
        size: width and height of the pictures, pixels, even.
        rate: pictures per second.
        keyframes: in MP4 at most so many pictures are from one that stands for itself to the next;
            0 for as many as the encoder finds best.

    Raises:
        ConfigError: if a library is missing.
    """
    return Gif(path, rate) if path.suffix == ".gif" else Mp4(path, size, rate, keyframes)


class Mp4:
    """H.264 in MP4 with 4:2:0 chroma, as every browser and player shows it; see
    :class:`Encoder`.
    """

    def __init__(self, path: Path, size: tuple[int, int], rate: float, keyframes: int = 0) -> None:
        self._path, self._scratch, self._ended = path, _scratch(path), False
        shape = f"{size[0]}x{size[1]}"
        source = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", shape, "-r", f"{rate:g}", "-i", "-")
        self._command = [
            *(ffmpeg(), "-y", "-v", "error"),
            *source,
            *H264,
            *(("-g", str(keyframes)) if keyframes else ()),
            str(self._scratch.resolve()),
        ]

    def __enter__(self) -> Mp4:
        self._process = subprocess.Popen(
            self._command,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            process_group=0,  # Ctrl-C is for us, who end it
        )
        return self

    def add(self, picture: Image) -> None:
        """See :class:`Encoder`."""
        if self._process.stdin is None:
            return
        try:
            self._process.stdin.write(picture.data)
        except BrokenPipeError:
            self._ended = True
            raise

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        # The one who asked for the video may be gone, too: then nobody wants what there is of it.
        if kind is not None and not self._ended:
            self._process.kill()
        try:
            said = self._last_words()
            if self._ended or (kind is None and self._process.wait() != 0):
                why = printable(said.decode(errors="replace"))
                raise RolloutError(f"{self._path}: cannot be encoded: {why}")
            if kind is None:
                self._scratch.replace(self._path)
        finally:
            self._scratch.unlink(missing_ok=True)

    def _last_words(self) -> bytes:
        """What it says when its input ends; waits for its end."""
        _, said = self._process.communicate()  # it ignores that nobody reads any more
        return bytes(said)


class Gif:
    """An animated GIF; see :class:`Encoder`."""

    def __init__(self, path: Path, rate: float) -> None:
        self._path, self._scratch = path, _scratch(path)
        self._duration = round(1000 / rate)
        self._pictures: list[Any] = []
        self._drawn = pillow().Image

    def __enter__(self) -> Gif:
        return self

    def add(self, picture: Image) -> None:
        """See :class:`Encoder`."""
        octree = self._drawn.Quantize.FASTOCTREE
        self._pictures.append(self._drawn.fromarray(picture).quantize(COLOURS, method=octree))

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is not None:
            return
        first, *others = self._pictures
        shown = {"save_all": True, "append_images": others, "duration": self._duration, "loop": 0}
        with contextlib.ExitStack() as cleaning:
            cleaning.callback(self._scratch.unlink, missing_ok=True)
            first.save(self._scratch, **shown)
            self._scratch.replace(self._path)


def _scratch(path: Path) -> Path:
    """Beside the file; its suffix says what is written into it."""
    return path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")


def ffmpeg() -> str:
    """Path of the program that reads and writes MP4.

    Raises:
        ConfigError: if it is not there.
    """
    try:
        return str(importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe())
    except (ImportError, RuntimeError) as error:
        raise ConfigError(
            f"MP4 is written with imageio-ffmpeg: {install_command('video')}, or -o FILE.gif "
            f"({error})"
        ) from error
