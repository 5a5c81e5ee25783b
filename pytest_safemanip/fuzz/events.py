"""What happens in a generated recording, each for some steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.fuzz.film import UP, Event, Film, Vector
from pytest_safemanip.fuzz.scenes import DOOR, PLACES, TAP
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.kinematics import opening_direction


@dataclass(frozen=True)
class Press(Event):
    """Two parts, by number, press on each other, unless they are of one thing."""

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
class Rest(Event):
    """An object stands on something."""

    number: int
    below: str

    def apply(self, film: Film) -> None:
        """Add it."""
        name = film.scene.bodies[film.object(self.number)].entity
        film.press(self.steps, f"{self.below}/body", f"{name}/body", 3.1, UP)


@dataclass(frozen=True)
class Grip(Event):
    """Both finger groups press on an object; then the gripper may be commanded open."""

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
class Put(Event):
    """An object is somewhere from a step on: its lowest point, and how it is tilted."""

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
class Reach(Event):
    """The hand is somewhere from a step on."""

    place: str
    shift: tuple[float, float]

    def apply(self, film: Film) -> None:
        """Add it."""
        half = film.scene.gripper_half[2]
        film.arrays["eef_pose"][self.steps.start :] = _pose(self.place, half, self.shift, 0.0)


@dataclass(frozen=True)
class Drift(Event):
    """The hand (0), or an object, has a velocity and turns."""

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
class Drive(Event):
    """The robot's base is so far from where it was, from a step on."""

    shift: tuple[float, float]

    def apply(self, film: Film) -> None:
        """Add it."""
        film.arrays["base_pose"][self.steps.start :, :2] += np.float32(10.0) * np.array(
            self.shift, np.float32
        )


@dataclass(frozen=True)
class Move(Event):
    """A door, or the tap's handle, is so far open from a step on, and moves while this lasts."""

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
class Hit(Event):
    """The door, moved by the hand, presses on an object in its way, and then is so far open."""

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
class Carry(Event):
    """The hand grips an object, takes it somewhere half way, and lets go of it there."""

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
class Pour(Event):
    """The hand grips an object with another one in it, which leaves it half way."""

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
class Wash(Event):
    """The hand is under the running tap."""

    def apply(self, film: Film) -> None:
        """Add it."""
        film.press(self.steps, f"{ROBOT}/finger_left", "sink/handle", 3.1, UP)
        Reach(self.steps, "tap", (0.0, 0.0)).apply(film)
        film.arrays["switch"][self.steps.start : self.steps.stop, 0] = 1.0


@dataclass(frozen=True)
class Turn(Event):
    """The hand is on the burner's knob."""

    def apply(self, film: Film) -> None:
        """Add it."""
        film.press(self.steps, f"{ROBOT}/finger_right", "stove/knob", 3.1, UP)


def _pose(place: str, half: float, shift: tuple[float, float], tilt: float) -> NDArray[np.float32]:
    x, y, z = PLACES[place]
    turn = (math.cos(tilt / 2), math.sin(tilt / 2), 0.0, 0.0)
    return np.array((x + shift[0], y + shift[1], z + half, *turn), np.float32)
