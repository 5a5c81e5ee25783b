"""Objects and fixtures, as a script sees them: where they are now, from the newest step."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.trace.elements import Joint, Switch
from pytest_safemanip.trace.geometry import corners, matrix, to_world
from pytest_safemanip.trace.kinematics import carried

Space = tuple[Array, Array]
"""Pose (7,) and half extents (3,) of an interior."""
HEAPED, LOWER = 0.01, 0.003
"""Between two things that lie on one another, and by how much what lies in something seems to reach
below that, m, at most."""
ROOM_HEIGHT = 3.0
"""RoboCasa parks what it removes from a fixture 10 m up."""


class Thing:
    """A movable object.

    Args:
        arm: gives the newest step.
        role: the task's name for it, or the name of its entity.

    Attributes:
        entity: its entity.

    Raises:
        ConfigError: if it is a fixture.
    """

    def __init__(self, arm: Arm, role: str) -> None:
        self._arm = arm
        self.entity = arm.scene.roles.get(role, role)
        if self.entity not in arm.scene.object_index:
            raise ConfigError(f"{role} is a fixture, and an object is wanted there")
        self._index = arm.scene.object_index[self.entity]
        self._body = arm.scene.bodies[self._index]

    @property
    def pose(self) -> Array:
        """Pose of its frame (7,)."""
        return np.asarray(self._arm.step.object_pose[self._index], np.float64)

    @property
    def middle(self) -> Array:
        """Origin of its frame (3,): the middle of a vessel, its handle left out."""
        return self.pose[:3]

    @property
    def centre(self) -> Array:
        """Centre of its box (3,)."""
        return np.asarray(to_world(self.pose, self._body.centre), np.float64)

    @property
    def com(self) -> Array:
        """Centre of mass (3,)."""
        return np.asarray(to_world(self.pose, self._body.com), np.float64)

    @property
    def half(self) -> Array:
        """Half the sides of its box, m (3,)."""
        return np.array(self._body.half)

    @property
    def corners(self) -> Array:
        """Corners of its box (8, 3)."""
        points = corners(self.pose, self._body.half, self._body.centre)
        return np.asarray(points, np.float64)

    @property
    def bottom(self) -> float:
        """Height of its lowest corner, m."""
        return float(self.corners[:, 2].min())

    @property
    def underside(self) -> float:
        """Height of its underside, as if its box were rounded, m: a ball that turns keeps it."""
        return float(self.centre[2]) - self.reach(np.array((0.0, 0.0, -1.0)))

    @property
    def highest(self) -> float:
        """Height of its highest corner, m."""
        return float(self.corners[:, 2].max())

    @property
    def height(self) -> float:
        """Vertical extent of its box, m."""
        return float(np.ptp(self.corners[:, 2]))

    @property
    def top(self) -> Array:
        """Middle of its upper side (3,)."""
        return np.append(self.centre[:2], self.bottom + self.height)

    def reach(self, direction: Array) -> float:
        """How far it reaches from its centre along a unit vector, as if its box were rounded, m."""
        axes = matrix(self.pose[3:])
        return float(np.linalg.norm((direction @ axes) * self._body.half))

    @property
    def longest(self) -> Array:
        """The axis of its box along which it reaches farthest, a unit vector (3,)."""
        axes = np.asarray(matrix(self.pose[3:])).T
        return np.asarray(max(axes, key=self.reach))

    def around(self, points: Array) -> NDArray[np.bool_]:
        """Whether some points (P, 3) are in it, as if the edges of its box were round (P,)."""
        own = (points - self.centre) @ matrix(self.pose[3:]) / self._body.half
        return np.asarray(np.sum(own**4, axis=1) < 1.0)

    def extent_ahead(self) -> tuple[float, float]:
        """Nearest and farthest corner along the base's forward direction, m."""
        along = [self._arm.ahead(corner) for corner in self.corners]
        return min(along), max(along)

    def sides(self) -> list[tuple[Array, float]]:
        """Horizontal box axes with the width along each, narrowest first: (3,), m."""
        axes = matrix(self.pose[3:])
        upright = int(np.argmax(np.abs(axes[2])))
        flat = [k for k in range(3) if k != upright]
        found = [(np.asarray(axes[:, k]), 2.0 * self._body.half[k]) for k in flat]
        return sorted(found, key=lambda side: side[1])

    def sides_about_middle(self) -> list[tuple[Array, float]]:
        """Likewise as wide as it is evenly about its middle: a vessel's handle left out."""
        out = self.centre - self.middle
        even = [
            (axis, max(0.0, width - 2.0 * abs(float(out @ axis)))) for axis, width in self.sides()
        ]
        return sorted(even, key=lambda side: side[1])


