"""The events of generated recordings; each lasts for some steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.fuzz.film import UP, Event, Film, Vector
from pytest_safemanip.fuzz.scenes import DOOR, DROPS, PLACES, TAP
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import about, multiply
from pytest_safemanip.trace.kinematics import opening_direction


@dataclass(frozen=True)
class Press(Event):
    """Two parts, by number, press on each other, unless they are of one thing."""

    a: int
    b: int
    force: float
    normal: Vector

    def apply(self, film: Film) -> None:
        """Add the contact between the two parts."""
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
        """Add the contact between the object and what is below it."""
        name = film.scene.bodies[film.object(self.number)].entity
        film.press(self.steps, f"{self.below}/body", f"{name}/body", 3.1, UP)


@dataclass(frozen=True)
class Grip(Event):
    """The first finger group of a gripper presses on an object against the others; then the gripper
    may be commanded open.
    """

    number: int
    force: float
    opens: bool
    hand: int = 0

    def apply(self, film: Film) -> None:
        """Add the contacts of all finger groups, the fingers' opening and the command to open."""
        hand = film.hand(self.hand)
        name = film.scene.bodies[film.object(self.number)].entity
        for group, parts in enumerate(film.scene.grippers[hand].fingers):
            normal = (-1.0 if group else 1.0, 0.0, 0.0)
            film.press(self.steps, f"{ROBOT}/{parts[-1]}", f"{name}/body", self.force, normal)
        opening = film.arrays["openings"][:, hand]
        opening[self.steps.start :] = (0.23, 0.0)
        if self.opens:
            after, _, seconds = film.lasts(range(self.steps.stop, film.length))
            film.arrays["commands"][after, hand] = -1.0
            opening[after, 0] += np.minimum(0.3 * seconds, 0.5)
            opening[after, 1] = 0.3


@dataclass(frozen=True)
class PlaceObject(Event):
    """An object is somewhere from a step on: its lowest point, and how it is tilted."""

    number: int
    place: str
    shift: tuple[float, float]
    tilt: float

    def apply(self, film: Film) -> None:
        """Add the pose of the object."""
        index = film.object(self.number)
        half = film.scene.bodies[index].half[2]
        poses = film.arrays["object_pose"][:, index]
        poses[self.steps.start :] = _pose(self.place, half, self.shift, self.tilt)


@dataclass(frozen=True)
class PlaceHand(Event):
    """A hand is somewhere from a step on."""

    place: str
    shift: tuple[float, float]
    hand: int = 0

    def apply(self, film: Film) -> None:
        """Add the pose of the hand."""
        hand = film.hand(self.hand)
        pose = _pose(self.place, film.scene.grippers[hand].half[2], self.shift, 0.0)
        film.arrays["eef_poses"][self.steps.start :, hand] = pose


@dataclass(frozen=True)
class Drift(Event):
    """The hand (0), or an object, moves and turns, about its own middle."""

    number: int
    velocity: Vector
    spin: Vector

    def apply(self, film: Film) -> None:
        """Add the twist of the hand or object, and what it does to its pose."""
        twists, poses = film.arrays["eef_twists"][:, 0], film.arrays["eef_poses"][:, 0]
        if self.number:
            index = film.object(self.number)
            twists, poses = (film.arrays[f"object_{what}"][:, index] for what in ("twist", "pose"))
        _move(film, self.steps, twists, poses, self.velocity, self.spin)


@dataclass(frozen=True)
class Drive(Event):
    """The robot's base is so far from where it was, from a step on."""

    shift: tuple[float, float]

    def apply(self, film: Film) -> None:
        """Add the shift of the robot's base."""
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
        """Add the openness, and the contact or the switch that goes with it."""
        joint = film.arrays["joint"][:, self.joint]
        now, after, seconds = film.lasts(self.steps)
        joint[now, 0] = np.linspace(joint[max(now.start - 1, 0), 0], self.openness, len(seconds))
        joint[now, 1], joint[after] = self.rate, (self.openness, 0.0)
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
        """Add the door's motion and its contact with the object."""
        door = film.arrays["joint"][:, DOOR]
        now, after, seconds = film.lasts(self.steps)
        door[now, 0], door[now, 1] = 0.51 + self.rate * seconds, self.rate
        door[after] = (self.openness, 0.0)
        film.press(self.steps, f"{ROBOT}/finger_left", "cab/door", 3.1, UP)
        index = film.object(self.number)
        place = film.arrays["object_pose"][self.steps.start, index, :3]
        along = opening_direction(film.scene.joints[DOOR], place)
        x, y, z = (float(np.sign(self.rate)) * along).tolist()
        name = film.scene.bodies[index].entity
        film.press(self.steps, "cab/door", f"{name}/body", self.force, (x, y, z))


