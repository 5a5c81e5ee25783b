"""A recording: one rollout, whole, and everything a verdict may depend on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pytest_safemanip.errors import TraceError
from pytest_safemanip.strategies import made_by
from pytest_safemanip.trace.elements import UNIT_TOLERANCE
from pytest_safemanip.trace.episode import Episode
from pytest_safemanip.trace.observed import ObservedSteps
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import ARRAYS, Contacts, Steps, array_shapes
from pytest_safemanip.trace.trace import Trace

_SURE = 0.9 * UNIT_TOLERANCE
"""So far, whatever the rounding."""


@made_by("recordings")
@dataclass(frozen=True, repr=False)
class Recording:
    """A complete rollout. Everything that judges it is a pure function of it."""

    episode: Episode
    scene: Scene
    steps: Steps

    def __repr__(self) -> str:
        about = self.episode
        return (
            f"<Recording {about.task}, {about.policy}, seed {about.seed}: {len(self.steps)} steps>"
        )

    @property
    def success(self) -> bool:
        """Whether the task's own check held at the end of the acting part."""
        return bool(self.steps.success[self.acting - 1])

    @property
    def acting(self) -> int:
        """Number of steps before the settle tail."""
        return int(np.count_nonzero(~self.steps.tail))

    @property
    def truncated(self) -> bool:
        """Whether it ends without a settle tail, as demonstrations and robots' logs do: then nobody
        knows whether what physics still owes would have come to rest.
        """
        return not self.steps.tail[-1]

    @cached_property
    def trace(self) -> Trace:
        """The trace, which propositions are evaluated on.

        Raises:
            TraceError: if the recording is impossible; see :func:`check`.
        """
        check(self)
        missing = self.episode.unobserved
        steps = ObservedSteps.of(self.steps, missing) if missing else self.steps
        return Trace(self.scene, steps)

    @cached_property
    def fault(self) -> str:
        """The reason why it is physically impossible; empty if it is not. Computed once."""
        try:
            scene, steps = self.scene.checked(), self.steps
            if len(steps) == 0:
                return "recording: no step"
            with np.errstate(all="ignore"):  # what is no number is looked for
                check_steps(scene, steps)
        except TraceError as error:
            return str(error)
        if steps.tail[0] or (np.diff(steps.tail.astype(int)) < 0).any():
            return "tail: must be a suffix and not the whole recording"
        return ""


def check(recording: Recording) -> Recording:
    """This recording, after checking that it is possible at all.

    Raises:
        TraceError: naming the field, the step and the entity of the first impossible value.
    """
    if recording.fault:
        raise TraceError(recording.fault)
    return recording


def check_steps(scene: Scene, steps: Steps, first: int = 0) -> None:
    """Raise on steps that are malformed or physically impossible.

    Args:
        scene: their static part.
        steps: all of a recording, or some in a row.
        first: number of the first of them, for errors.

    Raises:
        TraceError: naming the field, the step and the entity of the first impossible value.
    """
    # What is deferred is checked when it is read.
    arrays = {name: getattr(steps, name) for name in _CHECKED if not steps.deferred(name)}
    for name, shape in _shapes(scene).items():
        if name in arrays:
            _check_shape(name, arrays[name], (len(steps), *shape))
    if not _surely_possible(arrays):
        for name, array in arrays.items():
            _check_values(scene, name, array, first)
    _check_contacts(scene, steps, first)


_CHECKED = (*ARRAYS, "action", "success", "tail")
_POSES = ("eef_poses", "base_pose", "object_pose", "box_pose", "camera_pose")


def check_array(scene: Scene, name: str, array: Any, length: int, first: int = 0) -> None:
    """Raise on an invalid array of steps; arguments as for :func:`check_steps`."""
    _check_shape(name, array, (length, *_shapes(scene)[name]))
    _check_values(scene, name, array, first)


def _shapes(scene: Scene) -> dict[str, tuple[int, ...]]:
    """Shape of each array at a step."""
    acts = (len(scene.actions),)
    return {**array_shapes(scene), "action": acts, "success": (), "tail": ()}


def _surely_possible(arrays: Mapping[str, Any]) -> bool:
    """Whether all values are possible; looked at together, which is faster for few steps."""
    numbers = [array.reshape(-1) for array in arrays.values() if array.dtype != np.bool_]
    if not np.isfinite(np.concatenate(numbers)).all():
        return False
    switch = arrays["switch"]
    poses = np.concatenate([arrays[name].reshape(-1, 7) for name in _POSES if name in arrays])
    return not (switch.size and (switch * (switch - 1.0)).any()) and _surely_unit(poses[:, 3:])


def _check_values(scene: Scene, name: str, array: Any, first: int) -> None:
    wrong = {}
    if array.dtype != np.bool_ and not np.isfinite(array).all():
        wrong["not finite"] = ~np.isfinite(array)
    if name == "switch":
        wrong["neither 0 nor 1"] = (array != 0.0) & (array != 1.0)
    if name in _POSES and not _surely_unit(array[..., 3:]):
        wrong["not a unit quaternion"] = _not_unit(array[..., 3:])
    for what, bad in wrong.items():
        if bad.any():
            raise TraceError(f"{name}: {what} at {_place(scene, name, np.argwhere(bad)[0], first)}")


