"""What a video is of, written into the video: one of the same is not drawn again."""

from __future__ import annotations

import contextlib
import hashlib
import json
import struct
from collections.abc import Sequence
from pathlib import Path

from pytest_safemanip.provenance import source_digest
from pytest_safemanip.video.storyboard import Storyboard

_NAME = b"pytest-safemanip"
_LENGTH = 8 + len(_NAME) + hashlib.sha256().digest_size
_HEAD = struct.pack(">I4s", _LENGTH, b"free") + _NAME
"""A box of MP4 that players skip (ISO/IEC 14496-12, 8.1.2): its length, its kind, and ours."""


def origin_of(source: Path, board: Storyboard, size: int, cameras: Sequence[str]) -> bytes:
    """Digest of all that decides a video (32,).

    Args:
        source: the recording.
        board: what is shown beside the scene.
        size: of a camera's picture, pixels.
        cameras: names of those that stand side by side.
    """
    about = [board.to_json(), size, list(cameras), source_digest("video", "sim/robocasa")]
    recording = hashlib.sha256(source.read_bytes()).digest()
    return hashlib.sha256(recording + json.dumps(about, sort_keys=True).encode()).digest()


def sign(video: Path, origin: bytes) -> None:
    """Append to an MP4 file what it is of."""
    with video.open("ab") as file:
        file.write(_HEAD + origin)


def is_of(video: Path, origin: bytes) -> bool:
    """Whether a file is there, whole, and of this."""
    with contextlib.suppress(OSError), video.open("rb") as file:
        if video.stat().st_size >= _LENGTH:
            file.seek(-_LENGTH, 2)
            return file.read() == _HEAD + origin
    return False
