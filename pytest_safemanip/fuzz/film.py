"""Recordings from what happens in them: events that last for some steps, later ones on top."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.fuzz.scenes import CAMERA_PLACES, DROPS, PLACES, SHELF, TOP, UPRIGHT
from pytest_safemanip.trace.episode import Episode
from pytest_safemanip.trace.recording import Recording
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

    def hand(self, number: int) -> int:
        """Index of a gripper, from any number."""
        return number % len(self.scene.grippers)

    def object(self, number: int) -> int:
        """Index of an object, from any number."""
        return number % len(self.scene.bodies)

    def lasts(self, steps: range) -> tuple[slice, slice, NDArray[np.float64]]:
        """Some steps, those after them, and the seconds that each of them has lasted (K,)."""
        last = min(steps.stop, self.length)
        seconds = self.scene.control_period * np.arange(1, last - steps.start + 1)
        return slice(steps.start, last), slice(last, None), seconds

    def press(self, steps: range, a: str, b: str, force: float, normal: Vector) -> None:
        """Add contacts between two parts, each given as ``entity/part``."""
        names = [f"{part.entity}/{part.name}" for part in self.scene.parts]
        first, second = names.index(a), names.index(b)
        self.rows += [(t, first, second, force, normal) for t in steps if t < self.length]


@dataclass(frozen=True)
class Event:
    """An event that lasts for some steps.

    Attributes:
        steps: when; the first one is counted round where the recording ends.
    """

    steps: range

    def apply(self, film: Film) -> None:
        """Write the event into the film."""
        raise NotImplementedError


def rendered(scene: Scene, length: int, tail: int, events: Sequence[Event]) -> Recording:
    """A recording of these events alone.

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
    about = dataclasses.replace(_EPISODE, horizon=len(steps) - 1)
    return Recording(about, scene, steps)


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
        sustained=newtons.copy(),
        position=np.array([_touched(film, row) for row in rows], np.float32),
        normal=np.array(normal, np.float32),
    )


def _touched(film: Film, row: tuple[int, int, int, float, Vector]) -> NDArray[np.float64]:
    """Place of a contact (3,): on the surface of the object that it touches, else at the hand."""
    step, a, b, _, normal = row
    scene, parts = film.scene, film.scene.parts
    for part, sign in ((b, -1.0), (a, 1.0)):
        index = scene.object_index.get(parts[part].entity)
        if index is not None:
            reach = sign * np.array(normal) * scene.bodies[index].half
            return np.asarray(film.arrays["object_pose"][step, index, :3] + reach)
    return np.asarray(film.arrays["eef_poses"][step, 0, :3], float)


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
    hands = len(scene.grippers)
    step: dict[str, Any] = {
        "eef_poses": [(0.513 - 1.1 * n, -0.407, 1.307, *UPRIGHT) for n in range(hands)],
        "eef_twists": np.zeros((hands, 6)),
        "openings": [(0.5, 0.0)] * hands,
        "commands": np.zeros(hands),
        "base_pose": (0.0, -1.0, 0.0, *UPRIGHT),
        "object_pose": np.reshape(objects, (-1, 7)),
        "object_twist": np.zeros((len(objects), 6)),
        "joint": np.zeros((len(scene.joints), 2)),
        "box_pose": [(*boxes[box.kind], *UPRIGHT) for box in scene.boxes],
        "switch": np.zeros(len(scene.switches)),
        "camera_pose": [(*place, *UPRIGHT) for place in CAMERA_PLACES],
        "particles": [np.add(PLACES["counter"], shift) for shift in DROPS],
        "qpos": np.zeros(1),
        "qvel": np.zeros(1),
        "action": np.zeros(len(scene.actions)),
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
    stepping="exact",
    assets="generated",
    versions={},
    hashes={},
    served={},
)


def of_length(recording: Recording, first: int, stop: int) -> Recording:
    """Steps ``first`` to ``stop - 1`` as a recording."""
    return dataclasses.replace(recording, steps=recording.steps.window(first, stop))
