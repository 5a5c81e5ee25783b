"""Recordings from what happens in them: events that last for some steps, later ones on top."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.fuzz.scenes import DOOR, PLACES, SHELF, TAP, TOP, UPRIGHT
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.kinematics import opening_direction
from pytest_safemanip.trace.recording import Episode, Recording
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Contacts, Steps

Vector = tuple[float, float, float]
UP: Vector = (0.0, 0.0, 1.0)


@dataclass
class Film:
    """A recording in the making: arrays by name, and contacts (step, part, part, force, normal)."""

    scene: Scene
    arrays: dict[str, NDArray[Any]]
    rows: list[tuple[int, int, int, float, Vector]] = field(default_factory=list)

    @property
    def length(self) -> int:
        """Steps."""
        return len(self.arrays["tail"])

    def object(self, number: int) -> int:
        """Which object a number means; every number means one."""
        return number % len(self.scene.bodies)

    def press(self, steps: range, a: str, b: str, force: float, normal: Vector) -> None:
        """Two parts, each ``entity/part``, press on each other."""
        names = [f"{part.entity}/{part.name}" for part in self.scene.parts]
        first, second = names.index(a), names.index(b)
        self.rows += [(t, first, second, force, normal) for t in steps if t < self.length]


@dataclass(frozen=True)
class Press:
    """Two parts, by number, press on each other, unless they are of one thing."""

    steps: range
    a: int
    b: int
    force: float
    normal: Vector

    def apply(self, film: Film) -> None:
        """Add it."""
        parts = film.scene.parts
        first, second = sorted((self.a % len(parts), self.b % len(parts)))
        if parts[first].entity != parts[second].entity:
            names = [f"{parts[n].entity}/{parts[n].name}" for n in (first, second)]
            film.press(self.steps, names[0], names[1], self.force, self.normal)


@dataclass(frozen=True)
class Rest:
    """An object stands on something."""

    steps: range
    number: int
    below: str

    def apply(self, film: Film) -> None:
        """Add it."""
        name = film.scene.bodies[film.object(self.number)].entity
        film.press(self.steps, f"{self.below}/body", f"{name}/body", 3.1, UP)


@dataclass(frozen=True)
class Grip:
    """Both finger groups press on an object; then the gripper may be commanded open."""

    steps: range
    number: int
    force: float
    opens: bool

    def apply(self, film: Film) -> None:
        """Add it."""
        name = film.scene.bodies[film.object(self.number)].entity
        for side, x in (("left", 1.0), ("right", -1.0)):
            finger = f"{ROBOT}/finger_{side}"
            film.press(self.steps, finger, f"{name}/body", self.force, (x, 0.0, 0.0))
        film.arrays["gripper"][self.steps.start : self.steps.stop, 0] = 0.23
        if self.opens:
            film.arrays["action"][self.steps.stop :, 6] = -1.0
            film.arrays["gripper"][self.steps.stop :, 1] = 0.3


@dataclass(frozen=True)
class Put:
    """An object is somewhere from a step on: its lowest point, and how it is tilted."""

    steps: range
    number: int
    place: str
    shift: tuple[float, float]
    tilt: float

    def apply(self, film: Film) -> None:
        """Add it."""
        index = film.object(self.number)
        half = film.scene.bodies[index].half[2]
        poses = film.arrays["object_pose"][:, index]
        poses[self.steps.start :] = _pose(self.place, half, self.shift, self.tilt)


@dataclass(frozen=True)
class Reach:
    """The hand is somewhere from a step on."""

    steps: range
    place: str
    shift: tuple[float, float]

    def apply(self, film: Film) -> None:
        """Add it."""
        half = film.scene.gripper_half[2]
        film.arrays["eef_pose"][self.steps.start :] = _pose(self.place, half, self.shift, 0.0)


@dataclass(frozen=True)
class Drift:
    """The hand (0), or an object, has a velocity and turns."""

    steps: range
    number: int
    velocity: Vector
    spin: Vector

    def apply(self, film: Film) -> None:
        """Add it."""
        twists = film.arrays["eef_twist"]
        if self.number:
            twists = film.arrays["object_twist"][:, film.object(self.number)]
        twists[self.steps.start : self.steps.stop] = (*self.velocity, *self.spin)


@dataclass(frozen=True)
class Drive:
    """The robot's base is so far from where it was, from a step on."""

    steps: range
    shift: tuple[float, float]

    def apply(self, film: Film) -> None:
        """Add it."""
        film.arrays["base_pose"][self.steps.start :, :2] += np.float32(10.0) * np.array(
            self.shift, np.float32
        )


