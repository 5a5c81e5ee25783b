"""What the cameras of a log saw: taken over beside its recording, and shown with its verdicts."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_safemanip.cli.main import main
from pytest_safemanip.lerobot.layout import LAYOUTS
from pytest_safemanip.video.encoding import open_encoder
from pytest_safemanip.video.footage import Footage, cameras_of
from tests.lerobot.conftest import Exported, command

TASK = "PickPlaceCounterToCabinet"
NAME = f"{TASK}-mine-seed0.rollout"
FEATURES = {"observation.images.wrist": 64, "observation.images.left": 96}
LEAD = 7
"""Pictures of another episode, before those of ours."""


def film(path: Path, pictures: int, width: int) -> None:
    """Pictures that are brighter with every step, twice as wide as high."""
    path.parent.mkdir(parents=True)
    with open_encoder(path, (width, width // 2), 20.0) as encoder:
        for number in range(pictures):
            encoder.add(np.full((width // 2, width, 3), number % 200, np.uint8))


def log(exported: Exported, folder: Path, version: str, short: int = 0) -> Path:
    """A dataset without states, with moving pictures."""
    shutil.copytree(
        exported(TASK, version=version), folder, ignore=shutil.ignore_patterns("extras")
    )
    about = json.loads((folder / "meta/info.json").read_text())
    about["video_path"] = LAYOUTS[version].video
    about["features"] |= {name: {"dtype": "video"} for name in FEATURES}
    (folder / "meta/info.json").write_text(json.dumps(about))
    lead = 0 if version == "v2.1" else LEAD
    for name, width in FEATURES.items():
        count = lead + about["total_frames"] - short
        film(folder / LAYOUTS[version].video_file(0, name), count, width)
    if version == "v3.0":
        add_columns(folder, lead / about["fps"])
    return folder


def add_columns(folder: Path, start: float) -> None:
    """Say of each camera where in its file the episode is."""
    parquet = pytest.importorskip("pyarrow.parquet")
    (path,) = (folder / "meta/episodes").rglob("*.parquet")
    table = parquet.read_table(path)
    for name in FEATURES:
        places = {"chunk_index": 0, "file_index": 0, "from_timestamp": start}
        for key, value in places.items():
            table = table.append_column(f"videos/{name}/{key}", [[value]])
    parquet.write_table(table, path)


def imported(source: Path, *options: str) -> tuple[Path, str]:
    """The recording of a log, and what was said."""
    out = source.parent / "out"
    said = command("import", source, "-o", out, "--task", TASK, "--policy", "mine", *options)
    return out / NAME, said


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_each_step_has_the_pictures_of_its_row(
    exported: Exported, tmp_path: Path, version: str
) -> None:
    recording, _ = imported(log(exported, tmp_path / "log", version))
    files = cameras_of(recording)
    assert set(files) == {"left", "wrist"}
    lead = 0 if version == "v2.1" else LEAD
    seen: Any = Footage(files, 32, range(0, 90, 3))
    for step in (0, 3, 60, 87):
        for picture in seen.views(step):
            assert picture.shape == (32, 32, 3)
            assert abs(int(picture[16, 16, 0]) - (lead + step)) <= 2
            assert picture[[2, -2]].max() < 8  # black bands


def test_the_video_of_a_log_shows_what_its_cameras_saw(
    exported: Exported, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording, _ = imported(log(exported, tmp_path / "log", "v2.1"))
    command("video", recording, "-o", tmp_path / "all.mp4", "--size", "32")
    command("video", recording, "-o", tmp_path / "one.mp4", "--size", "32", "--cameras", "left")
    assert (tmp_path / "all.mp4").stat().st_size > (tmp_path / "one.mp4").stat().st_size > 0
    assert main(["video", str(recording), "--cameras", "room"]) == 4
    assert "--cameras: 'room' is none of left, wrist" in capsys.readouterr().err


def test_what_cameras_saw_may_stay_where_it_is(exported: Exported, tmp_path: Path) -> None:
    recording, _ = imported(log(exported, tmp_path / "log", "v2.1"), "--no-images")
    assert recording.exists()
    assert not cameras_of(recording)


def test_pictures_that_cannot_be_read_are_named_and_the_recording_is_there(
    exported: Exported, tmp_path: Path
) -> None:
    source = log(exported, tmp_path / "log", "v2.1")
    wrist = source / LAYOUTS["v2.1"].video_file(0, "observation.images.wrist")
    wrist.write_text("#EXTM3U\nfile:///etc/passwd\n")
    left = source / LAYOUTS["v2.1"].video_file(0, "observation.images.left")
    left.unlink()
    recording, said = imported(source)
    assert recording.exists()
    assert not cameras_of(recording)
    assert "without pictures  episode_000000, wrist: no moving pictures that can be read" in said
    assert "without pictures  episode_000000, left: videos/" in said


def test_fewer_pictures_than_steps_are_no_video(
    exported: Exported, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording, _ = imported(log(exported, tmp_path / "log", "v2.1", short=20))
    assert main(["video", str(recording), "-o", str(tmp_path / "v.mp4")]) != 0
    assert "pictures where the recording has" in capsys.readouterr().err
    assert not (tmp_path / "v.mp4").exists()
