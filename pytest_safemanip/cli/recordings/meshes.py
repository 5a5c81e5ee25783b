"""What both viewers' subcommands have in common."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from pathlib import Path

from pytest_safemanip.cli.drawing import add_assets
from pytest_safemanip.cli.evaluation import Evaluation, add_judging
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.looks import Look
from pytest_safemanip.trace.files import SUFFIX
from pytest_safemanip.video.film import request_of


def add_viewing(parser: argparse.ArgumentParser, ending: str) -> None:
    """Declare the options: what decides verdicts, the file, and meshes."""
    add_judging(parser)
    parser.add_argument(
        "-o",
        "--out",
        "--output",
        dest="output",
        type=Path,
        metavar="FILE",
        help=f"default: the recording's name with {ending}, in the working folder",
    )
    parser.add_argument(
        "--meshes",
        action="store_true",
        help="the simulator's meshes instead of boxes; builds the episode's scene",
    )
    add_assets(parser)


def output(options: argparse.Namespace, ending: str) -> Path:
    """Where the file is written.

    Raises:
        ConfigError: if that would replace a recording.
    """
    path: Path = options.output or Path(f"{options.recording.stem}{ending}")
    if path.suffix == SUFFIX:
        raise ConfigError(f"{path}: is the name of a recording; name a {ending} file")
    return path


def looks(options: argparse.Namespace, found: Evaluation) -> Sequence[Look]:
    """The meshes that are asked for.

    Raises:
        ConfigError: if RoboCasa is not installed, or the scene is not that of the recording.
    """
    if not options.meshes:
        return ()
    request = request_of(found.recording, options.recording)
    os.environ.pop("MUJOCO_GL", None)  # with one that is not there, MuJoCo cannot be imported
    from pytest_safemanip.sim.robocasa.rendering.meshes import read_looks

    assets = options.assets or found.folder.settings.assets
    return read_looks(request, found.recording, assets)
