"""How long the video of a recording takes, beside the GIF that it replaced; what each change saves.

    python -m benchmarks.speed.video .safemanip/recordings/OpenDrawer-scripted-seed0.rollout

The reference draws what ``safemanip video`` drew before: four antialiased cameras of whole meshes,
each picture from anew, quantised by Pillow. All are processes of their own, one after the other.
What else runs meanwhile makes the wall time say less than the processor's.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pytest_safemanip.cli.drawing import draw
from pytest_safemanip.sim.robocasa.rendering import thinning
from pytest_safemanip.trace import files
from pytest_safemanip.video.film import request_of, stride_of
from pytest_safemanip.video.imaging import open_studio, pillow

BEFORE = ("room", "close", "left", "wrist")
NOW = ("room", "close", "wrist")
SIZE = 256
SAMPLED = 24
"""Pictures that a lever is measured on."""


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--reference", type=Path, metavar="GIF", help=argparse.SUPPRESS)
    parser.add_argument("--rounds", type=int, default=1)
    options = parser.parse_args()
    if options.reference:
        _reference(options.recording, options.reference)
        return
    _levers(options.recording)
    with tempfile.TemporaryDirectory() as folder:
        _commands(options.recording, Path(folder), options.rounds)


def _commands(recording: Path, folder: Path, rounds: int) -> None:
    """Whole commands, from the shell to the file; the fastest of some rounds."""
    gif, mp4, new = folder / "before.gif", folder / "now.mp4", folder / "now.gif"
    video = [sys.executable, "-m", "pytest_safemanip", "video", str(recording), "--out"]
    before = [sys.executable, "-m", "benchmarks.speed.video", str(recording), "--reference"]
    rows = [
        ("GIF as it was", [*before, str(gif)], gif),
        ("GIF", [*video, str(new)], new),
        ("MP4", [*video, str(mp4)], mp4),
    ]
    print(f"\n{'command':<16}{'wall':>9}{'CPU':>9}{'size':>10}{'faster':>9}{'less CPU':>10}")
    first: tuple[float, float] | None = None
    for name, command, path in rows:
        wall, cpu = min(_timed(command) for _ in range(rounds))
        first = first or (wall, cpu)
        print(
            f"{name:<16}{wall:>7.1f} s{cpu:>7.1f} s{path.stat().st_size / 1e6:>7.2f} MB"
            f"{first[0] / wall:>8.1f}x{first[1] / cpu:>9.1f}x"
        )


def _timed(command: Sequence[str]) -> tuple[float, float]:
    """Seconds of a command, and of all processors in it."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _reference(path: Path, target: Path) -> None:
    """The GIF as it was written before."""
    recording = files.load(path)
    stride = stride_of(recording.scene.control_period)
    studio, image = open_studio("auto", SIZE), pillow().Image
    with studio.visit(request_of(recording, path)) as shot:
        shot.check(recording.scene)
        frames = []
        for step in range(0, len(recording.steps), stride):
            shot.pose(recording.steps.qpos[step])
            frames.append(image.fromarray(draw(shot, BEFORE, f"{path.stem}\nstep {step}")))
    studio.close()
    frames[0].save(target, save_all=True, append_images=frames[1:], duration=100, loop=0)


def _levers(path: Path) -> None:
    """What a picture takes, one change after the other."""
    recording = files.load(path)
    steps = np.linspace(0, len(recording.steps) - 1, SAMPLED).astype(int)
    studio = open_studio("auto", SIZE)
    print(f"{'a picture of the scene':<44}{'ms':>8}{'faster':>9}")
    with studio.visit(request_of(recording, path)) as shot:
        model = shot._model

        def measure(name: str, cameras: Sequence[str], change: Callable[[], Any]) -> float:
            change()
            for painter in shot._painters.values():
                painter.close()
            shot._painters.clear()
            for camera in cameras:
                shot.take(camera)  # uploads the scene
            began = time.process_time()
            for step in steps:
                shot.pose(recording.steps.qpos[step])
                for camera in cameras:
                    shot.take(camera)
            return 1000 * (time.process_time() - began) / SAMPLED

        def no_samples() -> None:
            model.vis.quality.offsamples = 0

        def remember() -> None:
            shot._known = {}

        rows: list[tuple[str, Sequence[str], Callable[[], Any]]] = [
            ("four cameras, 4 samples a pixel", BEFORE, lambda: None),
            ("three cameras", NOW, lambda: None),
            ("  and meshes of at most 1,500 faces or so", NOW, lambda: thinning.thin_meshes(model)),
            ("  and one sample a pixel", NOW, no_samples),
            ("  and without shadows and reflections", NOW, lambda: thinning.simplify(model)),
            ("  and views in which nothing moved kept", NOW, remember),
        ]
        first = 0.0
        for name, cameras, change in rows:
            taken = measure(name, cameras, change)
            first = first or taken
            print(f"{name:<44}{taken:>8.1f}{first / taken:>8.1f}x")
    studio.close()
    print(f"CPU time; {len(os.sched_getaffinity(0))} cores draw every other picture each")


if __name__ == "__main__":
    main()
