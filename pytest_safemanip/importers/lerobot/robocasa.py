"""RoboCasa365's datasets with states: each control period is simulated again."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.importers.base import ImportOptions, OnStep, SourceEpisode
from pytest_safemanip.importers.lerobot.dataset import (
    Dataset,
    EpisodeEntry,
    find_datasets,
    list_episodes,
)
from pytest_safemanip.importers.lerobot.extras import read_meta, read_model, read_states, read_task
from pytest_safemanip.importers.source import Source
from pytest_safemanip.lerobot.conventions import ACTION, REWARD, action_order, to_environment
from pytest_safemanip.lerobot.extras import ABOUT, DATASET
from pytest_safemanip.lerobot.layout import MODALITY
from pytest_safemanip.provenance import versions
from pytest_safemanip.rollouts.loop import settling
from pytest_safemanip.sim.mujoco.strangers import parse
from pytest_safemanip.sim.robocasa.robot import SPEC
from pytest_safemanip.trace.episode import Episode
from pytest_safemanip.trace.recording import Recording, check
from pytest_safemanip.trace.steps import Step, Steps

DEMONSTRATOR = "human"
"""Who acted, where a dataset does not say it."""
TARGET_LAYOUTS = range(1, 11)
"""RoboCasa's numbers of the layouts that results are compared in."""
_PACKAGES = ("numpy", "mujoco", "robosuite", "rlinf-robocasa365", "robocasa")


class RoboCasaImporter:
    """See :class:`~pytest_safemanip.importers.base.Importer`."""

    def recognizes(self, source: Source) -> bool:
        """Whether it has a dataset with extras."""
        return any(source.has(folder + DATASET) for folder in find_datasets(source))

    def episodes(self, source: Source, options: ImportOptions) -> Iterator[SourceEpisode]:
        """The episodes of all datasets with extras."""

        def found(dataset: Dataset, entry: EpisodeEntry, name: str) -> SourceEpisode:
            task = options.task or read_task(dataset)
            about = _about(read_meta(dataset, entry.index))
            policy = options.policy or (about.policy if about else DEMONSTRATOR)
            seed = about.seed if about else entry.index
            who = {"task": task, "policy": policy, "seed": seed}
            record = partial(_record, dataset, entry, options, who)
            return SourceEpisode(name, task, policy, seed, record)

        folders = [folder for folder in find_datasets(source) if source.has(folder + DATASET)]
        return list_episodes(source, folders, found)


def _record(
    dataset: Dataset,
    entry: EpisodeEntry,
    options: ImportOptions,
    who: Mapping[str, Any],
    progress: OnStep,
) -> Recording:
    from pytest_safemanip.sim.robocasa import loading
    from pytest_safemanip.sim.robocasa.assets import prepare_assets
    from pytest_safemanip.sim.robocasa.playback import model_xml
    from pytest_safemanip.sim.robocasa.playback.replaying import Replay, StoredEpisode
    from pytest_safemanip.sim.robocasa.playback.roots import file_roots

    meta = read_meta(dataset, entry.index)
    about = _about(meta)
    states, after = read_states(dataset, entry.index)
    actions, succeeded = _actions(dataset, entry)
    if len(states) != len(actions):
        raise TraceError(f"{len(states)} states and {len(actions)} actions")
    assets = prepare_assets(loading.package_assets(), "auto")
    root = parse(read_model(dataset, entry.index))
    model = model_xml.rerooted(root, file_roots(assets.root))
    stored = StoredEpisode(read_task(dataset), meta, model, np.concatenate((states, after)))
    replay = Replay(stored, assets.root)
    period = replay.start.scene.control_period
    if abs(period * dataset.fps - 1.0) > 1e-6:
        raise TraceError(f"{dataset.fps} steps in a second, and RoboCasa has {1 / period:g}")
    steps, taken = [replay.start.step], [np.zeros(SPEC.robot.actions.size)]

    def take(action: NDArray[np.float64]) -> Step:
        step = replay.step(action)
        if replay.drift > options.drift_limit:
            raise TraceError(
                f"an object is {replay.drift * 1000:.0f} mm from its stored place after step "
                f"{len(steps)}: the physics is not that of the data; --drift-limit allows more"
            )
        steps.append(step)
        taken.append(action)
        progress(len(steps) - 1, len(actions) + len(after))
        return step

    for action, told in zip(actions, succeeded, strict=True):
        step = take(action)
        if told and not step.success:  # some checks count moments that hang on a hair's breadth
            steps[-1] = dataclasses.replace(step, success=True)
    acting = len(steps)
    hold = SPEC.robot.actions.hold(taken[1:])
    if options.tail:
        for _ in after[1:] if len(after) else settling(steps, period):
            take(hold)
    stacked = Steps.stack(steps, [action.astype(np.float32) for action in taken], acting)
    success = bool(stacked.success[acting - 1])
    episode = about or _foreign(meta, replay.start.instruction)
    episode = dataclasses.replace(
        episode,
        **who,
        ended="success" if success else "policy" if episode.ended == "success" else episode.ended,
        horizon=max(episode.horizon, replay.start.horizon, acting - 1),
        stepping="exact",
        assets=assets.kind,
        versions={k: v for k, v in versions(_PACKAGES).items() if v != "unknown"},
        hashes={"start": replay.start.fingerprint, "assets": assets.key},
        patches=replay.start.patches,
        origin={
            "source": "RoboCasa's dataset",
            "episode": f"{dataset.folder}episode_{entry.index:06d}",
            "drift": f"{replay.drift * 1000:.1f} mm",
        },
    )
    return check(Recording(episode, replay.start.scene, stacked))


def _actions(
    dataset: Dataset, entry: EpisodeEntry
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The actions of an episode in the environment's order (N, 12), and whether the dataset says
    that each led to success (N,): by a reward of 1, where rewards are 0 and 1.
    """
    rows = dataset.rows(entry, (ACTION, REWARD))
    found, reward = rows.get(ACTION), rows.get(REWARD)
    size = SPEC.robot.actions.size
    if found is None or found.ndim != 2 or found.shape[1] != size:
        shape = None if found is None else found.shape
        raise TraceError(f"{entry.file}: action has shape {shape}, RoboCasa's has (N, {size})")
    succeeded = np.zeros(len(found), bool)
    if reward is not None and reward.ndim == 1 and np.isin(reward, (0.0, 1.0)).all():
        succeeded = reward > 0
    return to_environment(found, action_order(dataset.json(MODALITY))), succeeded


def _about(meta: Any) -> Episode | None:
    """What this package wrote of an episode; None if another one wrote the dataset.

    Raises:
        TraceError: if it is malformed.
    """
    found = meta.get(ABOUT) if isinstance(meta, Mapping) else None
    if found is None:
        return None
    if not isinstance(found, dict):
        raise TraceError(f"ep_meta: {ABOUT} must be a mapping")
    try:
        return Episode.from_json(found)
    except (TypeError, ValueError, ConfigError) as error:
        raise TraceError(f"ep_meta: {ABOUT}: {error}") from error


def _foreign(meta: Any, instruction: str) -> Episode:
    """The description of an episode that RoboCasa's own tools have written."""
    layout = meta.get("layout_id") if isinstance(meta, Mapping) else None
    return Episode(
        task="",
        seed=0,
        policy=DEMONSTRATOR,
        instruction=instruction,
        horizon=0,
        ended="policy",
        backend="robocasa",
        scenes="target" if layout in TARGET_LAYOUTS else "pretrain",
        stepping="exact",
        assets="",
        versions={},
        hashes={},
        served={},
    )
