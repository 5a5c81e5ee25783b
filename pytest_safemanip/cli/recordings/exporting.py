"""``safemanip export``."""

from __future__ import annotations

import argparse
import importlib
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.cli.drawing import add_assets
from pytest_safemanip.cli.evaluation import evaluate
from pytest_safemanip.cli.folder import Folder, read_folder
from pytest_safemanip.cli.recordings.output import check_folder, given_path
from pytest_safemanip.errors import ConfigError, SafemanipError, did_you_mean, placed
from pytest_safemanip.lerobot.conventions import IMAGES, STATE_PARTS
from pytest_safemanip.lerobot.extras import Extras
from pytest_safemanip.lerobot.layout import LAYOUTS, V21
from pytest_safemanip.lerobot.parquet import pyarrow
from pytest_safemanip.lerobot.writing import DatasetWriter, Rows
from pytest_safemanip.report.numbers import counted
from pytest_safemanip.sim.robocasa import observation
from pytest_safemanip.trace import files
from pytest_safemanip.trace.episode import Episode
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.video.encoding import check_encoder, open_encoder
from pytest_safemanip.video.film import request_of
from pytest_safemanip.video.progress import Bar

EXAMPLE = "safemanip export .safemanip/recordings --lerobot -o datasets --only safe,successful"
ONLY = ("safe", "successful")
BACKEND = "robocasa"
KEYFRAMES = 10
"""Pictures from one that stands for itself to the next: readers jump to any."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "sources",
        nargs="+",
        type=given_path,
        metavar="RECORDING",
        help="a .rollout file, or a folder of them",
    )
    parser.add_argument(
        "--lerobot",
        nargs="?",
        const=V21.version,
        choices=tuple(LAYOUTS),
        required=True,
        metavar="VERSION",
        help=f"as LeRobotDatasets, of {' or '.join(LAYOUTS)}; without a version {V21.version}, as "
        "RoboCasa365's own are",
    )
    parser.add_argument(
        "-o",
        "--out",
        type=given_path,
        required=True,
        metavar="DIR",
        help="where a dataset is written for each task",
    )
    parser.add_argument(
        "--only",
        default="",
        metavar="WHAT[,...]",
        help=f"leave out rollouts that are not {' or '.join(ONLY)}",
    )
    parser.add_argument(
        "--images",
        action="store_true",
        help="draw what the robot's cameras see, as policies get it; without a GPU some 200 ms a "
        "step",
    )
    add_assets(parser)


def run(options: argparse.Namespace) -> int:
    """Write a dataset for each task, and print its path.

    Returns:
        1 if a recording was refused.
    """
    wanted = _parse_only(options.only)
    check_folder(options.out)
    pyarrow()
    if options.images:
        check_encoder(Path("video.mp4"))
    folder = read_folder()
    by_task: dict[str, list[Path]] = {}
    refused: list[str] = []
    left_out = 0
    for path in _recordings(options.sources):
        try:
            task = _exportable(path).task
            if _is_wanted(path, wanted, folder):
                by_task.setdefault(task, []).append(path)
            else:
                left_out += 1
        except SafemanipError as error:
            refused.append(placed(path, error))
    if not by_task and not refused:
        raise ConfigError(f"--only: no recording is {' and '.join(wanted)}")
    with Bar() as bar:
        if by_task:
            exporter = _Exporter(options, folder, bar)
            for task, paths in by_task.items():
                try:
                    refused += exporter.write(task, paths)
                except ConfigError as error:  # an export that was interrupted goes on behind it
                    refused.append(str(error))
    if left_out:
        print(f"{counted(left_out, 'recording')} left out: not {' and '.join(wanted)}")
    for reason in refused:
        print(f"refused  {reason}")
    return 1 if refused else 0


def _parse_only(text: str) -> list[str]:
    wanted = [part.strip() for part in text.split(",") if part.strip()]
    for word in wanted:
        if word not in ONLY:
            raise ConfigError(f"--only: unknown {word!r}; {did_you_mean(word, ONLY)}")
    return wanted


def _recordings(sources: list[Path]) -> list[Path]:
    found: list[Path] = []
    for source in sources:
        own = sorted(source.rglob(f"*{files.SUFFIX}")) if source.is_dir() else [source]
        if not own:
            raise ConfigError(f"{source}: no *{files.SUFFIX} file in it")
        found += own
    return list(dict.fromkeys(found))


def _exportable(path: Path) -> Episode:
    """The episode of a recording.

    Raises:
        SafemanipError: if it cannot be read, or is of a simulator whose scenes are not exported.
    """
    episode = files.load_episode(path)
    if episode.backend != BACKEND:
        raise ConfigError(
            f"recorded with the backend {episode.backend!r}; only {BACKEND}'s can be exported: "
            "datasets have its robot's state and its models"
        )
    return episode


def _is_wanted(path: Path, wanted: list[str], folder: Folder) -> bool:
    if not wanted:
        return True
    judging = argparse.Namespace(recording=path, property=[], params=[], semantics=None)
    found = evaluate(judging, folder)
    safe = not found.errors and not any(v.findings for v in found.verdicts.values())
    held = {"safe": safe, "successful": found.recording.success}
    return all(held[word] for word in wanted)


class _Exporter:
    """Writes datasets, in a RoboCasa that is imported once.

    Args:
        options: of the command.
        folder: the working folder.
        bar: told how far it is.
    """

    def __init__(self, options: argparse.Namespace, folder: Folder, bar: Bar) -> None:
        self._out, self._version, self._bar = options.out, options.lerobot, bar
        self._context: Any = None
        # With a GL library named that is not there, MuJoCo cannot be imported; see graphics.py.
        gl = os.environ.pop("MUJOCO_GL", "")
        assets = importlib.import_module("pytest_safemanip.sim.robocasa.assets")
        loading = importlib.import_module("pytest_safemanip.sim.robocasa.loading")
        kind = options.assets or folder.settings.assets
        self._root = assets.prepare_assets(loading.package_assets(), kind).root
        loading.load(self._root)
        self._capturing = importlib.import_module(
            "pytest_safemanip.sim.robocasa.playback.capturing"
        )
        if options.images:
            graphics = importlib.import_module("pytest_safemanip.sim.mujoco.graphics")
            self._context = graphics.open_context(gl)

    def write(self, task: str, paths: list[Path]) -> list[str]:
        """Write the dataset of a task, and print its path; gives the reasons of refusals."""
        refused = []
        period = files.load_scene(paths[0]).control_period
        rate = round(1 / period)
        encoder = None
        if self._context is not None:
            size = observation.IMAGE_SIZE
            encoder = lambda path: open_encoder(path, (size, size), rate, KEYFRAMES)  # noqa: E731
        with DatasetWriter(self._out / task, self._version, task, rate, encoder) as writer:
            for path in paths:
                try:
                    self._add(writer, path, period)
                except SafemanipError as error:
                    refused.append(placed(path, error))
            if writer.lengths:
                writer.close(self._capturing.environment_arguments(task, period))
                self._bar.say("")
                count = f"{counted(len(writer.lengths), 'episode')}, {sum(writer.lengths)} steps"
                print(f"{self._out / task}  {count}")
        return refused

    def _add(self, writer: DatasetWriter, path: Path, period: float) -> None:
        recording = files.load(path)
        if recording.scene.control_period != period:
            raise ConfigError("its control period is not that of the others of its task")
        if recording.acting < 2:
            raise ConfigError("the robot has not acted")
        request = request_of(recording, path)
        scene = self._capturing.Capture(request, recording.scene, self._root, self._context)
        try:
            writer.add(self._rows(recording, scene, path.name))
        finally:
            scene.close()

    def _rows(self, recording: Recording, scene: Any, what: str) -> Rows:
        steps, count = recording.steps, recording.acting - 1
        states = _states(recording)
        robot = []
        for step in range(count):
            scene.pose(steps.qpos[step])
            seen = scene.proprioception()
            robot.append(np.concatenate([seen[f"state.{part}"] for part in STATE_PARTS]))
        return Rows(
            instruction=recording.episode.instruction,
            state=np.array(robot),
            action=steps.action[1 : count + 1],
            success=steps.success[1 : count + 1],
            images=self._images(recording, scene, what, count),
            extras=Extras(
                states=states[:count],
                after=states[count:],
                model=scene.model,
                meta=scene.meta,
                about=recording.episode.to_json(),
            ),
        )

    def _images(
        self, recording: Recording, scene: Any, what: str, count: int
    ) -> Iterator[Mapping[str, NDArray[np.uint8]]]:
        for step in range(count):
            scene.pose(recording.steps.qpos[step])
            yield {IMAGES[key]: image for key, image in scene.images().items()}
            self._bar.show(what, step + 1, count)


def _states(recording: Recording) -> NDArray[np.float64]:
    """Time, positions and velocities at each step (T, 1 + nq + nv)."""
    steps = recording.steps
    time = np.arange(len(steps)) * recording.scene.control_period
    return np.column_stack((time, steps.qpos, steps.qvel)).astype(np.float64)
