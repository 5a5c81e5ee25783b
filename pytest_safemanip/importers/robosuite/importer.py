"""robosuite's demonstrations and robomimic's data sets, of any version, as recordings.

A file has a group ``data`` and in it a group for each episode, with ``states`` (time, positions and
velocities of MuJoCo, a row for each control step; ``actions[i]`` was executed from ``states[i]``
on) and the model: its XML, or the name of a file with it in ``models/`` beside it.
"""

from __future__ import annotations

import dataclasses
import json
import posixpath
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TraceError, printable
from pytest_safemanip.importers import hdf5
from pytest_safemanip.importers.base import ImportOptions, OnStep, SourceEpisode, refused
from pytest_safemanip.importers.bindings import Bindings, read_bindings
from pytest_safemanip.importers.builder import About, RecordingBuilder, States
from pytest_safemanip.importers.hdf5 import Group
from pytest_safemanip.importers.mjcf import Assets, compile_model
from pytest_safemanip.importers.robosuite.naming import Convention, derive_layout
from pytest_safemanip.importers.source import Source
from pytest_safemanip.sim.mujoco.strangers import MOST_XML
from pytest_safemanip.trace.recording import Recording

PERIOD = 0.02
"""Least control period of recordings, s: of sources that have more states, as 0.x's have."""
POLICY = "human"
TASKS = {
    "SawyerLift": "Lift",
    "SawyerStack": "Stack",
    "SawyerNutAssembly": "NutAssembly",
    "SawyerPickPlace": "PickPlace",
    "BaxterLift": "TwoArmLift",
    "BaxterPegInHole": "TwoArmPegInHole",
}
"""What robosuite 0.x called its tasks, and what it calls them since."""
_SPLIT = re.compile(r"(?<=[a-z])(?=[A-Z])")


class RobosuiteImporter:
    """Imports HDF5 files of robosuite and robomimic."""

    def recognizes(self, source: Source) -> bool:
        """Whether it has a file of HDF5."""
        return bool(_files(source))

    def episodes(self, source: Source, options: ImportOptions) -> Iterator[SourceEpisode]:
        """The episodes of all its files.

        Raises:
            ConfigError: if none has any.
        """
        bindings = read_bindings(options.bindings)
        assets = Assets(source, options.assets)
        files, seeds = _files(source), _Seeds()
        for name in files:
            try:
                with hdf5.open_file(source, name) as root:
                    data = root.group("data")
                    task = options.task or _task(data)
                    names = [demo for demo in data.names() if "states" in data.group(demo)]
            except TraceError as error:
                yield refused(name, error)
                continue
            for demo in names:
                policy = options.policy or POLICY
                file = _File(source, name, assets, bindings, options)
                about = About(
                    task=task,
                    policy=policy,
                    seed=seeds.next(task, demo),
                    instruction=f"{_SPLIT.sub(' ', task)}.".capitalize(),
                    backend="robosuite",
                    origin={"source": source.path.name, "episode": f"{name}:{demo}"},
                )
                record = partial(_record, file, demo, about)
                yield SourceEpisode(f"{name}:{demo}", task, policy, about.seed, record)


class _Seeds:
    """Numbers that tell the episodes of a task apart, whatever files they are in."""

    def __init__(self) -> None:
        self._taken: set[tuple[str, int]] = set()

    def next(self, task: str, demo: str) -> int:
        """The episode's own number, or the next one that is free."""
        match = re.search(r"\d{1,9}$", demo)
        seed = int(match[0]) if match else 0
        while (task, seed) in self._taken:
            seed += 1
        self._taken.add((task, seed))
        return seed


@dataclass(frozen=True)
class _File:
    """A file of a source, and how it is read.

    Attributes:
        source: where it is.
        name: in it.
        assets: what its models may name.
        bindings: the user's.
        options: likewise.
    """

    source: Source
    name: str
    assets: Assets
    bindings: Bindings
    options: ImportOptions


def _files(source: Source) -> list[str]:
    return [name for name in source.names if name.endswith(hdf5.SUFFIXES)]


def _task(data: Group) -> str:
    """The task that a file names, as robosuite calls it now.

    Raises:
        TraceError: if it names none.
    """
    name = data.text("env") or str(_arguments(data).get("env_name", ""))
    if not name:
        raise TraceError("the file does not say which task it is of; name it with --task")
    return TASKS.get(name, name)


def _arguments(data: Group) -> Mapping[str, Any]:
    """What a file says of its environment (``env_args`` or ``env_info``, JSON)."""
    for name in ("env_args", "env_info"):
        if text := data.text(name):
            try:
                found = json.loads(text)
            except (ValueError, RecursionError) as error:
                raise TraceError(f"attribute {name} is not JSON ({error})") from error
            if not isinstance(found, dict):
                raise TraceError(f"attribute {name} is no JSON object")
            inner = found.get("env_kwargs")
            return {**found, **(inner if isinstance(inner, dict) else {})}
    return {}


