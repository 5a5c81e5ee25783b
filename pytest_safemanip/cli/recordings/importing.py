"""``safemanip import``."""

from __future__ import annotations

import argparse
import math
import shlex
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from pytest_safemanip.cli.folder import read_folder
from pytest_safemanip.cli.recordings.output import check_folder, given_path
from pytest_safemanip.errors import (
    ConfigError,
    SafemanipError,
    TraceError,
    placed,
    printable,
    raised_as,
)
from pytest_safemanip.importers.base import DRIFT_LIMIT, ImportOptions, SourceEpisode
from pytest_safemanip.importers.drafting import Drafts
from pytest_safemanip.importers.registry import IMPORTERS, find_importer
from pytest_safemanip.importers.source import Source
from pytest_safemanip.report.numbers import counted
from pytest_safemanip.rollouts.store import file_name
from pytest_safemanip.run.definitions import Definitions
from pytest_safemanip.sim.mujoco.graphics import never_drawn
from pytest_safemanip.spec.tasks import TASK_NAME
from pytest_safemanip.trace import files
from pytest_safemanip.trace.episode import POLICY_NAME
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.video import footage
from pytest_safemanip.video.progress import Bar

EXAMPLE = (
    "safemanip import demonstrations/lift/demo.hdf5 -o recordings && "
    "pytest --safemanip-recordings=recordings"
)

