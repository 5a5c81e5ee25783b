"""``safemanip pictures``: a row for each task and seed, a column for each camera."""

from __future__ import annotations

import argparse

import numpy as np

from pytest_safemanip.cli.drawing import (
    add_drawing,
    draw,
    parse_cameras,
    task_request,
)
from pytest_safemanip.cli.folder import read_folder
from pytest_safemanip.run.cases import select_tasks
from pytest_safemanip.run.definitions import FIRST_BACKEND
from pytest_safemanip.run.option_values import parse_names, parse_seeds
from pytest_safemanip.sim.robocasa.robot import SPEC
from pytest_safemanip.video.imaging import Image, open_studio, pillow
from pytest_safemanip.video.progress import Bar

EXAMPLE = "safemanip pictures 'PickPlace*' --seeds 2 --cameras room,wrist"
ROWS = 6
"""Of a sheet; the next row begins a new one."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "selectors", nargs="*", metavar="SELECTOR[,...]", help="tasks, as --safemanip-tasks; all"
    )
    parser.add_argument("--seeds", default="1", help="N, A:B or A,B,C; 1")
    parser.add_argument("--scenes", choices=SPEC.scenes, help=SPEC.scenes[0])
    add_drawing(parser, "room,close,left,wrist", "a folder")


def run(options: argparse.Namespace) -> int:
    """Draw the sheets, and print the path of each."""
    drawn = pillow()
    folder = read_folder(FIRST_BACKEND)
    asked = parse_names(",".join(options.selectors)) or ("all",)
    chosen = select_tasks(folder.definitions.runnable, asked, "SELECTOR")
    seeds = parse_seeds(options.seeds, "--seeds")
    cameras = parse_cameras(options.cameras)
    scenes = options.scenes or folder.settings.scenes or SPEC.scenes[0]
    studio = open_studio(options.assets or folder.settings.assets, options.size)
    rows: list[Image] = []
    sheets = 0
    episodes = [(task, seed) for task in chosen for seed in seeds]
    try:
        with Bar() as bar:
            for number, (task, seed) in enumerate(episodes, 1):
                bar.show("episodes", number - 1, len(episodes))
                with studio.visit(task_request(task, seed, scenes, SPEC)) as shot:
                    text = f"{task.name}, seed {seed}\n{shot.instruction}"
                    rows.append(draw(shot, cameras, text))
                if len(rows) == ROWS or number == len(episodes):
                    sheets += 1
                    path = options.out / f"sheet-{sheets:02d}.png"
                    path.parent.mkdir(parents=True, exist_ok=True)
                    drawn.Image.fromarray(np.concatenate(rows)).save(path)
                    rows = []
                    bar.say("")
                    print(path)
    finally:
        studio.close()
    return 0
