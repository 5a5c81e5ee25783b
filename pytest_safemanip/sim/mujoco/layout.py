"""What is what in a compiled model: declared by who knows it, read by :mod:`.describing`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.sim.backend import GripperSpec
from pytest_safemanip.trace.elements import ActionEntry, Vector

ROOM = "room"
"""Name of the entity that everything else belongs to that collides and does not move."""


@dataclass(frozen=True)
class FingerJoint:
    """A joint of a hand.

    Attributes:
        name: in the model.
        closed: its position when the hand is closed, rad or m.
        opened: when it is open.
    """

    name: str
    closed: float
    opened: float


@dataclass(frozen=True)
class HandLayout:
    """A hand of the robot.

    Attributes:
        spec: what the backend declares of it.
        frame: the site, or the body, that is the end effector.
        fingers: the bodies of each finger group, in the order of ``spec.fingers``; what hangs on
            them belongs to the group.
        palm: the other bodies of the hand, with what hangs on them.
        joints: opening is the mean over these.
    """

    spec: GripperSpec
    frame: str
    fingers: tuple[tuple[str, ...], ...]
    palm: tuple[str, ...]
    joints: tuple[FingerJoint, ...]


@dataclass(frozen=True)
class RobotLayout:
    """The robot, or several that act together.

    Attributes:
        name: its model.
        bodies: what hangs on these is the robot's; its parts have the names of the bodies.
        hands: any number.
        base: the body that its base is.
    """

    name: str
    bodies: tuple[str, ...]
    hands: tuple[HandLayout, ...]
    base: str


@dataclass(frozen=True)
class ObjectLayout:
    """A thing that moves freely.

    Attributes:
        body: its pose is the object's, and what hangs on it belongs to it.
        category: what it is, as in ``tasks/objects.yaml``.
    """

    body: str
    category: str


@dataclass(frozen=True)
class JointLayout:
    """A door, a drawer or a control.

    Attributes:
        closed: position at openness 0, rad or m.
        opened: position at openness 1.
        gives_access: whether opening it opens an interior.
    """

    closed: float
    opened: float
    gives_access: bool = False


@dataclass(frozen=True)
class Region:
    """A box that moves with a body.

    Attributes:
        body: its name.
        half: half extents (3,), m.
        centre: in the body's frame (3,), m.
        quat: ``wxyz``, in the body's frame.
    """

    body: str
    half: Vector
    centre: Vector = (0.0, 0.0, 0.0)
    quat: Vector = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class FixtureLayout:
    """Furniture or an appliance.

    Attributes:
        bodies: what hangs on these belongs to it.
        category: what it is.
        joints: those that it has, by name in the model. What another moves, as a handle on its
            spindle, is moved by the next of these above it.
        parts: names of parts by the geom or the body that they are (``handle``, ``button``);
            the rest of what a joint moves is a ``door`` or a ``drawer``, and what nothing moves is
            ``body``.
        interiors: spaces that things are put in, by name: a geom or a site, whose size it has, or
            a box that is told.
        handles: boxes of handles, likewise.
        controls: boxes of knobs and buttons, likewise.
        burners: spaces that burners heat, likewise, named like their switches.
        attributes: see :class:`~pytest_safemanip.trace.elements.Entity`.
    """

    bodies: tuple[str, ...]
    category: str
    joints: Mapping[str, JointLayout] = field(default_factory=dict)
    parts: Mapping[str, str] = field(default_factory=dict)
    interiors: Mapping[str, str | Region] = field(default_factory=dict)
    handles: Mapping[str, str | Region] = field(default_factory=dict)
    controls: Mapping[str, str | Region] = field(default_factory=dict)
    burners: Mapping[str, str | Region] = field(default_factory=dict)
    attributes: tuple[str, ...] = ()


@dataclass(frozen=True)
class LiquidLayout:
    """A liquid, as small bodies that move freely.

    Attributes:
        bodies: its particles, each a sphere.
        category: what it is, such as ``water``.
    """

    bodies: tuple[str, ...]
    category: str


@dataclass(frozen=True)
class Layout:
    """What is what in a compiled model. A body is whose the nearest declared body above it is.

    Attributes:
        control_period: s.
        robot: at least one body of it.
        actions: what its actions consist of.
        objects: by name.
        fixtures: by name.
        roles: the task's own names; every object and fixture is its own beside them.
        cameras: what policies may see through, by name in the model: width of an image over its
            height.
        liquids: by name.
    """

    control_period: float
    robot: RobotLayout
    actions: tuple[ActionEntry, ...]
    objects: Mapping[str, ObjectLayout]
    fixtures: Mapping[str, FixtureLayout] = field(default_factory=dict)
    roles: Mapping[str, str] = field(default_factory=dict)
    cameras: Mapping[str, float] = field(default_factory=dict)
    liquids: Mapping[str, LiquidLayout] = field(default_factory=dict)

    def check(self) -> None:
        """Refuse what contradicts itself, whatever the model has.

        Raises:
            ConfigError: naming the hand or the fixture.
        """
        if not 0.0 < self.control_period < math.inf:
            raise ConfigError(f"control_period: {self.control_period:g} s, expected more than 0")
        names = [entry.name for entry in self.actions]
        for hand in self.robot.hands:
            spec, what = hand.spec, f"hand {hand.spec.name!r}"
            if spec.entry and spec.entry not in names:
                hint = did_you_mean(spec.entry, names)
                raise ConfigError(f"{what}: no entry of the actions is {spec.entry!r}; {hint}")
            if spec.closes == spec.opens:
                raise ConfigError(f"{what}: what opens it, {spec.opens:g}, closes it, too")
            if len(spec.fingers) != len(hand.fingers):
                raise ConfigError(
                    f"{what}: {len(spec.fingers)} finger groups, and bodies of {len(hand.fingers)}"
                )
            for finger in hand.joints:
                _check_way(what, finger.name, finger)
        for name, fixture in self.fixtures.items():
            for joint, way in fixture.joints.items():
                _check_way(f"fixture {name!r}", joint, way)


def _check_way(what: str, joint: str, way: FingerJoint | JointLayout) -> None:
    if not math.isfinite(way.opened - way.closed) or way.opened == way.closed:
        raise ConfigError(
            f"{what}: joint {joint!r} is closed at {way.closed:g} and opened at {way.opened:g}"
        )