@dataclass(frozen=True)
class Carry(Event):
    """A hand grips an object, takes it somewhere half way, and lets go of it there."""

    number: int
    place: str
    opens: bool
    velocity: Vector
    hand: int = 0

    def apply(self, film: Film) -> None:
        """Add the grip, the motion of hand and object, and their new place."""
        Grip(self.steps, self.number, 5.3, self.opens, self.hand).apply(film)
        index, hand = film.object(self.number), film.hand(self.hand)
        for whose, number in (("object_{}", index), ("eef_{}s", hand)):
            twists, poses = (film.arrays[whose.format(w)][:, number] for w in ("twist", "pose"))
            _move(film, self.steps, twists, poses, self.velocity, (0.0, 0.0, 0.0))
        later = range((self.steps.start + self.steps.stop) // 2, self.steps.stop)
        PlaceObject(later, self.number, self.place, (0.0, 0.0), 0.0).apply(film)
        PlaceHand(later, self.place, (0.0, 0.0), self.hand).apply(film)


@dataclass(frozen=True)
class Pour(Event):
    """The hand grips an object with another one in it, which leaves it half way."""

    number: int
    place: str

    def apply(self, film: Film) -> None:
        """Add the grip of the container and the content's new place."""
        container, content = film.object(self.number), film.object(self.number + 1)
        if container == content:
            return
        poses = film.arrays["object_pose"]
        poses[:, content] = poses[:, container]
        Grip(self.steps, self.number, 5.3, False).apply(film)
        later = range((self.steps.start + self.steps.stop) // 2, self.steps.stop)
        PlaceObject(later, content, self.place, (0.0, 0.0), 0.0).apply(film)


@dataclass(frozen=True)
class Wash(Event):
    """The hands are under the running tap."""

    def apply(self, film: Film) -> None:
        """Add the hands below the tap, and the water."""
        film.press(self.steps, f"{ROBOT}/finger_left", "sink/handle", 3.1, UP)
        for hand in range(len(film.scene.grippers)):
            PlaceHand(self.steps, "tap", (0.0, 0.0), hand).apply(film)
        film.arrays["switch"][self.steps.start : self.steps.stop, 0] = 1.0


@dataclass(frozen=True)
class TouchKnob(Event):
    """The hand is on the burner's knob."""

    def apply(self, film: Film) -> None:
        """Add the contact between finger and knob."""
        film.press(self.steps, f"{ROBOT}/finger_right", "stove/knob", 3.1, UP)


@dataclass(frozen=True)
class Run(Event):
    """A burner is lit, or an appliance runs."""

    number: int

    def apply(self, film: Film) -> None:
        """Set a switch that is no tap's."""
        others = [k for k, switch in enumerate(film.scene.switches) if switch.kind != "water"]
        film.arrays["switch"][
            self.steps.start : self.steps.stop, others[self.number % len(others)]
        ] = 1.0


@dataclass(frozen=True)
class Spill(Event):
    """Some particles of the liquids are somewhere else from a step on."""

    number: int
    place: str

    def apply(self, film: Film) -> None:
        """Add the places of the particles."""
        particles = film.arrays["particles"]
        some = slice(0, 1 + self.number % particles.shape[1])
        shifts = np.array(DROPS)[some]
        particles[self.steps.start :, some] = np.array(PLACES[self.place]) + shifts


@dataclass(frozen=True)
class Look(Event):
    """The cameras are somewhat elsewhere from a step on."""

    shift: tuple[float, float]

    def apply(self, film: Film) -> None:
        """Add the shift of the cameras."""
        shift = np.float32(10.0) * np.array(self.shift, np.float32)
        film.arrays["camera_pose"][self.steps.start :, :, :2] += shift


def _move(
    film: Film,
    steps: range,
    twists: NDArray[np.float32],
    poses: NDArray[np.float32],
    velocity: Vector,
    spin: Vector,
) -> None:
    """Move what has these twists (T, 6) and poses (T, 7) at some steps; then it stays there."""
    now, after, seconds = film.lasts(steps)
    twists[now] = (*velocity, *spin)
    rate = float(np.linalg.norm(spin))
    way, turns = seconds[:, None] * velocity, about(np.divide(spin, rate or 1.0), rate * seconds)
    poses[now, :3] += way
    poses[now, 3:] = multiply(turns, poses[now, 3:])
    poses[after, :3] += way[-1]
    poses[after, 3:] = multiply(
        np.broadcast_to(turns[-1], poses[after, 3:].shape), poses[after, 3:]
    )


def _pose(place: str, half: float, shift: tuple[float, float], tilt: float) -> NDArray[np.float32]:
    x, y, z = PLACES[place]
    turn = (math.cos(tilt / 2), math.sin(tilt / 2), 0.0, 0.0)
    return np.array((x + shift[0], y + shift[1], z + half, *turn), np.float32)
