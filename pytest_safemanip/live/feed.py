"""What was observed of a step, by name, as a step; what was not stays as it was, and is listed."""

from __future__ import annotations

import contextlib
import copy
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pytest_safemanip.errors import TraceError, did_you_mean
from pytest_safemanip.propositions.observed.inputs import Kind
from pytest_safemanip.propositions.observed.known import Unobserved
from pytest_safemanip.trace.geometry import conjugate, multiply
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import ARRAYS, Contacts, Step, array_shapes

T = TypeVar("T")
Array = NDArray[np.float64]
LEAST_OPENNESS, MOST_OPENNESS = -1.0, 3.0
"""Sanity bounds: drawers go on beyond what counts as open, degrees are far beyond."""
Felt = Iterable[str] | None


@dataclass(frozen=True)
class HandReading:
    """What is known of a gripper; None for what is not.

    Attributes:
        pose: of the end effector, position and quaternion ``wxyz``, world frame (7,), m.
        opening: 0 closed, 1 open.
        command: what it was told in this control period: above 0 to close, below 0 to open.
    """

    pose: ArrayLike | None = None
    opening: float | None = None
    command: float | None = None


@dataclass(frozen=True)
class Touch:
    """A contact between two parts.

    Attributes:
        a: a part, as ``entity/part``.
        b: another entity's.
        force: normal force, N.
        position: of the contact, world frame (3,), m.
        normal: unit vector from ``a`` to ``b``, world frame (3,).
        sustained: the largest mean over 20 ms that ended within the control period, N; ``force``
            if it is None.
    """

    a: str
    b: str
    force: float
    position: Sequence[float]
    normal: Sequence[float]
    sustained: float | None = None


@dataclass(frozen=True)
class Reading:
    """What was observed at a step, by name. What is not there was not observed.

    Attributes:
        poses: of objects, position and quaternion ``wxyz``, world frame (7,), m.
        contacts: those that are felt; None if nothing feels any.
        gripper: of the one gripper, or of each by name.
        joints: openness of joints, as ``entity/joint``: 0 closed, 1 open.
        boxes: poses of boxes of fixtures, as ``entity/box`` (7,).
        switches: whether what is switched is on, as ``entity/switch``.
        felt: entities, or parts as ``entity/part``, all of whose contacts are in ``contacts``; None
            for everybody's.
    """

    poses: Mapping[str, ArrayLike]
    contacts: Iterable[Touch] | None
    gripper: HandReading | Mapping[str, HandReading] | None
    joints: Mapping[str, float]
    boxes: Mapping[str, ArrayLike]
    switches: Mapping[str, bool]
    felt: Felt


