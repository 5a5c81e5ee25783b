"""The static part of a trace: who is in the scene, and what of them moves.

World frame, metres, kilograms, radians; quaternions are ``wxyz``, as in MuJoCo.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

from pytest_safemanip.errors import TraceError

EntityKind = Literal["robot", "object", "fixture", "room"]
JointKind = Literal["hinge", "slide"]
Vector = tuple[float, ...]

ROBOT = "robot"
"""The robot's entity name. Parts: ``finger_left``, ``finger_right``, ``palm``, links, ``base``."""


@dataclass(frozen=True)
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


@dataclass(frozen=True)
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


@dataclass(frozen=True)
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


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class Box:
    """A named oriented box that belongs to a fixture; its pose is recorded at every step.

    Attributes:
        entity: the fixture.
        name: RoboCasa's name of the region or the handle.
        kind: ``interior`` (space that things are put in), ``handle`` or ``control``.
        half: half extents (3,), m.
    """

    entity: str
    name: str
    kind: Literal["interior", "handle", "control"]
    half: Vector


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class Scene:
    """Everything of a rollout that does not change while it runs.

    Attributes:
        control_period: seconds between two steps.
        entities: all of them, the robot included.
        bodies: the movable objects, in the order of the object axis of the step arrays.
        parts: the vocabulary of contacts; contacts refer to it by index.
        joints: in the order of the joint axis of the step arrays.
        boxes: in the order of the box axis of the step arrays.
        surfaces: the solid pieces of fixtures and room, for what lies below or in the way.
        gripper_half: half extents of the gripper's box (3,), m.
        gripper_centre: its centre in the end effector's frame (3,), m.
        roles: the task's own names for its objects and fixtures, to entity names.
    """

    control_period: float
    entities: tuple[Entity, ...]
    bodies: tuple[Body, ...]
    parts: tuple[Part, ...]
    joints: tuple[Joint, ...]
    boxes: tuple[Box, ...]
    surfaces: tuple[Surface, ...]
    gripper_half: Vector
    gripper_centre: Vector
    roles: Mapping[str, str]

    @cached_property
    def entity(self) -> Mapping[str, Entity]:
        """Entities by name."""
        return {e.name: e for e in self.entities}

    @cached_property
    def object_index(self) -> Mapping[str, int]:
        """Position of each object on the object axis."""
        return {b.entity: i for i, b in enumerate(self.bodies)}

    @cached_property
    def joint_index(self) -> Mapping[str, int]:
        """Position of each joint on the joint axis, by ``entity/joint``."""
        return {j.key: i for i, j in enumerate(self.joints)}

    def joints_of(self, entity: str) -> list[int]:
        """Indices of an entity's joints."""
        return [i for i, j in enumerate(self.joints) if j.entity == entity]

    def boxes_of(self, entity: str, kind: str) -> list[int]:
        """Indices of an entity's boxes of one kind."""
        return [i for i, b in enumerate(self.boxes) if b.entity == entity and b.kind == kind]

    def parts_of(self, entity: str, names: Sequence[str] | None = None) -> list[int]:
        """Indices of an entity's contact parts, all of them or the named ones."""
        return [
            i
            for i, p in enumerate(self.parts)
            if p.entity == entity and (names is None or p.name in names)
        ]

    def to_json(self) -> dict[str, Any]:
        """Plain builtins, for the recording's header."""
        return dataclasses.asdict(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Scene:
        """The inverse of :meth:`to_json`.

        Raises:
            TraceError: if a field is missing, unknown or of the wrong type.
        """
        try:
            return cls(
                control_period=float(data["control_period"]),
                entities=tuple(Entity(**e) for e in data["entities"]),
                bodies=tuple(Body(**_vectors(b)) for b in data["bodies"]),
                parts=tuple(Part(**p) for p in data["parts"]),
                joints=tuple(Joint(**_vectors(j)) for j in data["joints"]),
                boxes=tuple(Box(**_vectors(b)) for b in data["boxes"]),
                surfaces=tuple(Surface(**_vectors(b)) for b in data["surfaces"]),
                gripper_half=tuple(data["gripper_half"]),
                gripper_centre=tuple(data["gripper_centre"]),
                roles=dict(data["roles"]),
            ).checked()
        except (KeyError, TypeError, ValueError) as error:
            raise TraceError(f"scene: malformed description ({error})") from error

    def checked(self) -> Scene:
        """This scene, after checking that its names refer to one another.

        Raises:
            TraceError: naming the field and the entity that is wrong.
        """
        if not 0.0 < self.control_period < 10.0:
            raise TraceError(f"scene: control_period must be in (0, 10) s: {self.control_period}")
        names = [e.name for e in self.entities]
        if len(set(names)) != len(names):
            raise TraceError("scene: two entities have the same name")
        for field in ("bodies", "parts", "joints", "boxes", "surfaces"):
            for item in getattr(self, field):
                if item.entity not in self.entity:
                    raise TraceError(f"scene: {field} name an unknown entity {item.entity!r}")
                joint = getattr(item, "joint", "")
                if joint and joint not in self.joint_index:
                    raise TraceError(f"scene: {field} name an unknown joint {joint!r}")
                _check_numbers(f"scene: {field} of {item.entity!r}", item)
        _check_numbers("scene", self)
        for role, name in self.roles.items():
            if name not in self.entity:
                raise TraceError(f"scene: role {role!r} names an unknown entity {name!r}")
        return self


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


def _check_numbers(owner: str, item: object) -> None:
    """Vectors and numbers are as long as they must be, finite, and possible as what they are."""
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


def _vectors(item: Mapping[str, Any]) -> dict[str, Any]:
    return {k: tuple(v) if isinstance(v, list) else v for k, v in item.items()}
