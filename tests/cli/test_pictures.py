"""Contact sheets and animated pictures."""

from __future__ import annotations

import dataclasses
import itertools
import re
import struct
import sys
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
import pytest

from pytest_safemanip.cli.drawing import CAPTION
from pytest_safemanip.policies.simple import Hold
from pytest_safemanip.rollouts import loop as rollout
from pytest_safemanip.sim.backend import Backend, Options, Request
from pytest_safemanip.sim.robocasa.factory import create
from pytest_safemanip.trace import files
from tests.cli.conftest import Command
from tests.sim.rendering.test_observing import require
from tests.warm import Warm


def png_size(path: Path) -> tuple[int, int]:
    width, height = struct.unpack(">II", path.read_bytes()[16:24])
    return width, height


@pytest.fixture
def backend(tmp_path: Path, warm: Warm, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(sys, "executable", warm.python)
    made = create(Options("primitive", tmp_path / "logs"))
    yield made
    made.close()


def test_tasks_are_drawn_on_a_sheet_and_a_recording_moves(
    tmp_path: Path, backend: Backend, safemanip: Command
) -> None:
    require("osmesa")
    pillow = pytest.importorskip("PIL.Image")
    small = ("--size", 48, "--assets", "primitive", "--out", tmp_path)
    views = ("--cameras", "room,close,solid,left")
    found = safemanip("pictures", "OpenDrawer", "--seeds", 2, *views, *small)
    assert (found.status, found.out, found.err) == (0, f"{tmp_path / 'sheet-01.png'}\n", "")
    sheet = np.asarray(pillow.open(tmp_path / "sheet-01.png"))
    assert sheet.shape == (2 * (48 + CAPTION), 4 * 48, 3)
    drawn = np.split(sheet[CAPTION : CAPTION + 48], 4, axis=1)
    assert all(view.std() > 10 for view in drawn)
    assert all((a != b).any() for a, b in itertools.combinations(drawn, 2))

    # Not the kitchen that the task has by itself: the recording says which.
    request = Request("OpenDrawer", 0, "compact", kitchen="full")
    job = rollout.Job("OpenDrawer", "hold", request, rollout.Protocol("horizon", 0.01), {})
    recording = rollout.run(job, backend, Hold())
    path = tmp_path / "OpenDrawer-hold-seed0.rollout"
    files.save(recording, path)
    done = safemanip("video", path, "--cameras", "room,wrist", *small)
    assert (done.status, done.out) == (0, f"{path.with_suffix('.mp4')}\n")
    assert re.fullmatch(r"safemanip video: \d+ pictures in [\d.]+ s\n", done.err)
    pictures, _ = imageio_ffmpeg.count_frames_and_secs(str(path.with_suffix(".mp4")))
    assert pictures == -(-len(recording.steps) // 2)  # 20 steps a second, 10 pictures

    others = tuple(dataclasses.replace(body, half=(1, 1, 1)) for body in recording.scene.bodies)
    scene = dataclasses.replace(recording.scene, bodies=others)
    files.save(dataclasses.replace(recording, scene=scene), path)
    assert "begins with other objects now" in safemanip("video", path, *small).refusal


def test_without_pillow_the_extra_is_named(
    monkeypatch: pytest.MonkeyPatch, safemanip: Command
) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "PIL"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "PIL", None)
    line = safemanip("pictures", "OpenDrawer").refusal
    assert "pip install '.[robocasa,video]'" in line


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("NoTask",), "SELECTOR: 'NoTask' matches no task"),
        (
            ("OpenDrawer", "--seeds", "x"),
            "--seeds: expected N (that many), A:B (without B) or A,B,C",
        ),
        (("OpenDrawer", "--cameras", "above"), "--cameras: 'above' is none of room, close"),
        (("OpenDrawer", "--size", "0"), "--size: expected 16 to 2048 pixels, found 0"),
    ],
)
def test_mistakes_are_named_before_anything_is_built(
    arguments: tuple[str, ...], message: str, safemanip: Command
) -> None:
    pytest.importorskip("PIL.Image")
    assert message in safemanip("pictures", *arguments).refusal


def test_a_recording_of_another_simulator_is_not_drawn(safemanip: Command, recorded: Any) -> None:
    pytest.importorskip("PIL.Image")
    assert (
        "recordings of the backend 'toy' cannot be drawn" in safemanip("video", recorded()).refusal
    )


def test_of_another_kind_no_video_is_written(safemanip: Command, recorded: Any) -> None:
    said = safemanip("video", recorded(), "-o", "one.avi").refusal
    assert "--out: expected a .mp4 or .gif file or a folder: one.avi" in said