def other_things(arm: Arm, *own: Thing) -> list[Thing]:
    """All objects but some."""
    known = {thing.entity for thing in own}
    return [Thing(arm, body.entity) for body in arm.scene.bodies if body.entity not in known]


def contents(arm: Arm, vessel: Thing) -> list[Thing]:
    """What lies in an object, or on it, or on what does."""
    axes = matrix(vessel.pose[3:])
    half = vessel.half
    upright = int(np.argmax(np.abs(axes[2])))
    near = list[tuple[float, Thing]]()
    for thing in other_things(arm, vessel):
        own = (thing.centre - vessel.centre) @ axes
        height = float(own[upright]) * math.copysign(1.0, axes[2, upright])
        # A plate under something small is not in it, nor a bowl around it; of what leans in it, the
        # box may reach lower.
        leans = height > 0.0 and math.prod(thing.half) < math.prod(half)
        high = leans or thing.bottom > vessel.bottom - LOWER
        if np.delete(np.abs(own) - half, upright).max() < 0.0 and high:
            near.append((height - thing.height / 2.0, thing))
    found, top = list[Thing](), float(half[upright])
    for bottom, thing in sorted(near, key=lambda one: one[0]):
        if bottom < top + HEAPED:
            found.append(thing)
            top = max(top, bottom + thing.height)
    return found


def spaces_around(arm: Arm, thing: Thing, slack: float = 0.0) -> list[tuple[str, Space]]:
    """The interiors that a thing's middle is in, or so near to, m, with what they belong to."""
    found = []
    for box, pose in zip(arm.scene.boxes, np.asarray(arm.step.box_pose, np.float64), strict=True):
        own = (thing.centre - pose[:3]) @ matrix(pose[3:])
        if box.kind == "interior" and (np.abs(own) < np.array(box.half) + slack).all():
            found.append((box.entity, (pose, np.array(box.half))))
    return found


class Part(StrEnum):
    """What of a fixture is moved, by what RoboCasa calls its joint, or how those names begin."""

    RACK = "rack"
    MIXER_HEAD = "head_joint"
    SPOUT = "spout_joint"
    TAP_LEVER = "handle_joint"
    TOASTER_LEVER = "lever"
    SWITCH = "switch"
    TIMER = "knob_time_joint"


def _named(part: str) -> str:
    return part.name.lower().replace("_", " ") if isinstance(part, Part) else part


START_BUTTON = "start_button"
"""How RoboCasa calls the controls that start an appliance."""
AJAR = 0.3
"""Openness from which one gets in behind a door."""
PRESSED = 0.005
"""How far a control goes in of which nothing is known, m."""
TRAY_AROUND = 0.03
"""A cup stands no higher than this above where a machine is said to pour, m."""


