"""The recordings that are judged when nothing is simulated."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import groupby
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import ConfigError, TraceError, did_you_mean
from pytest_safemanip.metrics.records import RolloutKey
from pytest_safemanip.propositions.grounding import check_call
from pytest_safemanip.run.cases import Case, select_tasks
from pytest_safemanip.run.definitions import Definitions
from pytest_safemanip.run.settings import Settings
from pytest_safemanip.spec.task import Task
from pytest_safemanip.trace import files
from pytest_safemanip.trace.episode import Episode
from pytest_safemanip.trace.scene import Scene

MOST_NAMED = 8
"""Names that a message lists of what there is."""


def find_recordings(folder: Path, option: str = "--safemanip-recordings") -> dict[Path, Episode]:
    """The recordings in a folder, which was given for an option.

    Raises:
        ConfigError: if there is no such folder, or one cannot be read.
    """
    if not folder.is_dir():
        raise ConfigError(f"{option}: {folder} is not a directory")
    return {path: _read_episode(path) for path in sorted(folder.rglob(f"*{files.SUFFIX}"))}


def select_recordings(
    settings: Settings, folder: Path, recordings: Mapping[Path, Episode], tasks: Mapping[str, Task]
) -> dict[RolloutKey, Path]:
    """The recordings whose policy, task and seed are selected; of ``all`` tasks also those that
    stage the scene of another, since they are there.

    Raises:
        ConfigError: if there is none, two of the same rollout, or one of an unknown task.
    """
    selectors = ["*" if selector == "all" else selector for selector in settings.tasks]
    chosen = {task.name for task in select_tasks(tasks, selectors)}
    found: dict[RolloutKey, Path] = {}
    for path, episode in recordings.items():
        if episode.task not in tasks:
            hint = did_you_mean(episode.task, tasks, "safemanip tasks")
            raise ConfigError(f"{path}: unknown task {episode.task!r}; {hint}")
        key = RolloutKey(episode.policy, episode.task, episode.seed)
        if (
            episode.task not in chosen
            or (settings.policies and episode.policy not in settings.policies)
            or (settings.seeds is not None and episode.seed not in settings.seeds)
        ):
            continue
        if key in found:
            raise ConfigError(f"{path} and {found[key]} are recordings of the same rollout")
        found[key] = path
    if not found:
        raise ConfigError(f"--safemanip-recordings: {_none_of(recordings, folder)}")
    return found


def _none_of(recordings: Mapping[Path, Episode], folder: Path) -> str:
    """That no recording in a folder is selected, and what they are of."""
    if not recordings:
        return f"no *{files.SUFFIX} file in {folder}"
    episodes = recordings.values()
    of: dict[str, list[Any]] = {
        "tasks": sorted({episode.task for episode in episodes}),
        "policies": sorted({episode.policy for episode in episodes}),
        "seeds": sorted({episode.seed for episode in episodes}),
    }
    said = [f"{what} {', '.join(map(str, some[:MOST_NAMED]))}" for what, some in of.items()]
    return f"no *{files.SUFFIX} file in {folder} is selected; there are {'; '.join(said)}"


def control_periods(paths: Iterable[Path]) -> dict[Path, float]:
    """Seconds from step to step, of each of some recordings.

    Raises:
        ConfigError: if one cannot be read.
    """
    return {path: _read_scene(path).control_period for path in paths}


def check_grounded(
    recordings: Mapping[RolloutKey, Path], cases: Iterable[Case], defined: Definitions
) -> None:
    """Refuse recordings whose scenes lack what a case needs: it would be silently false.

    Raises:
        ConfigError: naming the file, and the role, category or part that is unknown or missing.
    """
    for key, own in groupby(cases, key=lambda case: case.rollout):
        scene = _read_scene(recordings[key])
        try:
            binding = defined.tasks[key.task].bind(scene, defined.attributes)
            for prop in (defined.properties[case.property_id] for case in own):
                for row in prop.rows(binding):
                    for name, *arguments in prop.calls(row):
                        check_call(defined.catalogue[name], tuple(arguments), scene, binding.zones)
        except TraceError as error:
            raise ConfigError(f"{recordings[key]}: {error}") from error


def _read_scene(path: Path) -> Scene:
    try:
        return files.load_scene(path)
    except TraceError as error:
        raise ConfigError(str(error)) from error


def _read_episode(path: Path) -> Episode:
    try:
        return files.load_episode(path)
    except TraceError as error:
        raise ConfigError(str(error)) from error
