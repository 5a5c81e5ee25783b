"""``safemanip video``: a recording's joint positions in its episode's scene, step by step."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from pytest_safemanip.cli.drawing import (
    ProgressLine,
    add_drawing,
    draw,
    open_studio,
    parse_cameras,
    pillow,
)
from pytest_safemanip.cli.evaluation import Evaluation, add_judging, evaluate
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.report.counterexample import DRAWN
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.codec import decode_request

EXAMPLE = "safemanip video .safemanip/recordings/OpenDrawer-scripted-seed0.rollout --cameras room"
FRAMES_PER_SECOND = 10
UNSAFE = "#ffb0b0"
"""Behind the caption of steps at which a property is violated."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_judging(parser)
    add_drawing(parser)


def run(options: argparse.Namespace) -> int:
    """Draw the GIF, and print its path."""
    drawn = pillow()
    cameras = parse_cameras(options.cameras)
    found = evaluate(options)
    recording, episode = found.recording, found.recording.episode
    request = recorded_request(found, options.recording)
    steps, period = recording.steps, recording.scene.control_period
    stride = max(1, round(1 / (FRAMES_PER_SECOND * period)))
    frames = []
    studio = open_studio(options.assets or found.folder.settings.assets, options.size)
    try:
        with studio.visit(request) as shot, ProgressLine(-(-len(steps) // stride)) as progress:
            shot.check(recording.scene)
            for step in range(0, len(steps), stride):
                progress.show(f"step {step} of {len(steps) - 1}")
                shot.pose(steps.qpos[step])
                unsafe = _violated(found, step, step + stride - 1)
                text = f"{episode.task}, {episode.policy}, seed {episode.seed}\n"
                text += f"VIOLATED {', '.join(unsafe)}, " if unsafe else ""
                text += f"step {step}, {step * period:.2f} s"
                text += ", settling" if steps.tail[step] else ""
                picture = draw(shot, cameras, text, UNSAFE if unsafe else "white")
                frames.append(drawn.Image.fromarray(picture))
    finally:
        studio.close()
    path = options.out / f"{options.recording.stem}.gif"
    path.parent.mkdir(parents=True, exist_ok=True)
    duration = round(1000 * stride * period)
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=duration, loop=0)
    print(path)
    for id_, error in found.errors.items():
        print(f"safemanip video: {id_} is not marked, it has no verdict: {error}", file=sys.stderr)
    return 0


def _violated(found: Evaluation, first: int, last: int) -> list[str]:
    """The properties that are violated at some of these steps."""
    return [
        id_
        for id_, verdict in found.verdicts.items()
        if any(finding.first <= last and first <= finding.last for finding in verdict.findings)
    ]


def recorded_request(found: Evaluation, path: Path) -> Request:
    """The episode of a recording.

    Raises:
        ConfigError: if it is another backend's, or the recording does not say how it began.
    """
    episode = found.recording.episode
    if episode.backend not in DRAWN:
        raise ConfigError(
            f"{path}: recorded with the backend {episode.backend!r}; only recordings of "
            f"{', '.join(DRAWN)} can be drawn"
        )
    if not episode.request:
        raise ConfigError(f"{path}: the recording does not say what the simulator was asked for")
    return decode_request(episode.request)
