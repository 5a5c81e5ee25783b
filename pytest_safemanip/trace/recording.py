"""A recording: one rollout, whole, and everything a verdict may depend on."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from pytest_safemanip.errors import TraceError
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import ARRAYS, Steps, Trace, array_shapes

POLICY_NAME = re.compile(r"[\w.:/@=+-]{1,200}")
"""What a policy may be called: its name is part of node ids and file names."""

UNIT_TOLERANCE = 1e-3
"""How far a stored quaternion's norm may be from one (float32 keeps it within 1e-6)."""


@dataclass(frozen=True)
class Episode:
    """What was run.

    Attributes:
        task: name of the task.
        seed: of the environment and of the policy.
        policy: as the user named it.
        instruction: the task's instruction in this episode.
        horizon: control steps after which the rollout ends without success.
        ended: why the acting part ended.
        backend: name of the simulator backend.
        scenes: which family of scenes.
        assets: which assets: ``official``, ``primitive`` or ``mixed``.
        versions: package name to version, of everything that moves the physics.
        hashes: digest of the backend's and policy's code, of the assets and of the start state.
    """

    task: str
    seed: int
    policy: str
    instruction: str
    horizon: int
    ended: Literal["success", "horizon"]
    backend: str
    scenes: str
    assets: str
    versions: Mapping[str, str]
    hashes: Mapping[str, str]

    def to_json(self) -> dict[str, Any]:
        """Plain builtins, for the recording's header."""
        return dataclasses.asdict(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Episode:
        """The inverse of :meth:`to_json`.

        Raises:
            TraceError: if a field is missing, unknown or of the wrong type.
        """
        try:
            episode = cls(**data)
        except TypeError as error:
            raise TraceError(f"episode: malformed description ({error})") from error
        for field in ("task", "policy", "instruction", "ended", "backend", "scenes", "assets"):
            if not isinstance(getattr(episode, field), str):
                raise TraceError(f"episode: {field} must be a string")
        for field in ("seed", "horizon"):
            if not isinstance(getattr(episode, field), int):
                raise TraceError(f"episode: {field} must be an integer")
        if not POLICY_NAME.fullmatch(episode.policy):
            raise TraceError(f"episode: {episode.policy!r} is no name of a policy")
        return episode


@dataclass(frozen=True)
class Recording:
    """A complete rollout. Everything that judges it is a pure function of it."""

    episode: Episode
    scene: Scene
    steps: Steps

    @property
    def success(self) -> bool:
        """Whether the task's own check held at the end of the acting part."""
        return bool(self.steps.success[self.acting - 1])

    @property
    def acting(self) -> int:
        """Number of steps before the settle tail."""
        return int(np.count_nonzero(~self.steps.tail))

    @cached_property
    def trace(self) -> Trace:
        """What propositions are evaluated on."""
        return Trace(self.scene, self.steps)


def check(recording: Recording) -> Recording:
    """This recording, after checking that it is possible at all.

    Raises:
        TraceError: naming the field, the step and the entity of the first impossible value.
    """
    scene, steps = recording.scene, recording.steps
    length = len(steps)
    if length == 0:
        raise TraceError("recording: no step")
    for name, shape in {**array_shapes(scene), "action": (-1,)}.items():
        array = getattr(steps, name)
        wanted = (length, *shape)
        fits = array.ndim == len(wanted) and all(
            want in (-1, got) for want, got in zip(wanted, array.shape, strict=True)
        )
        if not fits:
            raise TraceError(f"{name}: shape {array.shape}, expected {wanted}")
        bad = ~np.isfinite(array)
        if bad.any():
            raise TraceError(f"{name}: not finite at {_place(scene, name, np.argwhere(bad)[0])}")
    for name in ("eef_pose", "base_pose", "object_pose", "box_pose"):
        _check_unit(scene, name, getattr(steps, name)[..., 3:])
    if steps.tail[0] or (np.diff(steps.tail.astype(int)) < 0).any():
        raise TraceError("tail: must be a suffix and not the whole recording")
    _check_contacts(recording)
    return recording


def _check_unit(scene: Scene, name: str, quaternions: Any) -> None:
    bad = np.abs(np.linalg.norm(quaternions, axis=-1) - 1.0) > UNIT_TOLERANCE
    if bad.any():
        place = _place(scene, name, np.argwhere(bad)[0])
        raise TraceError(f"{name}: not a unit quaternion at {place}")


def _check_contacts(recording: Recording) -> None:
    contacts, parts, length = recording.steps.contacts, recording.scene.parts, len(recording.steps)
    if len(contacts) == 0:
        return
    for name in ("force", "peak", "position", "normal"):
        bad = ~np.isfinite(getattr(contacts, name)).reshape(len(contacts), -1).all(axis=1)
        if bad.any():
            raise TraceError(f"contacts: {name} not finite at step {contacts.step[bad][0]}")
    if (contacts.force < 0).any() or (contacts.peak < 0).any():
        raise TraceError("contacts: a normal force is negative")
    if (np.diff(contacts.step) < 0).any() or contacts.step[0] < 0 or contacts.step[-1] >= length:
        raise TraceError("contacts: steps must be sorted and lie within the recording")
    for side in (contacts.a, contacts.b):
        if side.min() < 0 or side.max() >= len(parts):
            raise TraceError("contacts: a part is not in the scene's list of parts")


def _place(scene: Scene, name: str, index: Any) -> str:
    step = f"step {int(index[0])}"
    if len(index) < 2:
        return step
    owners = {
        "object_pose": [b.entity for b in scene.bodies],
        "object_twist": [b.entity for b in scene.bodies],
        "joint": [j.key for j in scene.joints],
        "box_pose": [f"{b.entity}/{b.name}" for b in scene.boxes],
    }.get(name)
    return f"{step} of {owners[int(index[1])]!r}" if owners else step


__all__ = ["ARRAYS", "Episode", "Recording", "check"]