class Feed:
    """Makes steps of readings.

    What moves has the velocity that its last two observations give it. What was never observed is
    at the origin: nothing that depends on it counts as known.

    Args:
        scene: the static part of the trace.
        boxes: poses of boxes that stay where they are, as ``entity/box`` (7,).

    Raises:
        TraceError: if the scene has no such box.
    """

    def __init__(self, scene: Scene, boxes: Mapping[str, ArrayLike]) -> None:
        self._scene, self._now = scene, -1
        self._bodies = {body.entity: k for k, body in enumerate(scene.bodies)}
        self._hands = {hand.name: k for k, hand in enumerate(scene.grippers)}
        self._boxes = {f"{box.entity}/{box.name}": k for k, box in enumerate(scene.boxes)}
        self._switches = {f"{s.entity}/{s.name}": k for k, s in enumerate(scene.switches)}
        self._parts = {f"{part.entity}/{part.name}": k for k, part in enumerate(scene.parts)}
        shapes = {**array_shapes(scene), "qpos": (0,), "qvel": (0,)}
        self._arrays = {name: np.zeros(shapes[name]) for name in ARRAYS}
        for name in ("eef_poses", "base_pose", "object_pose", "box_pose", "camera_pose"):
            self._arrays[name][..., 3] = 1.0
        self._seen: dict[tuple[str, int], int] = {}  # when each was last observed
        self._fixed = self._put("box_pose", self._boxes, boxes, _pose)

    def step(self, reading: Reading) -> tuple[Step, Unobserved]:
        """The step, and what of it was not observed.

        Raises:
            TraceError: if the scene has nothing of a name, or a value is malformed.
        """
        try:
            return self._step(reading)
        except (AttributeError, TypeError) as error:
            raise TraceError(f"step {self._now}: malformed reading: {error}") from error

    @contextlib.contextmanager
    def undone_if_refused(self) -> Iterator[None]:
        """Forgets a step that turns out to be impossible."""
        before = copy.deepcopy((self._now, self._arrays, self._seen))
        try:
            yield
        except TraceError:
            self._now, self._arrays, self._seen = before
            raise

    def _step(self, reading: Reading) -> tuple[Step, Unobserved]:
        self._now += 1
        scene, missing = self._scene, set[tuple[Kind, str]]()
        moved = self._put("object_pose", self._bodies, reading.poses, _pose, "object_twist")
        missing |= {("pose", name) for name, k in self._bodies.items() if k not in moved}
        opened = self._put("joint", scene.joint_index, reading.joints, _openness)
        missing |= {("joints", j.entity) for k, j in enumerate(scene.joints) if k not in opened}
        placed = self._fixed | self._put("box_pose", self._boxes, reading.boxes, _pose)
        missing |= {("boxes", box.entity) for k, box in enumerate(scene.boxes) if k not in placed}
        on = self._put("switch", self._switches, reading.switches, float)
        missing |= {("switches", s.entity) for k, s in enumerate(scene.switches) if k not in on}
        missing |= {("particles", liquid.entity) for liquid in scene.liquids}
        missing |= {("cameras", "")} if scene.cameras else set()
        missing |= self._put_hands(reading.gripper)
        contacts, unfelt = self._touching(reading)
        arrays = {name: array.astype(np.float32) for name, array in self._arrays.items()}
        step = Step(**arrays, success=False, contacts=contacts)
        return step, Unobserved(frozenset(missing), unfelt)

    def _put(
        self,
        array: str,
        places: Mapping[str, int],
        values: Mapping[str, Any],
        read: Callable[[Any], Any],
        twist: str = "",
    ) -> set[int]:
        """Write what was observed; its places."""
        for name, value in values.items():
            if name not in places:
                raise TraceError(f"the scene has no {name!r}; {did_you_mean(name, places)}")
            try:
                new = read(value)
            except (TypeError, ValueError) as error:
                raise TraceError(f"{name!r} at step {self._now}: {error}") from error
            self._move(array, places[name], new, twist)
        return {places[name] for name in values}

    def _move(self, array: str, place: int, new: Any, twist: str) -> None:
        """Put something where it is now, and say how fast it came there."""
        rows, before = self._arrays[array], self._seen.get((array, place))
        elapsed = 0.0 if before is None else (self._now - before) * self._scene.control_period
        self._seen[array, place] = self._now
        if array in ("joint", "openings"):
            rate = (new - rows[place, 0]) / elapsed if elapsed else 0.0
            rows[place] = new, rate
            return
        if twist:
            self._arrays[twist][place] = _twist(rows[place], new, elapsed) if elapsed else 0.0
        rows[place] = new

    def _put_hands(
        self, gripper: HandReading | Mapping[str, HandReading] | None
    ) -> set[tuple[Kind, str]]:
        if isinstance(gripper, HandReading):
            if len(self._hands) != 1:
                raise TraceError(f"the robot has {len(self._hands)} grippers: name each of them")
            gripper = dict.fromkeys(self._hands, gripper)
        readings, missing = gripper or {}, set[tuple[Kind, str]]()

        def given(field: str) -> dict[str, Any]:
            found = {name: getattr(hand, field) for name, hand in readings.items()}
            return {name: value for name, value in found.items() if value is not None}

        kinds: tuple[tuple[Kind, str, str, Callable[[Any], Any], str], ...] = (
            ("hands", "eef_poses", "pose", _pose, "eef_twists"),
            ("openings", "openings", "opening", _openness, ""),
            ("commands", "commands", "command", float, ""),
        )
        for kind, array, field, read, twist in kinds:
            if len(self._put(array, self._hands, given(field), read, twist)) < len(self._hands):
                missing.add((kind, ""))
        return missing

    def _touching(self, reading: Reading) -> tuple[Contacts, frozenset[int]]:
        """The contacts, and the parts that do not feel theirs."""
        everybody = frozenset(range(len(self._scene.parts)))
        if reading.contacts is None:
            return Contacts.empty(), everybody
        felt = everybody if reading.felt is None else frozenset(self._felt(reading.felt))
        rows = list(reading.contacts)
        if not rows:
            return Contacts.empty(), everybody - felt
        try:
            lasting = [row.force if row.sustained is None else row.sustained for row in rows]
            contacts = Contacts(
                step=np.zeros(len(rows), np.int32),
                a=np.array([self._part(row.a) for row in rows], np.int32),
                b=np.array([self._part(row.b) for row in rows], np.int32),
                force=np.array([row.force for row in rows], np.float32),
                sustained=np.array(lasting, np.float32),
                position=np.array([row.position for row in rows], np.float32),
                normal=np.array([row.normal for row in rows], np.float32),
            )
        except (TypeError, ValueError) as error:
            raise TraceError(f"contacts at step {self._now}: {error}") from error
        return contacts, everybody - felt

    def _part(self, name: str) -> int:
        if name not in self._parts:
            raise TraceError(f"the scene has no part {name!r}; {did_you_mean(name, self._parts)}")
        return self._parts[name]

    def _felt(self, names: Iterable[str]) -> Iterable[int]:
        for name in (names,) if isinstance(names, str) else names:
            if name in self._scene.entity:
                yield from self._scene.owned.get(name, ())
            else:
                yield self._part(name)


def _openness(value: Any) -> float:
    opening = float(value)
    if not LEAST_OPENNESS <= opening <= MOST_OPENNESS:
        raise ValueError(
            f"an openness is 0 where it is closed and 1 where it is open, found {opening:g}: "
            "divide a position by the joint's travel"
        )
    return opening


def _pose(value: ArrayLike) -> Array:
    pose = np.asarray(value, float)
    if pose.shape != (7,):
        raise ValueError(f"a pose is x, y, z and the quaternion w, x, y, z; found {pose.shape}")
    return pose


def _twist(old: Array, new: Array, elapsed: float) -> Array:
    """Velocity and angular velocity of what was elsewhere some seconds ago (6,)."""
    turned = multiply(new[3:], conjugate(old[3:]))
    turned = turned if turned[0] >= 0.0 else -turned
    sine = float(np.linalg.norm(turned[1:]))
    angle = 2.0 * np.arctan2(sine, turned[0])
    spin = turned[1:] * (angle / sine if sine > 0.0 else 0.0)
    twist: Array = np.concatenate((new[:3] - old[:3], spin)) / elapsed
    return twist
