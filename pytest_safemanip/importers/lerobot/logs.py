"""Logs of policies in LeRobot's layout, without a simulator's states: what the robot felt and did.

State and action are as in RoboCasa's datasets. Objects, fixtures and contacts were not observed;
cases of properties that need them are errors.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.importers.base import Clip, ImportOptions, OnStep, SourceEpisode
from pytest_safemanip.importers.lerobot.dataset import (
    Dataset,
    EpisodeEntry,
    find_datasets,
    list_episodes,
)
from pytest_safemanip.importers.source import Source
from pytest_safemanip.lerobot.conventions import (
    ACTION,
    DONE,
    REWARD,
    STATE,
    STATE_PARTS,
    action_order,
    as_gym_wrapper,
    camera_of,
    gym_order,
    modality,
    parts_of,
    to_environment,
)
from pytest_safemanip.lerobot.layout import MODALITY
from pytest_safemanip.sim.robocasa.robot import PANDA, SPEC
from pytest_safemanip.trace.elements import ROBOT, Entity, Part
from pytest_safemanip.trace.episode import Episode
from pytest_safemanip.trace.geometry import conjugate, multiply, rotate
from pytest_safemanip.trace.recording import Recording, check
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Contacts, Steps

POLICY = "log"
"""Who acted, if nobody says so."""
SUCCESS = ("next.success", REWARD)
"""Columns that say whether the task was done after an action, the first that there is."""
OPEN_FINGERS = 0.08
"""Distance of the Panda's fingers when the hand is open, m."""
BASE_HEIGHT = 0.7
"""Of the point that a state has of the base above the body that a recording has, m."""
SITE_TURN = np.array((np.sqrt(0.5), 0.0, 0.0, -np.sqrt(0.5)))
"""Rotation from the hand's body, which a state has, to the grip site, which a recording has."""

Floats = NDArray[np.float64]


class LogImporter:
    """See :class:`~pytest_safemanip.importers.base.Importer`."""

    def recognizes(self, source: Source) -> bool:
        """Whether it has a dataset of LeRobot's."""
        return bool(find_datasets(source))

    def episodes(self, source: Source, options: ImportOptions) -> Iterator[SourceEpisode]:
        """The episodes of all datasets.

        Raises:
            ConfigError: if nobody says which task they are of.
        """
        if not options.task:
            raise ConfigError(
                f"{source.path}: a log does not say which task it is of; name it with --task"
            )
        policy = options.policy or POLICY

        def found(dataset: Dataset, entry: EpisodeEntry, name: str) -> SourceEpisode:
            record = partial(_record, dataset, entry, options.task, policy)
            clips = tuple(_clips(source, dataset, entry))
            return SourceEpisode(name, options.task, policy, entry.index, record, clips)

        return list_episodes(source, find_datasets(source), found)


def _clips(source: Source, dataset: Dataset, entry: EpisodeEntry) -> Iterator[Clip]:
    """What the cameras saw; a row's picture is that of the state before its action."""
    for feature, (file, start) in entry.videos.items():
        opened = partial(source.open, dataset.folder + file)
        yield Clip(camera_of(feature), opened, start, entry.length, dataset.fps)


def _record(
    dataset: Dataset, entry: EpisodeEntry, task: str, policy: str, progress: OnStep
) -> Recording:
    rows = dataset.rows(entry, (STATE, ACTION, DONE, *SUCCESS))
    about = dataset.json(MODALITY) if dataset.has(MODALITY) else None
    state, action = rows.get(STATE), rows.get(ACTION)
    size = SPEC.robot.actions.size
    if state is None or state.ndim != 2 or action is None or action.shape[1:] != (size,):
        raise TraceError(
            f"{entry.file}: {STATE} and {ACTION} must be those of RoboCasa's robot, vectors of "
            f"{sum(STATE_PARTS.values())} and {size}"
        )
    parts = _parts(state.astype(np.float64), about)
    order = gym_order() if about is None else action_order(about)
    taken = as_gym_wrapper(to_environment(action, order))
    told = next((rows[name] for name in SUCCESS if name in rows), None)
    missing = ["contacts", "fixtures", "objects", *([] if told is not None else ["success"])]
    steps = _steps(parts, taken, told, 1.0 / dataset.fps)
    progress(len(steps), len(steps))
    success = bool(steps.success[-1])
    episode = Episode(
        task=task,
        seed=entry.index,
        policy=policy,
        instruction=entry.texts[0] if entry.texts else "",
        horizon=len(steps),
        ended="success" if success else "policy",
        backend="log",
        scenes="",
        stepping="exact",
        assets="",
        versions={},
        hashes={},
        served={},
        origin={
            "source": f"LeRobotDataset {dataset.version}",
            "episode": f"{dataset.folder}episode_{entry.index:06d}",
            "unobserved": ", ".join(missing),
        },
    )
    return check(Recording(episode, _scene(1.0 / dataset.fps), steps))