@dataclass(frozen=True)
class Move:
    """A door, or the tap's handle, is so far open from a step on, and moves while this lasts."""

    steps: range
    joint: int
    openness: float
    rate: float

    def apply(self, film: Film) -> None:
        """Add it."""
        film.arrays["joint"][self.steps.start :, self.joint, 0] = self.openness
        film.arrays["joint"][self.steps.start : self.steps.stop, self.joint, 1] = self.rate
        if self.joint == TAP:
            film.arrays["switch"][self.steps.start :, 0] = float(self.openness > 0.5)
        elif self.rate:
            film.press(self.steps, f"{ROBOT}/finger_left", "cab/door", 3.1, UP)


@dataclass(frozen=True)
class Hit:
    """The door, moved by the hand, presses on an object in its way, and then is so far open."""

    steps: range
    number: int
    force: float
    rate: float
    openness: float

    def apply(self, film: Film) -> None:
        """Add it."""
        door = film.arrays["joint"][:, DOOR]
        door[self.steps.start : self.steps.stop] = (0.51, self.rate)
        door[self.steps.stop :] = (self.openness, 0.0)
        film.press(self.steps, f"{ROBOT}/finger_left", "cab/door", 3.1, UP)
        index = film.object(self.number)
        place = film.arrays["object_pose"][self.steps.start, index, :3]
        along = opening_direction(film.scene.joints[DOOR], place)
        x, y, z = (float(np.sign(self.rate)) * along).tolist()
        name = film.scene.bodies[index].entity
        film.press(self.steps, "cab/door", f"{name}/body", self.force, (x, y, z))


