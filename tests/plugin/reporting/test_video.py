"""``--safemanip-video``: videos after the run."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import imageio_ffmpeg
import pytest

from pytest_safemanip.errors import RolloutError
from pytest_safemanip.trace import files
from pytest_safemanip.video.process import Drawer
from tests.plugin.conftest import MODES, Suite
from tests.plugin.toyfolder import set_up
from tests.sim.rendering.test_observing import require

FAULT = ("PickPlaceCounterToCabinet", "scripted:half_inside")
FINE = ("OpenDrawer", "scripted")


def test_rollouts_with_violations_are_drawn_when_the_run_is_over(
    make_suite: Callable[..., Suite],
) -> None:
    require("osmesa")
    suite = make_suite(MODES["-n 2"])
    suite.has_recorded(FAULT, FINE)
    result = suite.run(
        "--safemanip-recordings=.safemanip/recordings", "--safemanip-video=violations", "-q"
    )
    result.stdout.fnmatch_lines(["videos: .safemanip/videos, 1 of 1 video"])
    (video,) = (suite.out / "videos").iterdir()
    assert video.name == f"{suite.recordings()[1].stem}.mp4"
    pictures, seconds = imageio_ffmpeg.count_frames_and_secs(str(video))
    steps = len(files.load(suite.recordings()[1]).steps)
    assert pictures == -(-steps // 2)
    assert seconds == pytest.approx(pictures / 10, abs=0.11)


def test_what_cannot_be_drawn_is_refused_before_the_run_or_fails_it_after(
    one_suite: Suite,
) -> None:
    set_up(one_suite)
    why = "recordings of the backend 'toy' cannot be drawn, only those of robocasa"
    result = one_suite.run("--safemanip-video=all")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"ERROR: --safemanip-video: {why}"])
    one_suite.run("-k", "grasp_stability")
    chosen = ("--safemanip-recordings=.safemanip/recordings", "-k", "grasp_stability")
    result = one_suite.run(*chosen, "--safemanip-video=all")
    assert (
        result.outlines.count(f"not drawn: Reach-rises-seed0.mp4: Reach-rises-seed0.rollout: {why}")
        == 1
    )
    result.assert_outcomes(skipped=1)  # verdicts stand
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    assert not (one_suite.out / "videos").exists()


@pytest.mark.parametrize("chosen", ["none", "violations"])
def test_without_a_reason_nothing_is_drawn(chosen: str, one_suite: Suite) -> None:
    one_suite.has_recorded(FINE)
    result = one_suite.run(
        "--safemanip-recordings=.safemanip/recordings", f"--safemanip-video={chosen}"
    )
    assert result.ret == pytest.ExitCode.OK
    result.stdout.no_fnmatch_line("*videos*")


def ends_by(error: type[BaseException]) -> Callable[..., None]:
    def draw(self: Drawer, recording: Path, board: object, target: Path, progress: object) -> None:
        if "half_inside" in recording.name:
            raise error("enough")
        target.parent.mkdir(exist_ok=True)
        target.write_bytes(b"whole")

    return draw


def test_a_video_of_the_same_is_not_drawn_again(
    one_suite: Suite, monkeypatch: pytest.MonkeyPatch
) -> None:
    one_suite.has_recorded(FAULT, FINE)
    drawn: list[str] = []

    def draw(self: Drawer, recording: Path, board: object, target: Path, progress: object) -> None:
        drawn.append(recording.name[:10])
        target.parent.mkdir(exist_ok=True)
        target.write_bytes(b"\0" * 100)

    def told(*more: str) -> str:
        drawn.clear()
        chosen = ("--safemanip-recordings=.safemanip/recordings", "--safemanip-video=all", *more)
        lines = one_suite.run(*chosen).outlines
        return next(line for line in lines if line.startswith("videos:"))

    monkeypatch.setattr(Drawer, "draw", draw)
    assert told() == "videos: .safemanip/videos, 2 of 2 videos"
    assert told() == "videos: .safemanip/videos, 2 of 2 videos, 2 of them drawn before"
    assert drawn == []
    told("--safemanip-properties=release_stability")  # it shows other propositions
    assert drawn == ["PickPlaceC"]
    video = next((one_suite.out / "videos").glob("OpenDrawer*"))
    video.write_bytes(video.read_bytes()[:-1])  # cut off
    told()
    assert "OpenDrawer" in drawn


def test_ctrl_c_keeps_what_was_drawn(one_suite: Suite, monkeypatch: pytest.MonkeyPatch) -> None:
    one_suite.has_recorded(FAULT, FINE)
    monkeypatch.setattr(Drawer, "draw", ends_by(KeyboardInterrupt))
    result = one_suite.run("--safemanip-recordings=.safemanip/recordings", "--safemanip-video=all")
    assert result.ret == pytest.ExitCode.INTERRUPTED
    result.stdout.fnmatch_lines(
        ["summary: .safemanip/summary.json", "videos: .safemanip/videos, 1 of 2 videos (interr*"]
    )
    assert [path.name[:10] for path in (one_suite.out / "videos").iterdir()] == ["OpenDrawer"]


def test_one_that_cannot_be_drawn_does_not_keep_the_others_from_it(
    one_suite: Suite, monkeypatch: pytest.MonkeyPatch
) -> None:
    one_suite.has_recorded(FAULT, FINE)
    monkeypatch.setattr(Drawer, "draw", ends_by(RolloutError))
    result = one_suite.run("--safemanip-recordings=.safemanip/recordings", "--safemanip-video=all")
    result.stdout.fnmatch_lines(
        ["videos: .safemanip/videos, 1 of 2 videos", "not drawn: PickPlace*.mp4: enough"]
    )
    assert result.ret == pytest.ExitCode.TESTS_FAILED  # of the violation


def test_without_ffmpeg_the_run_is_refused_before_it_begins(
    one_suite: Suite, monkeypatch: pytest.MonkeyPatch
) -> None:
    set_up(one_suite)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    result = one_suite.run("--safemanip-video=all")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["ERROR: MP4 is written with imageio-ffmpeg: pip install *video*"])
    assert not one_suite.recordings()


def test_the_ini_file_has_the_same_name(one_suite: Suite) -> None:
    set_up(one_suite)
    with one_suite.pytester.path.joinpath("tox.ini").open("a") as ini:
        ini.write("\nsafemanip_video = some\n")
    result = one_suite.run()
    result.stderr.fnmatch_lines(["*safemanip_video in the ini file: unknown value 'some'; *"])
