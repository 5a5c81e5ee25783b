"""The static part of a trace: entities, and which of them move."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from pytest_safemanip.errors import TraceError
from pytest_safemanip.strategies import made_by
from pytest_safemanip.trace.elements import (
    ROBOT,
    ActionEntry,
    Body,
    Box,
    Camera,
    Entity,
    Gripper,
    Joint,
    Liquid,
    Part,
    Surface,
    Switch,
    columns,
    impossible_number,
)
from pytest_safemanip.trace.surfaces import Surfaces
from pytest_safemanip.trace.typed import from_json, is_number, mistyped, shown

MOST_PARTICLES = 10_000
"""Of a liquid."""
SHORTEST = 1e-4
"""Least control period, s: a deadline in shorter ones is more steps than a trace can have."""
ELEMENTS = (
    *("entities", "bodies", "parts", "joints", "boxes", "switches", "grippers", "actions"),
    *("cameras", "liquids"),
)
"""The fields with elements that are dataclasses each; surfaces may be columns."""


@made_by("scenes")
@dataclass(frozen=True)
class Scene:
    """The static part of a rollout.

    Attributes:
        control_period: seconds between two steps.
        entities: all of them, the robot included.
        bodies: the movable objects, in the order of the object axis of the step arrays.
        parts: the vocabulary of contacts; contacts refer to it by index.
        joints: in the order of the joint axis of the step arrays.
        boxes: in the order of the box axis of the step arrays.
        switches: in the order of the switch axis of the step arrays.
        surfaces: the solid pieces of fixtures and room, for what lies below or in the way.
        grippers: in the order of the gripper axis of the step arrays.
        actions: what the robot's actions consist of, in their order.
        roles: the task's own names for its objects and fixtures, to entity names.
        cameras: what policies may see through, in the order of the camera axis of the step arrays.
        liquids: their particles, one liquid after the other, are the particle axis of the step
            arrays.
    """

    control_period: float
    entities: tuple[Entity, ...]
    bodies: tuple[Body, ...]
    parts: tuple[Part, ...]
    joints: tuple[Joint, ...]
    boxes: tuple[Box, ...]
    switches: tuple[Switch, ...]
    surfaces: Sequence[Surface]
    grippers: tuple[Gripper, ...]
    actions: tuple[ActionEntry, ...]
    roles: Mapping[str, str]
    cameras: tuple[Camera, ...] = ()
    liquids: tuple[Liquid, ...] = ()

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
    def particles(self) -> Mapping[str, slice]:
        """The particles of each liquid on the particle axis."""
        found, first = {}, 0
        for liquid in self.liquids:
            found[liquid.entity] = slice(first, first + liquid.count)
            first += liquid.count
        return found

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
                control_period=data["control_period"],
                entities=from_json(Entity, data["entities"], "entities"),
                bodies=from_json(Body, data["bodies"], "bodies"),
                parts=from_json(Part, data["parts"], "parts"),
                joints=from_json(Joint, data["joints"], "joints"),
                boxes=from_json(Box, data["boxes"], "boxes"),
                switches=from_json(Switch, data["switches"], "switches"),
                surfaces=_surfaces(data["surfaces"]),
                grippers=from_json(Gripper, data["grippers"], "grippers"),
                actions=from_json(ActionEntry, data["actions"], "actions"),
                roles=data["roles"],
                cameras=from_json(Camera, data["cameras"], "cameras"),
                liquids=from_json(Liquid, data["liquids"], "liquids"),
            ).checked()
        except KeyError as error:
            raise TraceError(f"scene: malformed description ({error} is missing)") from error

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
        """The first inconsistency; empty if there is none. Computed once."""
        try:
            self._check()
        except TraceError as error:
            return str(error)
        return ""

    def _check(self) -> None:
        self._check_types()
        if not SHORTEST <= self.control_period < 10.0:
            raise TraceError(
                f"scene: control_period must be in [{SHORTEST}, 10) s: {self.control_period}"
            )
        names = [e.name for e in self.entities]
        if "" in names:
            raise TraceError("scene: an entity has no name")
        if len(set(names)) != len(names):
            raise TraceError("scene: two entities have the same name")
        for field in ("bodies", "parts", "joints", "boxes", "switches", "surfaces"):
            self._check_elements(field)
        self._check_grippers()
        self._check_actions()
        self._check_cameras()
        self._check_liquids()
        for role, name in self.roles.items():
            if name not in self.entity:
                raise TraceError(f"scene: role {role!r} names an unknown entity {name!r}")

    def _check_types(self) -> None:
        """What names something is a text, so that everything after can rely on it."""
        if not is_number(self.control_period):
            raise TraceError(
                f"scene: control_period must be a number, found {shown(self.control_period)}"
            )
        for field in ELEMENTS:
            if fault := mistyped(getattr(self, field)):
                raise TraceError(f"scene: {field}{fault}")
        if isinstance(self.surfaces, Surfaces):
            names = {*map(type, self.surfaces.entities), *map(type, self.surfaces.joints)}
            if names - {str}:
                raise TraceError("scene: surfaces: entity and joint must be lists of texts")
        elif fault := mistyped(self.surfaces):
            raise TraceError(f"scene: surfaces{fault}")
        roles = self.roles
        if {*map(type, _values(roles))} - {str}:
            raise TraceError(f"scene: roles must be a mapping to texts, found {shown(roles)}")
        if strange := [role for role in roles if not role.isprintable()]:
            raise TraceError(f"scene: {shown(strange[0])} is no name of a role")

    def _check_grippers(self) -> None:
        known = {part.name for part in self.parts if part.entity == ROBOT}
        if len({gripper.name for gripper in self.grippers}) != len(self.grippers):
            raise TraceError("scene: two grippers have the same name")
        taken: set[str] = set()
        for gripper in self.grippers:
            what = f"scene: gripper {gripper.name!r}"
            if len(gripper.fingers) == 1 or not all(gripper.fingers):
                raise TraceError(
                    f"{what} needs two groups of fingers or more, none of them empty, or no fingers"
                )
            for part in gripper.parts:
                if part not in known:
                    raise TraceError(f"{what} names a part {part!r} that the robot does not have")
                if part in taken:
                    raise TraceError(f"{what} names a part {part!r} that is named twice")
                taken.add(part)
        if found := impossible_number(columns(self.grippers)):
            raise TraceError(f"scene: gripper {self.grippers[found[0]].name!r}: {found[1]}")

    def _check_actions(self) -> None:
        if len({entry.name for entry in self.actions}) != len(self.actions):
            raise TraceError("scene: two entries of the action have the same name")
        for entry in self.actions:
            if not -math.inf < entry.low < entry.high < math.inf:
                raise TraceError(
                    f"scene: action {entry.name!r} must have finite limits, the lower one first: "
                    f"{entry.low}, {entry.high}"
                )

    def _check_cameras(self) -> None:
        if len({camera.name for camera in self.cameras}) != len(self.cameras):
            raise TraceError("scene: two cameras have the same name")
        if found := impossible_number(columns(self.cameras)):
            raise TraceError(f"scene: camera {self.cameras[found[0]].name!r}: {found[1]}")
        for camera in self.cameras:
            if camera.fov >= math.pi:
                raise TraceError(f"scene: camera {camera.name!r}: fov must be below pi")

    def _check_liquids(self) -> None:
        self._check_elements("liquids")
        for liquid in self.liquids:
            if self.entity[liquid.entity].kind != "liquid":
                raise TraceError(f"scene: liquids: {liquid.entity!r} is no liquid")
            if not 1 <= liquid.count <= MOST_PARTICLES:
                raise TraceError(
                    f"scene: liquid {liquid.entity!r} must have 1 to {MOST_PARTICLES} particles: "
                    f"{liquid.count}"
                )
        if len(self.particles) != len(self.liquids):
            raise TraceError("scene: liquids: an entity is named twice")

    def _check_elements(self, field: str) -> None:
        """Check the elements of one kind, all together: that is several times faster."""
        items = getattr(self, field)
        values = items.columns() if isinstance(items, Surfaces) else columns(items)
        for reference, known in (("entity", self.entity), ("joint", {"", *self.joint_index})):
            unknown = set(values.get(reference, ())).difference(known)
            if unknown:
                raise TraceError(f"scene: {field} name an unknown {reference} {min(unknown)!r}")
        if found := impossible_number(values):
            index, what = found
            raise TraceError(f"scene: {field} of {values['entity'][index]!r}: {what}")


def _values(mapping: object) -> Iterable[object]:
    """The values of what should be a mapping; nothing that is a text of what is none."""
    return mapping.values() if isinstance(mapping, Mapping) else (None,)


def _surfaces(data: Surfaces | Sequence[Mapping[str, Any]]) -> Sequence[Surface]:
    if isinstance(data, Surfaces):
        return data
    return from_json(Surface, data, "surfaces")
