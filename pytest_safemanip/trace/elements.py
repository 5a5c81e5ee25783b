"""Elements of a scene.

World frame, metres, kilograms, radians; quaternions are ``wxyz``, as in MuJoCo.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

EntityKind = Literal["robot", "object", "fixture", "room", "liquid"]
JointKind = Literal["hinge", "slide"]
BoxKind = Literal["interior", "handle", "control", "water", "burner", "poured"]
Vector = tuple[float, ...]

ROBOT = "robot"
"""The robot's entity name. Which of its parts are fingers and palms, its grippers say."""

BUTTON = "button"
"""Name of the parts that are pressed, whether or not a joint moves them."""


@dataclass(frozen=True, slots=True)
class Entity:
    """An entity of the scene.

    Attributes:
        name: unique in the scene.
        kind: ``room`` is what cannot move or be used: floor and walls; a ``liquid`` is many
            particles.
        category: an object's category (``mug``), a fixture's class (``Drawer``), or what a liquid
            is (``water``).
        attributes: what it is like in this episode, beside its category: ``no_metal`` where metal
            must not be while a fixture runs, ``liquid`` of a vessel that is filled.
    """

    name: str
    kind: EntityKind
    category: str
    attributes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Gripper:
    """A hand of the robot.

    Attributes:
        name: unique among the robot's grippers.
        fingers: names of the robot's parts in each finger group, at least two groups. A grasp is
            two groups that press against each other. A tool that holds nothing has none.
        palm: names of the other parts of the hand.
        half: half extents of the hand's box (3,), m.
        centre: centre of that box in the end effector's frame (3,), m.
    """

    name: str
    fingers: tuple[tuple[str, ...], ...]
    palm: tuple[str, ...]
    half: Vector
    centre: Vector

    @property
    def parts(self) -> tuple[str, ...]:
        """All parts of the hand."""
        return (*(part for group in self.fingers for part in group), *self.palm)


@dataclass(frozen=True, slots=True)
class ActionEntry:
    """An entry of the robot's action.

    Attributes:
        name: unique in the action.
        low: its least value.
        high: its largest value.
    """

    name: str
    low: float = -1.0
    high: float = 1.0


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
        name: ``body``, ``handle``, ``door``, ``link5``, ...
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
        name: the backend's name of the region or the handle.
        kind: ``interior`` (space that things are put in), ``handle``, ``control``, ``water``
            (space that a tap's water falls through while it runs), ``burner`` (space that it
            heats; named like its switch), or ``poured`` (place that a machine pours onto).
        half: half extents (3,), m.
    """

    entity: str
    name: str
    kind: BoxKind
    half: Vector


@dataclass(frozen=True, slots=True)
class Switch:
    """A switch of a fixture, on or off at every step.

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
class Camera:
    """A camera; its pose is recorded at every step: it looks along its -z, its y is up.

    Attributes:
        name: unique among the cameras.
        fov: vertical field of view, rad.
        aspect: width of its image over the height.
    """

    name: str
    fov: float
    aspect: float


@dataclass(frozen=True, slots=True)
class Liquid:
    """A liquid, as particles whose places are recorded at every step.

    Attributes:
        entity: the liquid.
        count: number of its particles.
        radius: of a particle, m.
    """

    entity: str
    count: int
    radius: float


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


UNIT_TOLERANCE = 1e-3
"""How far the length of a unit vector or quaternion may be from one (float32 keeps it within 1e-6).
"""
LARGEST = 1e6
"""No kitchen has a larger number of metres, kilograms or radians, whose squares stay numbers."""
SHAPES: dict[str, tuple[int, ...]] = {
    "half": (3,),
    "centre": (3,),
    "com": (3,),
    "axis": (3,),
    "anchor": (3,),
    "pose": (7,),
    "mass": (),
    "travel": (),
    "radius": (),
    "fov": (),
    "aspect": (),
}
"""Shapes of the numbers that elements have, by field."""
_UNITS = {"axis": slice(0, 3), "pose": slice(3, 7)}
"""Which of the numbers have to be a unit vector or quaternion."""


def columns(items: Sequence[Any]) -> dict[str, Sequence[Any]]:
    """The fields of elements of one kind, each with its values in the order of the elements."""
    names = [field.name for field in dataclasses.fields(items[0])] if items else ()
    return {name: [getattr(item, name) for item in items] for name in names}


def impossible_number(fields: Mapping[str, Sequence[Any]]) -> tuple[int, str] | None:
    """The first of some elements with a number that nothing can have, and what is wrong with it;
    None if there is none.

    Args:
        fields: as :func:`columns` gives them; those without numbers are left out.
    """
    for name, values in fields.items():
        if name not in SHAPES or not len(values):
            continue
        for what, wrong, part in _wrong(name, values):
            if wrong.any():
                index = int(np.argmax(wrong))
                value = values[index]
                return index, f"{name} {what}: {value if part is None else tuple(value[part])}"
    return None


def _wrong(
    name: str, values: Sequence[Any]
) -> Iterator[tuple[str, NDArray[np.bool_], slice | None]]:
    """What can be wrong with a field, for which of its values it is so (N,), and in which part."""
    shape = SHAPES[name]
    table, malformed = _table(values, shape)
    with np.errstate(over="ignore", invalid="ignore"):
        axes = tuple(range(1, table.ndim))
        finite = np.isfinite(table).all(axis=axes) & ~malformed
        if not shape:
            yield "must be a number above 0", ~(finite & (table > 0)), None
            yield f"is beyond {LARGEST:g}", table > LARGEST, None
            return
        yield f"must be {shape[0]} finite numbers", ~finite, None
        yield f"is beyond {LARGEST:g}", (np.abs(table) > LARGEST).any(axis=axes), None
        if name == "half":
            yield "is negative", (table < 0).any(axis=1), None
        if (part := _UNITS.get(name)) is not None:
            length = np.linalg.norm(table[:, part], axis=1)
            yield "is not of unit length", ~(np.abs(length - 1.0) <= UNIT_TOLERANCE), part


def _table(values: Sequence[Any], shape: tuple[int, ...]) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Values as one array (N, ...), zeros where they are malformed, and where they are so (N,)."""
    with contextlib.suppress(ValueError):  # of several lengths
        table = np.asarray(values)
        if table.shape[1:] == shape and table.dtype.kind in "fiu":
            return table, np.zeros(len(values), bool)
    malformed = np.array([not _numbers(value, shape) for value in values])
    rows = [np.zeros(shape) if bad else v for v, bad in zip(values, malformed, strict=True)]
    return np.array(rows, float), malformed


def _numbers(value: Any, shape: tuple[int, ...]) -> bool:
    """Whether a value has this shape, and finite numbers in it."""
    array = np.asarray(value, dtype=object)
    try:
        return array.shape == shape and all(map(math.isfinite, array.flat))
    except (TypeError, OverflowError):  # no number, or more than a float can hold
        return False
