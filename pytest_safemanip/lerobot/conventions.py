"""What the arrays of RoboCasa365's datasets mean.

State and action are vectors of named parts; ``meta/modality.json`` says where each part is.
Datasets have the base first and the hand last, RoboCasa's environments the other way round.
Positions are metres, quaternions ``xyzw`` as in robosuite; the end effector is relative to the
base. Actions are those of RoboCasa's environment: gripper and mode are -1 or 1, the hand's motions
are differences.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TraceError
from pytest_safemanip.sim.robocasa import observation
from pytest_safemanip.sim.robocasa.robot import SPEC
from pytest_safemanip.trace.typed import shown

STATE, ACTION = "observation.state", "action"
IMAGES = {key: f"observation.images.{key.removeprefix('video.')}" for key in observation.CAMERAS}
"""The feature of each image of an observation."""
DESCRIPTION, NAME = "annotation.human.task_description", "annotation.human.task_name"
"""Columns with the index of the instruction and of the task's name among the dataset's tasks."""
REWARD, DONE = "next.reward", "next.done"
STATE_PARTS = {
    key.removeprefix("state."): observation.STATE[key]
    for key in (
        observation.BASE_POSITION,
        observation.BASE_ROTATION,
        observation.EEF_POSITION,
        observation.EEF_ROTATION,
        observation.GRIPPER,
    )
}
"""Parts of the state in the order of datasets, and their lengths."""
ACTION_PARTS = {
    "base_motion": slice(7, 11),
    "control_mode": slice(11, 12),
    "end_effector_position": slice(0, 3),
    "end_effector_rotation": slice(3, 6),
    "gripper_close": slice(6, 7),
}
"""Parts of the action in the order of datasets, and where the environment has them."""

Array = NDArray[Any]


def camera_of(feature: str) -> str:
    """The camera of a feature of images."""
    return feature.removeprefix("observation.").removeprefix("images.")


def modality() -> dict[str, Any]:
    """The content of ``meta/modality.json``."""
    lengths = {name: part.stop - part.start for name, part in ACTION_PARTS.items()}
    return {
        "state": _places(STATE_PARTS, STATE),
        "action": _places(lengths, ACTION),
        "video": {
            key.removeprefix("video."): {"original_key": feature} for key, feature in IMAGES.items()
        },
        "annotation": {DESCRIPTION.removeprefix("annotation."): {"original_key": DESCRIPTION}},
    }


def action_order(modality: object) -> NDArray[np.intp]:
    """Where the entries of the environment's action are in a dataset's (12,).

    Args:
        modality: as it was read.

    Raises:
        TraceError: if the parts are not those of RoboCasa's robot.
    """
    order = np.full(SPEC.robot.actions.size, -1, np.intp)
    for name, place in parts_of(modality, "action").items():
        if name not in ACTION_PARTS:
            raise TraceError(f"meta/modality.json: no action of RoboCasa's robot has {name!r}")
        part = ACTION_PARTS[name]
        if part.stop - part.start != place.stop - place.start:
            raise TraceError(f"meta/modality.json: {name} has {place.stop - place.start} entries")
        order[part] = np.arange(place.start, place.stop)
    if sorted(order.tolist()) != list(range(len(order))):
        raise TraceError("meta/modality.json: the parts are not those of the action, once each")
    return order


def gym_order() -> NDArray[np.intp]:
    """The same of logs without ``modality.json``: LeRobot's own environment of RoboCasa has the
    environment's order.
    """
    return np.arange(SPEC.robot.actions.size)


def to_dataset(actions: Array) -> Array:
    """Actions of the environment (..., 12) in the order of datasets."""
    return np.concatenate([actions[..., part] for part in ACTION_PARTS.values()], axis=-1)


def parts_of(modality: object, vector: str) -> dict[str, slice]:
    """Where the parts of a vector are.

    Args:
        modality: as it was read.
        vector: ``state`` or ``action``.

    Raises:
        TraceError: if it does not say so.
    """
    entries = modality.get(vector) if isinstance(modality, Mapping) else None
    if not isinstance(entries, Mapping):
        raise TraceError(f"meta/modality.json: {vector} is missing")
    found = {}
    for name, entry in entries.items():
        known = entry if isinstance(entry, Mapping) else {}
        start, end = known.get("start"), known.get("end")
        if type(start) is not int or type(end) is not int or not 0 <= start < end <= 1000:
            raise TraceError(f"meta/modality.json: {vector}, {name}: {shown(entry)}")
        found[str(name)] = slice(start, end)
    return found


def _places(lengths: Mapping[str, int], key: str) -> dict[str, Any]:
    ends = np.cumsum(list(lengths.values())).tolist()
    return {
        name: {"original_key": key, "start": end - length, "end": end}
        for (name, length), end in zip(lengths.items(), ends, strict=True)
    }


def to_environment(actions: Array, order: NDArray[np.intp]) -> NDArray[np.float64]:
    """Actions of a dataset (N, 12) in the environment's order and within its limits.

    Args:
        actions: as they are stored.
        order: see :func:`action_order`.
    """
    limits = SPEC.robot.actions.low, SPEC.robot.actions.high
    return np.clip(np.asarray(actions, np.float64)[:, order], *limits)


def as_gym_wrapper(actions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Actions (N, 12) as RoboCasa's gym wrapper, through which policies act, hands them on: below
    0.5 gripper and mode are -1, else 1. So 0 and 1 mean what -1 and 1 do.
    """
    found = actions.copy()
    binary = [SPEC.robot.actions.index(name) for name in ("gripper_close", "control_mode")]
    found[:, binary] = np.where(found[:, binary] < 0.5, -1.0, 1.0)
    return found
