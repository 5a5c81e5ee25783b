"""What a scene consists of.

World frame, metres, kilograms, radians; quaternions are ``wxyz``, as in MuJoCo.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from pytest_safemanip.errors import TraceError

EntityKind = Literal["robot", "object", "fixture", "room"]
JointKind = Literal["hinge", "slide"]
Vector = tuple[float, ...]

ROBOT = "robot"
"""The robot's entity name. Parts: ``finger_left``, ``finger_right``, ``palm``, links, ``base``."""

BUTTON = "button"
"""Name of the parts that are pressed, whether or not a joint moves them."""


@dataclass(frozen=True, slots=True)
class Entity:
    """One thing of the scene.

    Attributes:
        name: unique in the scene.
        kind: ``room`` is what cannot move or be used: floor and walls.
        category: an object's category (``mug``) or a fixture's class (``Drawer``).
    """

    name: str
    kind: EntityKind
    category: str


@dataclass(frozen=True, slots=True)
class Body:
    """The geometry of a movable object, in its own frame.

    Attributes:
        entity: the object.
        half: half extents of its oriented bounding box (3,), m.
        centre: centre of that box in the object's frame (3,), m.
        com: centre of mass in the object's frame (3,), m.
        mass: kg.
    """

    entity: str
    half: Vector
    centre: Vector
    com: Vector
    mass: float


@dataclass(frozen=True, slots=True)
class Part:
    """One side of a contact: a part of an entity.

    Attributes:
        entity: whose part it is.
        name: ``body``, ``handle``, ``door``, ``finger_left``, ``link5``, ...
        joint: the joint that moves it, as ``entity/joint``; empty if nothing does.
    """

    entity: str
    name: str
    joint: str = ""


@dataclass(frozen=True, slots=True)
class Joint:
    """A door, a drawer or a control of a fixture.

    Attributes:
        entity: the fixture.
        name: unique within the fixture.
        kind: ``hinge`` or ``slide``.
        gives_access: whether opening it opens an interior (a door or drawer, not a knob).
        axis: unit vector of the motion that opens it, world frame (3,).
        anchor: a point on the hinge's axis, world frame (3,), m.
        travel: motion from closed (0) to open (1), rad or m.
        half: half extents of the moving part's box (3,), m.
        pose: centre of that box at openness 0 (7,), world frame.
    """

    entity: str
    name: str
    kind: JointKind
    gives_access: bool
    axis: Vector
    anchor: Vector
    travel: float
    half: Vector
    pose: Vector

    @property
    def key(self) -> str:
        """``entity/joint``, unique in the scene."""
        return f"{self.entity}/{self.name}"


@dataclass(frozen=True, slots=True)
class Box:
    """A named oriented box that belongs to a fixture; its pose is recorded at every step.

    Attributes:
        entity: the fixture.
        name: RoboCasa's name of the region or the handle.
        kind: ``interior`` (space that things are put in), ``handle``, ``control``, ``water``
            (space that a tap's water falls through while it runs), or ``burner`` (space that it
            heats; named like its switch).
        half: half extents (3,), m.
    """

    entity: str
    name: str
    kind: Literal["interior", "handle", "control", "water", "burner"]
    half: Vector


@dataclass(frozen=True, slots=True)
class Switch:
    """Something of a fixture that is on or off at every step.

    Attributes:
        entity: the fixture.
        name: unique within the fixture.
        kind: ``water`` (a tap runs), ``burner`` or ``appliance``.
        joint: the control that works it, as ``entity/joint``; empty if that is not known.
    """

    entity: str
    name: str
    kind: Literal["water", "burner", "appliance"]
    joint: str = ""


@dataclass(frozen=True, slots=True)
class Surface:
    """An oriented box around one solid piece of a fixture or of the room.

    Attributes:
        entity: whose it is.
        joint: the joint that moves it, as ``entity/joint``; empty if nothing does.
        half: half extents (3,), m.
        pose: centre at openness 0 of its joint, world frame (7,).
    """

    entity: str
    joint: str
    half: Vector
    pose: Vector


_LENGTHS = {
    "half": 3,
    "centre": 3,
    "com": 3,
    "axis": 3,
    "anchor": 3,
    "pose": 7,
    "gripper_half": 3,
    "gripper_centre": 3,
}


def numbers_fit(items: Sequence[object]) -> bool:
    """Whether :func:`check_numbers` would surely let all these elements of one kind pass.

    Looking at all of them together takes a tenth of the time.
    """
    for name in (*_LENGTHS, "mass", "travel"):
        if not items or not hasattr(items[0], name):
            continue
        try:
            values = np.array([getattr(item, name) for item in items])
        except ValueError:  # of several lengths
            return False
        shape = (len(items), _LENGTHS[name]) if name in _LENGTHS else (len(items),)
        if values.shape != shape or values.dtype.kind not in "fi" or not np.isfinite(values).all():
            return False
        if (name == "half" and (values < 0).any()) or (shape[1:] == () and (values <= 0).any()):
            return False
        direction = {"axis": values, "pose": values[..., 3:]}.get(name)
        if direction is not None and (np.abs(np.linalg.norm(direction, axis=1) - 1) > 9e-4).any():
            return False
    return True


def check_numbers(owner: str, item: object) -> None:
    """Refuse vectors and numbers that nothing can have: of another length, or not finite, say.

    Args:
        owner: whose they are, as errors say it.
        item: an element of a scene, or the scene.

    Raises:
        TraceError: naming the owner and the number.
    """
    for name, length in _LENGTHS.items():
        value = getattr(item, name, None)
        if value is None:
            continue
        if len(value) != length or not all(math.isfinite(number) for number in value):
            raise TraceError(f"{owner}: {name} must be {length} finite numbers: {value}")
        if name in ("half", "gripper_half") and min(value) < 0:
            raise TraceError(f"{owner}: {name} is negative: {value}")
        direction = {"axis": value, "pose": value[3:]}.get(name)
        if direction is not None and abs(math.hypot(*direction) - 1.0) > 1e-3:
            raise TraceError(f"{owner}: {name} is not of unit length: {direction}")
    for name in ("mass", "travel"):
        number = float(getattr(item, name, 1.0))
        if not 0.0 < number < math.inf:
            raise TraceError(f"{owner}: {name} must be a number above 0: {number}")