TASKS = "tasks"
"""Folder, beside the recordings, of the files that are drafted for tasks that nobody has bound."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "source",
        type=given_path,
        metavar="SOURCE",
        help="a file, a folder, or a wheel that has them",
    )
    parser.add_argument(
        "-o",
        "--out",
        type=given_path,
        metavar="DIR",
        required=True,
        help="where recordings are written",
    )
    parser.add_argument("--task", default="", metavar="NAME", help="the task, if not the source's")
    parser.add_argument(
        "--policy", default="", metavar="NAME", help="who acted, if not what the source says"
    )
    parser.add_argument(
        "--bindings",
        type=Path,
        metavar="FILE",
        help="YAML that says what is a hand, an object, a fixture in the source, where its names "
        "do not",
    )
    parser.add_argument(
        "--assets",
        type=Path,
        action="append",
        default=[],
        metavar="DIR",
        help="a folder of meshes that the source refers to; may be given several times",
    )
    parser.add_argument(
        "--no-tail",
        action="store_true",
        help="end with the last state: what physics still owes is then unresolved",
    )
    parser.add_argument(
        "--drift-limit",
        type=float,
        default=DRIFT_LIMIT,
        metavar="M",
        help="refuse an episode in which an object is farther from where physics takes it within a "
        f"control period (default: {DRIFT_LIMIT} m)",
    )
    parser.add_argument(
        "--no-images",
        action="store_true",
        help="leave what the cameras of a log saw where it is; by default it is written beside its "
        "recording, for safemanip video",
    )
    parser.add_argument(
        "--format", choices=tuple(IMPORTERS), help="what the source is, if it is not recognized"
    )


def run(options: argparse.Namespace) -> int:
    """Import what can be imported, one file after the other, and say what was refused.

    Returns:
        1 if an episode was refused.
    """
    if not 0.0 <= options.drift_limit < math.inf:
        raise ConfigError(f"--drift-limit: expected metres from 0 up, found {options.drift_limit}")
    check_folder(options.out)
    defined = read_folder().definitions  # refused before anything is simulated
    with never_drawn():
        return _import(options, defined)


def _import(options: argparse.Namespace, defined: Definitions) -> int:
    source = Source(options.source)
    importer = find_importer(source, options.format or "")
    chosen = ImportOptions(
        task=options.task,
        bindings=options.bindings,
        policy=options.policy,
        assets=tuple(options.assets),
        tail=not options.no_tail,
        drift_limit=options.drift_limit,
    )
    episodes = list(importer.episodes(source, chosen))
    if not episodes:
        raise ConfigError(f"{source.path}: it has no episode")
    found = _Found(options.out, defined, len(episodes), not options.no_images)
    try:
        with Bar() as bar:
            found.take(episodes, bar)
    finally:  # Ctrl-C keeps what there is
        found.print()
    return 1 if found.refused else 0


@dataclass
class _Found:
    """What became of the episodes of a source."""

    out: Path
    defined: Definitions
    total: int
    images: bool
    imported: list[str] = field(default_factory=list)
    refused: list[tuple[str, str]] = field(default_factory=list)
    unseen: list[str] = field(default_factory=list)
    known: int = 0
    drafts: Drafts = field(init=False)

    def __post_init__(self) -> None:
        self.drafts = Drafts(self.defined.tasks, self.defined.attributes)

    def take(self, episodes: list[SourceEpisode], bar: Bar) -> None:
        """Import them."""
        for number, episode in enumerate(episodes, 1):
            name = printable(episode.name)
            what = f"{name} ({number} of {self.total})"
            try:
                if not episode.task:  # nothing could be read, and this says why
                    episode.record(lambda *_: None)
                if not TASK_NAME.fullmatch(episode.task):
                    raise TraceError(f"{printable(repr(episode.task))} is no name of a task")
                if not POLICY_NAME.fullmatch(episode.policy):
                    raise TraceError(f"{printable(repr(episode.policy))} is no name of a policy")
                target = self.out / file_name(episode.task, episode.policy, episode.seed)
                if self._has(target, episode.name):
                    self.known += 1
                    if self.drafts.lack(episode.task):  # whoever was killed has written none
                        self.drafts.note(files.load(target))
                    continue
                with raised_as(TraceError, "cannot be imported"):  # a stranger's file
                    recording = episode.record(partial(bar.show, what))
                if self.images:
                    self._cut(episode, target)
                files.save(recording, target)
                self.drafts.note(recording)
                self.imported.append(_said(name, target, recording))
            except SafemanipError as error:
                self.refused.append((name, str(error)))

    def _cut(self, episode: SourceEpisode, path: Path) -> None:
        """Write what its cameras saw; no verdict depends on that, so it may be missing."""
        for clip in episode.clips:
            target = path.with_suffix(footage.SUFFIX) / f"{clip.camera}.mp4"
            try:
                with clip.open() as stream:
                    footage.cut(stream, target, clip.start, clip.pictures, clip.rate)
            except SafemanipError as error:
                self.unseen.append(f"{printable(episode.name)}, {clip.camera}: {error}")

    def _has(self, path: Path, name: str) -> bool:
        """Whether the episode was imported before.

        Raises:
            ConfigError: if another one has its file.
        """
        if not path.exists():
            return False
        if files.load_episode(path).origin.get("episode") != name:
            raise ConfigError(
                f"{path} is another rollout; name who acted with --policy, or another folder"
            )
        return True

    def print(self) -> None:
        """Say what there is now."""
        for line in self.imported:
            print(line)
        again = f", {self.known} imported before" if self.known else ""
        left = self.total - len(self.imported) - len(self.refused) - self.known
        rest = f", {left} not reached" if left else ""
        print(f"{len(self.imported)} of {counted(self.total, 'episode')} imported{again}{rest}")
        for name, why in self.refused:
            print(f"refused  {placed(name, why)}")
        for what in self.unseen:
            print(f"without pictures  {what}")
        if not self.imported and not self.known:
            return
        folder = self.out / TASKS
        for draft in self.drafts.write(folder):
            print(f"drafted  {draft}: look through it before you trust a verdict")
        named = f" -o safemanip_task_paths={shlex.quote(str(folder))}" if folder.is_dir() else ""
        print(f"judge them  pytest --safemanip-recordings={shlex.quote(str(self.out))}{named}")


def _said(name: str, path: Path, recording: Recording) -> str:
    """The line about an episode that was imported."""
    origin, steps = recording.episode.origin, counted(recording.acting, "step")
    drift = f", drift {origin['drift']}" if "drift" in origin else ""
    return f"{path.name}  {steps}{drift}  {name}"