class Furniture:
    """A fixture with doors, drawers, controls or an interior.

    Args:
        arm: gives the newest step.
        role: the task's name for it, or the name of its entity.

    Raises:
        ConfigError: if it is an object.
    """

    def __init__(self, arm: Arm, role: str) -> None:
        self._arm = arm
        self.entity = arm.scene.roles.get(role, role)
        if self.entity in arm.scene.object_index:
            raise ConfigError(f"{role} is an object, and a fixture is wanted there")

    def tray(self) -> Array:
        """Where it pours, at the height of what a cup stands on there (3,)."""
        (pose, _), slabs = self._box("poured"), np.array(solid(self._arm, {self.entity}))
        low, high = slabs.min(axis=1), slabs.max(axis=1)
        below = (low[:, :2] < pose[:2]) & (high[:, :2] > pose[:2])
        tops = high[below.all(axis=1) & (high[:, 2] < pose[2] + TRAY_AROUND), 2]
        return np.append(pose[:2], tops.max(initial=0.0))

    def doors(self) -> list[Joint]:
        """Its doors and drawers."""
        return [joint for joint in self.joints() if joint.gives_access]

    def joint(self, part: str) -> Joint:
        """The joint of the one such part (:class:`Part`) that it has, or of a door by its name.

        Raises:
            SkillFailed: if it has none.
        """
        scene, key = self._arm.scene, f"{self.entity}/{part}"
        if key not in scene.joint_index:
            self.lacks(part)
        return scene.joints[scene.joint_index[key]]

    def only(self, part: str) -> Joint:
        """The joint of the only part of a kind.

        Raises:
            SkillFailed: if it has none or several.
        """
        found = self.joints(part)
        if len(found) > 1:
            raise SkillFailed(f"{self.entity} has {len(found)} parts of the kind {_named(part)}")
        return found[0] if found else self.lacks(part)

    def lacks(self, part: str) -> NoReturn:
        """Say that it has no such part.

        Raises:
            SkillFailed: always.
        """
        raise SkillFailed(f"{self.entity} has no {_named(part)}")

    def joints(self, part: str = "") -> list[Joint]:
        """The joints of all such parts, or of all parts."""
        scene = self._arm.scene
        own = [scene.joints[k] for k in scene.joints_of(self.entity)]
        return [joint for joint in own if joint.name.startswith(part)]

    def burners(self) -> list[int]:
        """Indices of the boxes over its burners.

        Raises:
            SkillFailed: if it has none.
        """
        return self._arm.scene.boxes_of(self.entity, "burner") or self.lacks("burner")

    def burning(self) -> list[Joint]:
        """The knobs of its burners that are on.

        Raises:
            SkillFailed: if it has no burners.
        """
        scene = self._arm.scene
        self.burners()
        knobs = [switch.joint for switch, on in self._switches() if switch.joint and on]
        return [scene.joints[scene.joint_index[knob]] for knob in knobs]

    def off(self) -> bool:
        """Whether it has switches, and none of them is on."""
        found = self._switches()
        return bool(found) and not any(on for _, on in found)

    def knob_under(self, point: Array) -> Joint:
        """The knob of the burner that is nearest to a point.

        Raises:
            SkillFailed: if it has no burners.
        """
        scene, poses = self._arm.scene, self._arm.step.box_pose
        nearest = min(self.burners(), key=lambda k: float(np.linalg.norm(poses[k][:2] - point[:2])))
        name = scene.boxes[nearest].name
        (knob,) = [switch.joint for switch, _ in self._switches() if switch.name == name]
        return scene.joints[scene.joint_index[knob]]

    def extent(self) -> tuple[Array, Array]:
        """Lowest and highest corner (3,) of what does not move of it."""
        points = np.concatenate(solid(self._arm, {self.entity}, moving=False))
        return points.min(axis=0), points.max(axis=0)

    def upper_rack(self) -> Joint:
        """The rack that slides out uppermost.

        Raises:
            SkillFailed: if it has none.
        """
        racks = self.joints(Part.RACK) or self.lacks(Part.RACK)
        return max(racks, key=lambda rack: rack.pose[2])

    def button(self, name: str) -> Joint:
        """A control that nothing is known to move, as if it slid in (:data:`PRESSED`).

        Raises:
            SkillFailed: if it has none.
        """
        pose, half = self.control(name)
        forward, where = tuple(self._arm.onward(1.0).tolist()), tuple(pose.tolist())
        return Joint(
            self.entity, name, "slide", False, forward, where[:3], PRESSED, tuple(half), where
        )

    def openness(self, joint: Joint) -> float:
        """How open a joint is: 0 closed, 1 open; 0 where nothing is known to move."""
        number = self._arm.scene.joint_index.get(joint.key)
        return 0.0 if number is None else float(self._arm.step.joint[number, 0])

    def handle(self, joint: Joint) -> tuple[Array, Array]:
        """Pose (7,) and half extents (3,) of what one takes hold of on a door or drawer: across it,
        away from it, and up.

        Raises:
            SkillFailed: if it has none.
        """
        return self._box("handle", joint.name)

    def control(self, name: str) -> tuple[Array, Array]:
        """Pose (7,) and half extents (3,) of a control, by name."""
        return self._box("control", name)

    def interior(self, around: Array | None = None) -> tuple[Array, Array]:
        """Pose (7,) and half extents (3,) of its lowest interior, or of the one around a point."""
        if around is None:
            return self._box("interior")

        def outside(box: tuple[Array, Array]) -> float:
            pose, half = box
            own = (around - pose[:3]) @ matrix(pose[3:])
            return float(np.maximum(np.abs(own) - half, 0.0).sum())

        return min(self.interiors(), key=outside)

    def interiors(self, behind: Joint | None = None) -> list[tuple[Array, Array]]:
        """Pose (7,) and half extents (3,) of its interiors, lowest first.

        Args:
            behind: a door of a fridge or freezer; None for the interiors behind all doors.
        """
        prefix = f"{behind.name.partition('_')[0]}_shelf" if behind else ""
        found = [(box.pose, box.half) for box in self.boxes("interior", prefix)]
        return sorted(found, key=lambda box: float(box[0][2]))

    def open_interiors(self) -> list[tuple[Array, Array]]:
        """Likewise of those that an open door gives access to; all where none is known to."""
        doors = [door for door in self.doors() if self.openness(door) > AJAR]
        known = [box for door in doors for box in self.interiors(door)]
        return sorted(known or self.interiors(), key=lambda box: float(box[0][2]))

    def water(self) -> tuple[Array, Array]:
        """Pose (7,) and half extents (3,) of the space that a tap's water falls through."""
        return self._box("water")

    def opening(self) -> tuple[float, float]:
        """Where its lowest interior begins along the base's forward direction, and the height of
        its floor, m.
        """
        pose, half = self.interior()
        return self._arm.ahead(pose) - float(half[1]), float(pose[2] - half[2])

    def boxes(self, kind: str, name: str = "") -> list[Piece]:
        """All of a kind, and of a name."""
        scene, poses = self._arm.scene, self._arm.step.box_pose
        return [
            Piece(np.asarray(poses[k], np.float64), np.array(scene.boxes[k].half))
            for k in scene.boxes_of(self.entity, kind)
            if scene.boxes[k].name.startswith(name)
        ]

    def _switches(self) -> list[tuple[Switch, bool]]:
        """Its switches, and whether each is on."""
        switches = zip(self._arm.scene.switches, self._arm.step.switch > 0.0, strict=True)
        return [(switch, bool(on)) for switch, on in switches if switch.entity == self.entity]

    def _box(self, kind: str, name: str = "") -> tuple[Array, Array]:
        """The lowest of a kind, and of a name."""
        found = self.boxes(kind, name)
        if not found:
            raise SkillFailed(f"{self.entity} has no {name} {kind}")
        lowest = min(found, key=lambda box: float(box.pose[2]))
        return lowest.pose, lowest.half


