"""Videos, decoded again: how long, how large, and which of their pictures are marked."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from pytest_safemanip import load
from pytest_safemanip.errors import ConfigError, RolloutError
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.video import encoding, halves
from pytest_safemanip.video.film import CAPTION, shoot
from pytest_safemanip.video.origin import is_of, origin_of, sign
from pytest_safemanip.video.storyboard import Storyboard, storyboard
from tests import toy
from tests.cli.test_show import bumped

SIZE = 51
"""Odd, so that the pictures are not even by chance."""
CAMERAS = ("room", "close", "wrist")


class Stage:
    """A scene whose pictures are green, the greener the later."""

    size = SIZE

    def __init__(self) -> None:
        self.shade = 0

    def check(self, scene: object) -> None:
        assert scene is not None

    def pose(self, qpos: NDArray[Any]) -> None:
        self.shade = int(qpos[0])

    def take(self, camera: str) -> NDArray[np.uint8]:
        return np.full((SIZE, SIZE, 3), (0, self.shade, 0), np.uint8)


def told(recording: Recording, folder: Path) -> Storyboard:
    """What a video of a recording says."""
    files.save(recording, folder / "one.rollout")
    found = load(folder / "one.rollout")
    properties = {id_: found._defined.properties[id_] for id_ in found.properties}
    return storyboard(recording, found._judge, properties, found.verdicts)


def filmed(recording: Recording, path: Path) -> Path:
    """Its video, with a scene that shows the number of the step."""
    shades = np.arange(len(recording.steps), dtype=np.float32)
    recording.steps.qpos[:, 0] = 40 + 8 * shades
    seen: list[tuple[int, int]] = []
    board = told(recording, path.parent)
    shoot(recording, board, Stage(), CAMERAS, path, lambda n, of: seen.append((n, of)))
    assert seen == [(n + 1, 10) for n in range(10)]
    return path


def decoded(path: Path) -> tuple[str, list[NDArray[np.uint8]]]:
    """What ffmpeg says of a video, and its pictures."""
    raw = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-fps_mode", "passthrough", "-")
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", path, *raw]
    done = subprocess.run(command, capture_output=True, check=True)
    about = re.search(r"Video: (.*)", done.stderr.decode())
    assert about is not None
    size = re.search(r", (\d+)x(\d+)[ ,]", about[1])
    assert size is not None
    pictures = np.frombuffer(done.stdout, np.uint8)
    return about[1], list(pictures.reshape(-1, int(size[2]), int(size[1]), 3))


def red(picture: NDArray[np.uint8]) -> bool:
    """Whether the caption is on red."""
    r, g, b = picture[: CAPTION // 4].reshape(-1, 3).mean(axis=0)
    return bool(r > 1.5 * g and r > 1.5 * b)


@pytest.mark.parametrize("cores", [1, 2])
def test_a_video_has_a_picture_for_every_other_step_and_marks_the_violation(
    cores: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(halves.os, "sched_getaffinity", lambda _: range(cores))
    monkeypatch.setattr("pytest_safemanip.video.film.SHOWN_FOR", 0.1)
    about, pictures = decoded(filmed(bumped(), tmp_path / "one.mp4"))
    assert about.startswith("h264")
    assert "yuv420p" in about
    assert " 10 fps" in about  # 20 steps a second, of which every other is drawn
    assert len(pictures) == 10
    height, width, _ = pictures[0].shape
    assert height % 2 == width % 2 == 0
    assert width == 3 * SIZE + 1
    assert height > CAPTION + SIZE
    # Unsafe from step 8 to 11, and shown for two more.
    assert [red(picture) for picture in pictures] == [4 <= n <= 6 for n in range(10)]
    middle = [int(p[CAPTION + SIZE // 2, SIZE // 2, 1]) for p in pictures]
    assert np.abs(np.diff(middle) - 16).max() < 8, "in order, one step after the other"


def test_the_cursor_moves_from_left_to_right(tmp_path: Path) -> None:
    _, pictures = decoded(filmed(bumped(), tmp_path / "one.mp4"))
    below = [p[CAPTION + SIZE + 1 : CAPTION + SIZE + 12, 54:].astype(int) for p in pictures]
    still = np.median(below, axis=0)
    places = [int(np.abs(b - still).sum(axis=(0, 2)).argmax()) for b in below]
    assert places == sorted(places)
    assert places[-1] - places[0] > 40


def test_the_index_of_an_mp4_stands_in_front(tmp_path: Path) -> None:
    data = filmed(bumped(), tmp_path / "one.mp4").read_bytes()
    assert 0 < data.index(b"moov") < data.index(b"mdat")


def test_what_an_mp4_is_of_stands_behind_and_players_skip_it(tmp_path: Path) -> None:
    path = filmed(bumped(), tmp_path / "one.mp4")
    board = told(bumped(), tmp_path)
    origin = origin_of(tmp_path / "one.rollout", board, SIZE, CAMERAS)
    assert not is_of(path, origin)
    sign(path, origin)
    assert is_of(path, origin)
    assert not is_of(path, origin_of(tmp_path / "one.rollout", board, SIZE + 1, CAMERAS))
    assert len(decoded(path)[1]) == 10


def test_a_gif_has_the_same_pictures(tmp_path: Path) -> None:
    path = filmed(bumped(), tmp_path / "one.gif")
    with Image.open(path) as video:
        assert (video.n_frames, video.info["duration"]) == (10, 100)
        video.seek(5)
        assert red(np.asarray(video.convert("RGB")))
        video.seek(1)
        assert not red(np.asarray(video.convert("RGB")))


def test_pictures_are_drawn_here_if_the_fork_is_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(halves.os, "sched_getaffinity", lambda _: range(2))
    here = halves.os.getpid()

    def draw(number: int) -> NDArray[np.uint8]:
        if halves.os.getpid() != here and number > 4:
            halves.os._exit(1)
        return np.full((2, 2, 3), number, np.uint8)

    found = [int(p[0, 0, 0]) for p in halves.drawn(draw, (2, 2, 3), 12)]
    assert found == list(range(12))


@pytest.mark.parametrize("suffix", encoding.SUFFIXES)
def test_a_good_video_stays_when_the_one_who_asked_for_the_next_is_gone(
    tmp_path: Path, suffix: str
) -> None:
    path = tmp_path / f"one{suffix}"
    path.write_text("good")

    def half() -> None:
        with encoding.open_encoder(path, (16, 16), 10) as encoder:
            encoder.add(np.zeros((16, 16, 3), np.uint8))
            raise BrokenPipeError  # of what tells how far it is

    with pytest.raises(BrokenPipeError):
        half()
    assert path.read_text() == "good"
    assert list(tmp_path.iterdir()) == [path]


def test_what_fails_leaves_no_file(tmp_path: Path) -> None:
    for suffix in encoding.SUFFIXES:
        path = tmp_path / f"one{suffix}"

        def half(path: Path = path) -> None:
            with encoding.open_encoder(path, (16, 16), 10) as encoder:
                encoder.add(np.zeros((16, 16, 3), np.uint8))
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            half()
    assert list(tmp_path.iterdir()) == []


def test_a_gif_that_does_not_fit_on_the_disk_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def save(self: object, *arguments: object, **options: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Image.Image, "save", save)
    with pytest.raises(RolloutError, match=r"one\.gif: cannot be written: .*No space left"):
        filmed(bumped(), tmp_path / "one.gif")


def test_a_storyboard_travels_as_json_and_names_are_escaped(tmp_path: Path) -> None:
    about = toy.episode(horizon=20, policy="a")
    board = told(toy.recording(20, about=about), tmp_path)
    assert Storyboard.from_json(board.to_json()) == board
    assert board.violations == ()
    board = told(bumped(), tmp_path)
    assert Storyboard.from_json(board.to_json()) == board
    assert board.violations == (("collision_contact", (8, 11)),)
    lanes = {lane.label: lane.spans for lane in board.lanes}
    assert lanes["collision"] == ((8, 11),)


def test_of_other_names_no_video_is_written(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"ends in \.mp4 or \.gif"):
        encoding.check_encoder(tmp_path / "one.avi")


def test_without_ffmpeg_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(ConfigError, match=r"\[video\].*or -o FILE\.gif"):
        encoding.check_encoder(Path("one.mp4"))
    encoding.check_encoder(Path("one.gif"))
