"""What cameras saw of an episode: MP4 files beside a recording that has no states to draw it from.

The files come from strangers: ffmpeg is told that they are MP4, in which it follows no references
to other files, and what protocols and how large pictures it may read.
"""

from __future__ import annotations

import io
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO

import numpy as np

from pytest_safemanip.errors import ConfigError, TraceError, printable
from pytest_safemanip.video.encoding import H264, ffmpeg
from pytest_safemanip.video.imaging import Image, check_size

SUFFIX = ".cameras"
"""Of the folder beside a recording."""
DEADLINE = 600.0
"""Seconds for a file."""
MOST_PICTURES = 20_000
"""Of a camera in one video; each is kept in memory."""
MOST_PIXELS = 2**25


def cameras_of(recording: Path) -> dict[str, Path]:
    """The files of a recording, by the camera's name; empty if it has none."""
    return {path.stem: path for path in sorted(recording.with_suffix(SUFFIX).glob("*.mp4"))}


def cut(stream: IO[bytes], target: Path, start: float, pictures: int, rate: float) -> None:
    """Write a part of a file of moving pictures; the target is there once it is whole.

    Args:
        stream: the file, MP4.
        target: the file that is written; its folder is made.
        start: where the part begins, s.
        pictures: how many there are.
        rate: pictures in a second.

    Raises:
        ConfigError: if ffmpeg is not there.
        TraceError: if it cannot read the file.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    scratch = target.with_name(f".{target.name}")
    begin = max(0.0, start - 0.5 / rate)  # a time is rounded: the next picture after it is meant
    wanted = ("-frames:v", str(pictures), "-fps_mode", "passthrough", *H264, "-f", "mp4")
    try:
        _ffmpeg(stream, ("-ss", f"{begin:.6f}"), (*wanted, "-y", str(scratch.resolve())))
        scratch.replace(target)
    finally:
        scratch.unlink(missing_ok=True)


class Footage:
    """Pictures of some cameras at every so many steps.

    Args:
        files: of the cameras, those that stand side by side.
        size: edge of a picture, pixels; what is not square gets black bands.
        steps: those that are shown, evenly spaced from 0.

    Raises:
        ConfigError: if ffmpeg is not there, or there would be too many pictures.
        TraceError: if a file is none, or has fewer pictures than the recording has steps.
    """

    def __init__(self, files: Mapping[str, Path], size: int, steps: range) -> None:
        check_size(size)
        if len(steps) > MOST_PICTURES:
            raise ConfigError(f"{len(steps)} pictures; at most {MOST_PICTURES} are shown")
        self._stride = steps.step
        self._pictures = [_pictures(path, size, steps) for path in files.values()]

    def views(self, step: int) -> Sequence[Image]:
        """The pictures of a step, from every camera (size, size, 3)."""
        return [pictures[step // self._stride] for pictures in self._pictures]


def _pictures(path: Path, size: int, steps: range) -> Image:
    filters = (
        f"select=not(mod(n\\,{steps.step}))",
        f"scale={size}:{size}:force_original_aspect_ratio=decrease",
        f"pad={size}:{size}:(ow-iw)/2:(oh-ih)/2",
    )
    wanted = ("-vf", ",".join(filters), "-fps_mode", "passthrough", "-frames:v", str(len(steps)))
    with path.open("rb") as stream:
        raw = _ffmpeg(stream, (), (*wanted, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"))
    found = np.frombuffer(raw, np.uint8).reshape(-1, size, size, 3)
    if len(found) < len(steps):
        raise TraceError(f"{path}: {len(found)} pictures where the recording has {len(steps)}")
    return found


def _ffmpeg(stream: IO[bytes], before: Sequence[str], after: Sequence[str]) -> bytes:
    """What ffmpeg writes to its output, given a file."""
    program = ffmpeg()
    with tempfile.TemporaryFile() as copy:
        try:
            file = stream.fileno()
        except io.UnsupportedOperation:
            shutil.copyfileobj(stream, copy)
            copy.flush()
            file = copy.fileno()
        only = ("-protocol_whitelist", "file,pipe", "-max_pixels", str(MOST_PIXELS), "-f", "mov")
        command = [program, "-v", "error", "-nostdin", *before, *only, "-i", f"/dev/fd/{file}"]
        command += ["-map", "0:v:0", *after]
        try:
            done = subprocess.run(
                command, capture_output=True, timeout=DEADLINE, pass_fds=(file,), check=False
            )
        except subprocess.TimeoutExpired:
            raise TraceError(f"no moving pictures (read for more than {DEADLINE:g} s)") from None
    if done.returncode:
        said = printable(done.stderr.decode(errors="replace"), 200)
        raise TraceError(f"no moving pictures that can be read ({said})")
    return done.stdout