@dataclass(frozen=True)
class Piece:
    """A solid box.

    Attributes:
        pose: of its middle (7,).
        half: half extents (3,), m.
    """

    pose: Array
    half: Array

    @property
    def centre(self) -> Array:
        """Its middle (3,)."""
        return self.pose[:3]

    @cached_property
    def axes(self) -> Array:
        """Its frame, axes as columns (3, 3)."""
        return np.asarray(matrix(self.pose[3:]), np.float64)

    def reach(self, direction: Array) -> float:
        """How far it reaches from its middle along a unit vector (3,), m."""
        return float(self.half @ np.abs(direction @ self.axes))

    def around(self, point: Array, room: float = 0.005) -> bool:
        """Whether a point (3,) is in it."""
        return bool((np.abs((point - self.centre) @ self.axes) < self.half + room).all())


def pieces(arm: Arm, joint: Joint, openness: float) -> list[Piece]:
    """The solid pieces that a joint moves, where they are at an openness; the box around them where
    there are none.
    """
    own = {
        tuple(np.round((*s.pose, *s.half), 4).tolist()): s
        for s in arm.scene.surfaces
        if s.joint == joint.key
    }
    at = np.array(openness)
    return [
        Piece(np.asarray(carried(joint, np.array(s.pose), at)), np.array(s.half))
        for s in own.values()
    ] or [Piece(np.asarray(carried(joint, np.array(joint.pose), at)), np.array(joint.half))]


def counter(arm: Arm, role: str) -> tuple[float, float]:
    """Height of a counter, and where it begins along the forward direction, m."""
    boxes = solid(arm, {arm.scene.roles.get(role, "")})
    if not boxes:
        raise SkillFailed(f"the task has no {role}")
    points = np.concatenate(boxes)
    return float(points[:, 2].max()), min(arm.ahead(point) for point in points)


def solid(arm: Arm, entities: Collection[str], moving: bool = True) -> list[Array]:
    """Corners of the solid pieces of some fixtures, closed, each (8, 3); with those that a joint
    moves or without.
    """
    return [
        np.asarray(corners(np.array(s.pose), s.half), np.float64)
        for s in arm.scene.surfaces
        if s.entity in entities and s.pose[2] < ROOM_HEIGHT and (moving or not s.joint)
    ]