def _record(file: _File, demo: str, about: About, progress: OnStep) -> Recording:
    """Import one episode."""
    with hdf5.open_file(file.source, file.name) as root:
        data = root.group("data")
        episode, facts = data.group(demo), _arguments(data)
        states, actions = episode.array("states"), _actions(episode)
        convention = _convention(data, facts, actions)
        success = _success(episode)
        xml, folder = _model_of(file, episode)
    mujoco.set_mju_user_warning(_ignore)
    model = compile_model(xml, file.assets, folder).compiled
    width = 1 + model.nq + model.nv
    if states.ndim != 2 or len(states) < 2 or states.shape[1] not in (width, width + model.na):
        raise TraceError(
            f"states: shape {states.shape}, expected (2 or more, {width}): are they of this model?"
        )
    for name, array in {"actions": actions, "rewards": success}.items():
        if array is not None and len(array) != len(states):
            raise TraceError(f"{name}: {len(array)}, and {len(states)} states")
    keep = np.append(np.diff(states[:, 0]) != 0, True)  # old recorders wrote some states twice
    times = states[keep, 0]
    if len(times) < 2:
        raise TraceError(f"states: all {len(states)} have the same time, {times[0]:g} s")
    period = _period(times, model.opt.timestep)
    layout = derive_layout(model, period, convention, file.bindings)
    given = States(
        times=times,
        qpos=states[keep, 1 : 1 + model.nq],
        qvel=states[keep, 1 + model.nq : width],
        actions=None if actions is None else actions[keep],
        success=None if success is None else success[keep],
    )
    says = "assumed, as of every demonstration" if success is None else "as the source says"
    about = dataclasses.replace(about, origin={**about.origin, "success": says})
    options = file.options
    builder = RecordingBuilder(
        model,
        layout,
        tail=options.tail,
        drift_limit=options.drift_limit,
        categories={thing.category for thing in layout.objects.values()},  # drafted if unknown
    )
    return builder.build(given, about, progress)


def _ignore(_message: str) -> None:
    """MuJoCo would write it to a file where the user happens to be; what matters is refused."""


def _period(times: NDArray[np.float64], step: float) -> float:
    """Control period, s: the usual time between states, or a longer one where they are many; in
    whole physics steps.
    """
    usual = round(max(float(np.median(np.diff(times))), PERIOD), 4)
    return round(max(1, round(usual / step)) * step, 9) if step > 0 else usual


def _actions(episode: Group) -> NDArray[np.float64] | None:
    """What was executed from each state on (T, A); None if the episode does not have it."""
    if "actions" in episode:
        return episode.array("actions")
    if "gripper_actuations" in episode and "joint_velocities" in episode:  # robosuite 0.x
        both = [episode.array(name) for name in ("joint_velocities", "gripper_actuations")]
        if all(array.ndim == 2 and len(array) == len(both[0]) for array in both):
            return np.concatenate(both, axis=1)
    return None


def _convention(
    data: Group, facts: Mapping[str, Any], actions: NDArray[np.float64] | None
) -> Convention:
    if actions is not None and (actions.ndim != 2 or not np.isfinite(actions).all()):
        raise TraceError(f"actions: shape {actions.shape}, expected finite numbers (any, any)")
    version = data.text("repository_version") or str(facts.get("env_version", ""))
    numbers = [int(number) for number in re.findall(r"\d{1,4}", version)[:2]]
    robots, old = facts.get("robots", ""), numbers[:1] == [0]
    names = [robots] if isinstance(robots, str) else robots
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise TraceError("the file's robots are no names")
    if old:
        names = re.findall("^(Sawyer|Baxter)", data.text("env"))
    limits = None
    if actions is not None:
        limits = tuple(np.maximum(1.0, np.abs(actions).max(axis=0, initial=0.0)).tolist())
    return Convention(
        robot=printable("+".join(names)) or "robot",
        limits=limits,
        grippers_last=numbers >= [1, 5],
        closes=0.0 if old else 1.0,  # 0.x: 0 is half way, which is as far as fingers go on a thing
    )


def _success(episode: Group) -> NDArray[np.bool_] | None:
    """Whether each state was a success, from sparse rewards (T,); None if there are none.

    ``rewards[i]`` is of the state after ``states[i]``; the last one counts for the last state too.
    """
    if "rewards" not in episode:
        return None
    rewards = episode.array("rewards")
    if rewards.ndim != 1 or len(rewards) == 0 or not np.isin(rewards, (0.0, 1.0)).all():
        return None
    success = np.append(False, rewards[:-1] > 0)
    success[-1] |= rewards[-1] > 0
    return success


def _model_of(file: _File, episode: Group) -> tuple[str, str]:
    """The XML of an episode's model, and the folder that it is in."""
    text, folder = episode.text("model_file"), posixpath.dirname(file.name)
    if not text:
        raise TraceError(f"{episode.path} has no model_file: without its model states say nothing")
    if text.lstrip().startswith("<"):
        return text, folder
    folder = posixpath.join(folder, "models")
    content = file.source.read(posixpath.join(folder, text), MOST_XML)
    return content.decode(errors="replace"), folder
