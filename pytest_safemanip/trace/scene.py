"""The static part of a trace: who is in the scene, and what of them moves."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from pytest_safemanip.errors import TraceError
from pytest_safemanip.trace.elements import (
    Body,
    Box,
    Entity,
    Joint,
    Part,
    Surface,
    Switch,
    Vector,
    check_numbers,
    numbers_fit,
)
from pytest_safemanip.trace.surfaces import Surfaces


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
        switches: in the order of the switch axis of the step arrays.
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
    switches: tuple[Switch, ...]
    surfaces: Sequence[Surface]
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

    @cached_property
    def solid(self) -> Surfaces:
        """The surfaces as arrays."""
        return Surfaces.of(self.surfaces)

    @cached_property
    def owned(self) -> Mapping[str, frozenset[int]]:
        """Indices of the contact parts of each entity that has any."""
        found: dict[str, set[int]] = {}
        for index, part in enumerate(self.parts):
            found.setdefault(part.entity, set()).add(index)
        return {entity: frozenset(parts) for entity, parts in found.items()}

    @cached_property
    def _moved(self) -> tuple[frozenset[int], ...]:
        found: dict[str, set[int]] = {}
        for index, part in enumerate(self.parts):
            found.setdefault(part.joint, set()).add(index)
        return tuple(frozenset(found.get(joint.key, ())) for joint in self.joints)

    def joints_of(self, entity: str) -> list[int]:
        """Indices of an entity's joints."""
        return [i for i, j in enumerate(self.joints) if j.entity == entity]

    def doors_of(self, entity: str) -> list[int]:
        """Indices of an entity's joints that give access to an interior."""
        return [i for i in self.joints_of(entity) if self.joints[i].gives_access]

    def moved_by(self, joint: int) -> frozenset[int]:
        """Indices of the contact parts that a joint moves."""
        return self._moved[joint]

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
        return dataclasses.asdict(dataclasses.replace(self, surfaces=tuple(self.surfaces)))

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
                switches=tuple(Switch(**s) for s in data["switches"]),
                surfaces=_surfaces(data["surfaces"]),
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
        if self._fault:
            raise TraceError(self._fault)
        return self

    @cached_property
    def _fault(self) -> str:
        """What is wrong; empty if nothing is. Found out once."""
        try:
            self._check()
        except TraceError as error:
            return str(error)
        return ""

    def _check(self) -> None:
        if not 0.0 < self.control_period < 10.0:
            raise TraceError(f"scene: control_period must be in (0, 10) s: {self.control_period}")
        names = [e.name for e in self.entities]
        if len(set(names)) != len(names):
            raise TraceError("scene: two entities have the same name")
        for field in ("bodies", "parts", "joints", "boxes", "switches", "surfaces"):
            items = getattr(self, field)
            if self._surely(items):
                continue
            for item in items:
                if item.entity not in self.entity:
                    raise TraceError(f"scene: {field} name an unknown entity {item.entity!r}")
                joint = getattr(item, "joint", "")
                if joint and joint not in self.joint_index:
                    raise TraceError(f"scene: {field} name an unknown joint {joint!r}")
                check_numbers(f"scene: {field} of {item.entity!r}", item)
        check_numbers("scene", self)
        for role, name in self.roles.items():
            if name not in self.entity:
                raise TraceError(f"scene: role {role!r} names an unknown entity {name!r}")

    def _surely(self, items: Sequence[Any]) -> bool:
        """Whether nothing is wrong with these, looked at together: that is several times faster."""
        if isinstance(items, Surfaces):
            entities, joints, fit = set(items.entities), set(items.joints), items.fit()
        else:
            entities = {item.entity for item in items}
            joints = {getattr(item, "joint", "") for item in items}
            fit = numbers_fit(items)
        return fit and self.entity.keys() >= entities and self.joint_index.keys() >= joints - {""}


def _surfaces(data: Surfaces | Sequence[Mapping[str, Any]]) -> Sequence[Surface]:
    if isinstance(data, Surfaces):
        return data
    return tuple(Surface(**_vectors(item)) for item in data)


def _vectors(item: Mapping[str, Any]) -> dict[str, Any]:
    return {k: tuple(v) if isinstance(v, list) else v for k, v in item.items()}