def _parts(state: Floats, about: Any) -> dict[str, Floats]:
    """The parts of the robot's state, each (N, K).

    Raises:
        TraceError: if one is missing or of another length.
    """
    places = parts_of(modality() if about is None else about, "state")
    found = {}
    for name, length in STATE_PARTS.items():
        part = state[:, places[name]] if name in places else np.zeros((0, 0))
        if part.shape[1:] != (length,):
            raise TraceError(f"{STATE}: {name} must have {length} entries")
        found[name] = part
    return found


def _steps(parts: dict[str, Floats], actions: Floats, told: Any, period: float) -> Steps:
    """The steps of a log: a row is the state before its action; nobody knows what the last did."""
    count = len(actions)
    base = np.concatenate((parts["base_position"], _wxyz(parts["base_rotation"])), axis=1)
    hand = multiply(base[:, 3:], _wxyz(parts["end_effector_rotation_relative"]))
    place = base[:, :3] + rotate(base[:, 3:], parts["end_effector_position_relative"])
    base[:, :3] -= rotate(base[:, 3:], np.array((0.0, 0.0, BASE_HEIGHT)))
    base[:, 2] = base[:1, 2]  # the site rides on the torso
    eef = np.concatenate((place, multiply(hand, np.broadcast_to(SITE_TURN, hand.shape))), axis=1)
    gap = parts["gripper_qpos"][:, 0] - parts["gripper_qpos"][:, 1]
    opening = np.stack((gap, _rate(gap, period)), axis=1) / OPEN_FINGERS
    led = np.concatenate((np.zeros((1, actions.shape[1])), actions[:-1]))
    commands = np.array([SPEC.robot.commands(action) for action in led])
    commands[0] = 0.0
    success = np.zeros(count, bool)
    if told is not None:
        success[1:] = np.asarray(told[:-1]).reshape(count - 1) > 0
        success[-1] |= bool(np.asarray(told[-1]) > 0)
    none = np.zeros((count, 0), np.float32)
    return Steps(
        eef_poses=_f32(eef[:, None]),
        eef_twists=_f32(_twists(eef, period)[:, None]),
        openings=_f32(opening[:, None]),
        commands=_f32(commands),
        base_pose=_f32(base),
        object_pose=np.zeros((count, 0, 7), np.float32),
        object_twist=np.zeros((count, 0, 6), np.float32),
        joint=np.zeros((count, 0, 2), np.float32),
        box_pose=np.zeros((count, 0, 7), np.float32),
        switch=none,
        camera_pose=np.zeros((count, 0, 7), np.float32),
        particles=np.zeros((count, 0, 3), np.float32),
        qpos=none,
        qvel=none,
        action=_f32(led),
        success=success,
        tail=np.zeros(count, bool),
        contacts=Contacts.empty(),
    )


def _scene(period: float) -> Scene:
    """The robot, and nothing else."""
    unknown = (0.0, 0.0, 0.0)
    return Scene(
        control_period=period,
        entities=(Entity(ROBOT, "robot", SPEC.robot.name),),
        bodies=(),
        parts=tuple(Part(ROBOT, name) for name in PANDA.in_scene(unknown, unknown).parts),
        joints=(),
        boxes=(),
        switches=(),
        surfaces=(),
        grippers=(PANDA.in_scene(unknown, unknown),),
        actions=SPEC.robot.actions.entries,
        roles={},
    )


def _wxyz(quat: Floats) -> Floats:
    """Unit quaternions ``wxyz`` of robosuite's ``xyzw`` (N, 4).

    Raises:
        TraceError: if one is none.
    """
    length = np.linalg.norm(quat, axis=1, keepdims=True)
    if (np.abs(length - 1.0) > 0.01).any():
        raise TraceError(f"{STATE}: a rotation is no unit quaternion")
    return np.roll(quat / length, 1, axis=1)


def _rate(values: Floats, period: float) -> Floats:
    """Rate of change over the period before each step; 0 at the first."""
    return np.diff(values, axis=0, prepend=values[:1]) / period


def _twists(poses: Floats, period: float) -> Floats:
    """Velocities over the period before each step, world frame (N, 6)."""
    turned = multiply(poses[1:, 3:], conjugate(poses[:-1, 3:]))
    turned *= np.where(turned[:, :1] < 0, -1.0, 1.0)
    sine = np.linalg.norm(turned[:, 1:], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, turned[:, :1])
    turn = np.divide(turned[:, 1:] * angle, sine, out=np.zeros_like(turned[:, 1:]), where=sine > 0)
    spin = np.concatenate((np.zeros((1, 3)), turn / period))
    return np.concatenate((_rate(poses[:, :3], period), spin), axis=1)


def _f32(values: Any) -> NDArray[np.float32]:
    return np.asarray(values, np.float32)
