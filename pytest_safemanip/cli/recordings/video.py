"""``safemanip video``: a recording as a moving picture."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from pytest_safemanip.cli.drawing import add_drawing, parse_cameras
from pytest_safemanip.cli.evaluation import Evaluation, add_judging, evaluate
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.video.encoding import SUFFIXES, check_encoder
from pytest_safemanip.video.film import compose, request_of, stride_of
from pytest_safemanip.video.footage import Footage, cameras_of
from pytest_safemanip.video.process import Drawer
from pytest_safemanip.video.progress import Bar
from pytest_safemanip.video.storyboard import Storyboard, storyboard

EXAMPLE = "safemanip video .safemanip/recordings/OpenDrawer-scripted-seed0.rollout -o drawer.mp4"
CAMERAS = "room,close,wrist"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_judging(parser)
    add_drawing(parser, CAMERAS, "a .mp4 or .gif file, or a folder")


def run(options: argparse.Namespace) -> int:
    """Draw the video, and print its path."""
    path = _target(options.out, options.recording)
    filmed = cameras_of(options.recording)
    chosen = _chosen(filmed, options.cameras) if filmed else {}
    cameras = [] if filmed else parse_cameras(options.cameras)
    check_encoder(path)
    began = time.monotonic()
    with Bar() as bar:
        if filmed:
            found, board = _filmed(options, chosen, path, bar)
        else:
            found, board = _drawn(options, cameras, path, bar)
    print(path)
    if not sys.stderr.isatty():
        pictures = len(range(0, board.length, stride_of(board.period)))
        seconds = time.monotonic() - began
        print(f"safemanip video: {pictures} pictures in {seconds:.1f} s", file=sys.stderr)
    for id_, error in found.errors.items():
        print(f"safemanip video: {id_} is not marked, it has no verdict: {error}", file=sys.stderr)
    return 0


def _drawn(
    options: argparse.Namespace, cameras: list[str], path: Path, bar: Bar
) -> tuple[Evaluation, Storyboard]:
    """Draw the recorded states; gives what was shown beside them, too."""
    with (
        tempfile.TemporaryDirectory() as folder,
        Drawer(options.size, cameras, Path(folder, "video.log")) as drawer,
    ):
        drawer.launch()  # it imports while the recording is judged
        found = evaluate(options)
        recording = found.recording
        request_of(recording, options.recording)  # refuses what cannot be drawn
        board = storyboard(recording, found.judge, found.properties, found.verdicts)
        bar.say(f"setting up the scene of {path.name}")
        drawer.assets = options.assets or found.folder.settings.assets
        drawer.draw(options.recording, board, path, partial(bar.show, path.name))
    return found, board


def _filmed(
    options: argparse.Namespace, cameras: Mapping[str, Path], path: Path, bar: Bar
) -> tuple[Evaluation, Storyboard]:
    """Show what cameras saw; gives what was shown beside it, too."""
    found = evaluate(options)
    board = storyboard(found.recording, found.judge, found.properties, found.verdicts)
    bar.say(f"reading what {', '.join(cameras)} saw")
    footage = Footage(cameras, options.size, range(0, board.length, stride_of(board.period)))
    size = options.size, options.size * len(cameras)
    compose(board, footage.views, size, path, partial(bar.show, path.name))
    return found, board


def _chosen(filmed: Mapping[str, Path], wanted: str) -> dict[str, Path]:
    """The cameras of a recording that are shown: all, unless the user names some.

    Raises:
        ConfigError: if there is no such camera.
    """
    names = list(filmed) if wanted == CAMERAS else wanted.split(",")
    for name in names:
        if name not in filmed:
            raise ConfigError(f"--cameras: {name!r} is none of {', '.join(filmed)}")
    return {name: filmed[name] for name in names}


def _target(out: Path, recording: Path) -> Path:
    """The file that is written: named by the user, or after the recording in the user's folder."""
    if out.is_dir():
        return out / f"{recording.stem}.mp4"
    if out.suffix in SUFFIXES:
        return out
    if out.suffix:
        raise ConfigError(f"--out: expected a {' or '.join(SUFFIXES)} file or a folder: {out}")
    return out / f"{recording.stem}.mp4"