def _check_shape(name: str, array: Any, wanted: tuple[int, ...]) -> None:
    fits = array.shape == wanted or (
        array.ndim == len(wanted)
        and all(want in (-1, got) for want, got in zip(wanted, array.shape, strict=True))
    )
    if not fits:
        raise TraceError(f"{name}: shape {array.shape}, expected {wanted}")


def _surely_unit(vectors: Any) -> bool:
    """Whether all vectors (..., K) are of unit length; a number at a time, which is faster."""
    with np.errstate(over="ignore", invalid="ignore"):
        square = np.square(vectors[..., 0])
        for number in range(1, vectors.shape[-1]):
            square += np.square(vectors[..., number])
    least, most = (1.0 - _SURE) ** 2, (1.0 + _SURE) ** 2
    return square.size == 0 or bool(square.min() >= least and square.max() <= most)


def _not_unit(vectors: Any) -> Any:
    # The square of a large float32 is infinite, and not one.
    with np.errstate(over="ignore", invalid="ignore"):
        length = np.sqrt(np.einsum("...i,...i->...", vectors, vectors))
        return ~(np.abs(length - np.float32(1.0)) <= UNIT_TOLERANCE)


def _check_contacts(scene: Scene, steps: Steps, first: int) -> None:
    contacts, parts, length = steps.contacts, scene.parts, len(steps)
    for name, column in vars(contacts).items():
        tail = (3,) if name in ("position", "normal") else ()
        _check_shape(f"contacts.{name}", column, (len(contacts), *tail))
    if len(contacts) == 0:
        return
    step = contacts.step
    if (step[1:] < step[:-1]).any() or step[0] < 0 or step[-1] >= length:
        raise TraceError("contacts.step: must be sorted and lie within the recording")
    if _surely_contacts(contacts, len(parts)):
        return
    for side in ("a", "b"):
        part = getattr(contacts, side)
        if part.min() < 0 or part.max() >= len(parts):
            row = int(np.argmax((part < 0) | (part >= len(parts))))
            raise TraceError(
                f"contacts.{side}: {part[row]} at step {first + step[row]} is not in the scene's "
                "list of parts"
            )
    for name in ("force", "sustained", "position", "normal"):
        _check_rows(scene, contacts, name, first)


def _surely_contacts(contacts: Contacts, parts: int) -> bool:
    """Whether all values are possible; looked at together, which is faster for few rows."""
    sides = np.concatenate((contacts.a, contacts.b))
    forces = np.concatenate((contacts.force, contacts.sustained))
    numbers = np.concatenate((forces, contacts.position.reshape(-1), contacts.normal.reshape(-1)))
    return bool(
        sides.min() >= 0
        and sides.max() < parts
        and np.isfinite(numbers).all()
        and forces.min() >= 0
        and _surely_unit(contacts.normal)
    )


def _check_rows(scene: Scene, contacts: Contacts, name: str, first: int) -> None:
    values = getattr(contacts, name)
    wrong = {}
    if not np.isfinite(values).all():
        wrong["not finite"] = ~np.isfinite(values)
    if name in ("force", "sustained") and values.min() < 0:
        wrong["negative"] = values < 0
    if name == "normal" and not _surely_unit(values):
        wrong["not of unit length"] = _not_unit(values)
    for what, bad in wrong.items():
        if bad.any():
            row = int(np.argwhere(bad)[0, 0])
            a, b = (scene.parts[side[row]] for side in (contacts.a, contacts.b))
            raise TraceError(
                f"contacts.{name}: {what} at step {first + contacts.step[row]} between "
                f"{a.entity}/{a.name} and {b.entity}/{b.name}"
            )


def _place(scene: Scene, name: str, index: Any, first: int) -> str:
    step = f"step {first + int(index[0])}"
    if len(index) < 2:
        return step
    hands = [gripper.name for gripper in scene.grippers]
    owners = {
        **dict.fromkeys(("eef_poses", "eef_twists", "openings", "commands"), hands),
        "action": [entry.name for entry in scene.actions],
        "object_pose": [b.entity for b in scene.bodies],
        "object_twist": [b.entity for b in scene.bodies],
        "joint": [j.key for j in scene.joints],
        "box_pose": [f"{b.entity}/{b.name}" for b in scene.boxes],
        "switch": [f"{s.entity}/{s.name}" for s in scene.switches],
        "camera_pose": [camera.name for camera in scene.cameras],
        "particles": [liquid.entity for liquid in scene.liquids for _ in range(liquid.count)],
    }.get(name)
    return f"{step} of {owners[int(index[1])]!r}" if owners else step


__all__ = ["ARRAYS", "Recording", "check", "check_steps"]