@dataclass(frozen=True)
class Carry:
    """The hand grips an object, takes it somewhere half way, and lets go of it there."""

    steps: range
    number: int
    place: str
    opens: bool
    velocity: Vector

    def apply(self, film: Film) -> None:
        """Add it."""
        Grip(self.steps, self.number, 5.3, self.opens).apply(film)
        held = film.arrays["object_twist"][:, film.object(self.number)]
        for twists in (film.arrays["eef_twist"], held):
            twists[self.steps.start : self.steps.stop, :3] = self.velocity
        later = range((self.steps.start + self.steps.stop) // 2, self.steps.stop)
        Put(later, self.number, self.place, (0.0, 0.0), 0.0).apply(film)
        Reach(later, self.place, (0.0, 0.0)).apply(film)


@dataclass(frozen=True)
class Pour:
    """The hand grips an object with another one in it, which leaves it half way."""

    steps: range
    number: int
    place: str

    def apply(self, film: Film) -> None:
        """Add it."""
        container, content = film.object(self.number), film.object(self.number + 1)
        if container == content:
            return
        poses = film.arrays["object_pose"]
        poses[:, content] = poses[:, container]
        Grip(self.steps, self.number, 5.3, False).apply(film)
        later = range((self.steps.start + self.steps.stop) // 2, self.steps.stop)
        Put(later, content, self.place, (0.0, 0.0), 0.0).apply(film)


@dataclass(frozen=True)
class Wash:
    """The hand is under the running tap."""

    steps: range

    def apply(self, film: Film) -> None:
        """Add it."""
        film.press(self.steps, f"{ROBOT}/finger_left", "sink/handle", 3.1, UP)
        Reach(self.steps, "tap", (0.0, 0.0)).apply(film)
        film.arrays["switch"][self.steps.start : self.steps.stop, 0] = 1.0


@dataclass(frozen=True)
class Turn:
    """The hand is on the burner's knob."""

    steps: range

    def apply(self, film: Film) -> None:
        """Add it."""
        film.press(self.steps, f"{ROBOT}/finger_right", "stove/knob", 3.1, UP)


Event = Press | Rest | Grip | Put | Reach | Drift | Drive | Move | Hit | Carry | Pour | Wash | Turn


def _pose(place: str, half: float, shift: tuple[float, float], tilt: float) -> NDArray[np.float32]:
    x, y, z = PLACES[place]
    turn = (math.cos(tilt / 2), math.sin(tilt / 2), 0.0, 0.0)
    return np.array((x + shift[0], y + shift[1], z + half, *turn), np.float32)


def rendered(scene: Scene, length: int, tail: int, events: Sequence[Event]) -> Recording:
    """The recording in which these events happen, and nothing else.

    Args:
        scene: where.
        length: steps.
        tail: steps of the settle tail among them.
        events: what happens; where two say different things, the later one holds.
    """
    film = Film(scene, _at_rest(scene, length, tail))
    for event in events:
        first = event.steps.start % length
        dataclasses.replace(event, steps=range(first, first + len(event.steps))).apply(film)
    steps = Steps(**film.arrays, contacts=_contacts(film))
    return Recording(_EPISODE, scene, steps)


def contact_rows(scene: Scene, length: int, events: Sequence[Event]) -> Contacts:
    """The contacts of these events alone."""
    return rendered(scene, length, 0, events).steps.contacts


def _contacts(film: Film) -> Contacts:
    rows = sorted(film.rows, key=lambda row: row[:3])
    if not rows:
        return Contacts.empty()
    step, a, b, force, normal = zip(*rows, strict=True)
    newtons = np.array(force, np.float32)
    return Contacts(
        step=np.array(step, np.int32),
        a=np.array(a, np.int32),
        b=np.array(b, np.int32),
        force=newtons,
        peak=newtons.copy(),
        position=np.array([_touched(film, row) for row in rows], np.float32),
        normal=np.array(normal, np.float32),
    )


def _touched(film: Film, row: tuple[int, int, int, float, Vector]) -> NDArray[np.float64]:
    """Where a contact is: below the object that it carries, else beside it; or at the hand."""
    step, a, b, _, normal = row
    scene, parts = film.scene, film.scene.parts
    for part, sign in ((b, -1.0), (a, 1.0)):
        index = scene.object_index.get(parts[part].entity)
        if index is not None:
            reach = sign * np.array(normal) * scene.bodies[index].half
            return np.asarray(film.arrays["object_pose"][step, index, :3] + reach)
    return np.asarray(film.arrays["eef_pose"][step, :3], float)


def _at_rest(scene: Scene, length: int, tail: int) -> dict[str, NDArray[Any]]:
    """Everything in its place: the objects side by side on the counter, the hand beside them."""
    objects = [
        (-0.311 + 0.307 * n, 0.023, TOP + body.half[2], *UPRIGHT)
        for n, body in enumerate(scene.bodies)
    ]
    boxes = {
        "interior": (0.0, 0.6, SHELF + 0.297),
        "water": (0.407, 0.0, 1.003),
        "burner": PLACES["beside"],
    }
    step: dict[str, Any] = {
        "eef_pose": (0.513, -0.407, 1.307, *UPRIGHT),
        "eef_twist": np.zeros(6),
        "gripper": (0.5, 0.0),
        "base_pose": (0.0, -1.0, 0.0, *UPRIGHT),
        "object_pose": np.reshape(objects, (-1, 7)),
        "object_twist": np.zeros((len(objects), 6)),
        "joint": np.zeros((len(scene.joints), 2)),
        "box_pose": [(*boxes[box.kind], *UPRIGHT) for box in scene.boxes],
        "switch": np.zeros(len(scene.switches)),
        "qpos": np.zeros(1),
        "qvel": np.zeros(1),
        "action": np.zeros(12),
    }
    arrays: dict[str, NDArray[Any]] = {
        name: np.repeat(np.array(value, np.float32)[None], length, axis=0)
        for name, value in step.items()
    }
    arrays["success"] = np.zeros(length, bool)
    arrays["tail"] = np.arange(length) >= length - tail
    return arrays


_EPISODE = Episode(
    task="fuzz",
    seed=0,
    policy="generated",
    instruction="",
    horizon=0,
    ended="horizon",
    backend="generated",
    scenes="generated",
    assets="generated",
    versions={},
    hashes={},
    served={},
)


def of_length(recording: Recording, first: int, stop: int) -> Recording:
    """Some of a recording's steps, as a recording."""
    return dataclasses.replace(recording, steps=recording.steps.window(first, stop))
