"""What a user says of a source whose names do not say it.

    objects:
      mug: {body: thing_17, category: mug}
    room: [decoration]
    roles: {receiver: tray}
    robot: [arm_base]
    hands:
      right:
        frame: grip_site
        palm: [hand]
        fingers:
          left: [finger_1]
          right: [finger_2]
        joints:
          finger_joint: {closed: 0.0, opened: 0.04}
        entry: gripper_close

All keys are optional. ``objects`` are added, or told apart from what their names say; ``room`` are
things that are no objects and fixtures of the task; ``robot`` are the bodies that robots hang on;
``hands`` stand for those that were found. ``entry`` is the entry of the action that commands a
hand, ``opens`` and ``closes`` are its values that do so (-1 and 1).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pytest_safemanip.sim.backend import GripperSpec
from pytest_safemanip.sim.mujoco.layout import FingerJoint, HandLayout, Layout, ObjectLayout
from pytest_safemanip.spec import yamlfile
from pytest_safemanip.spec.yamlfile import Section

_KEYS = ("objects", "room", "roles", "robot", "hands")
_HAND = ("frame", "palm", "fingers", "joints")
CLOSE = "gripper_close"
"""The entry of an action that commands a gripper, where nothing else is said."""


@dataclass(frozen=True)
class Bindings:
    """What a user says.

    Attributes:
        objects: by name.
        room: names of what is neither an object nor a fixture.
        roles: the task's own names of objects and fixtures.
        robot: bodies that robots hang on; empty for those that are found.
        hands: likewise.
    """

    objects: Mapping[str, ObjectLayout] = field(default_factory=dict)
    room: tuple[str, ...] = ()
    roles: Mapping[str, str] = field(default_factory=dict)
    robot: tuple[str, ...] = ()
    hands: tuple[HandLayout, ...] = ()

    def apply(self, layout: Layout) -> Layout:
        """A layout, and what the user says of it."""
        bodies = {thing.body for thing in self.objects.values()}
        found = {
            name: thing
            for name, thing in layout.objects.items()
            if name not in self.room and thing.body not in bodies
        }
        fixtures = {
            name: fixture
            for name, fixture in layout.fixtures.items()
            if name not in self.room and not bodies & {*fixture.bodies}
        }
        return dataclasses.replace(
            layout,
            objects={**found, **self.objects},
            fixtures=fixtures,
            roles={**layout.roles, **self.roles},
        )


def read_bindings(path: Path | None) -> Bindings:
    """What a file says; nothing without one.

    Raises:
        ConfigError: something in it is wrong; the message begins with file and line.
    """
    if path is None:
        return Bindings()
    section = yamlfile.load(path)
    section.check_keys((), _KEYS)
    return Bindings(
        objects={name: _object(things.section(name)) for things, name in _in(section, "objects")},
        room=section.strings("room") if "room" in section else (),
        roles={role: roles.string(role) for roles, role in _in(section, "roles")},
        robot=section.strings("robot") if "robot" in section else (),
        hands=tuple(
            _hand(name, hands.section(name), len(list(hands)))
            for hands, name in _in(section, "hands")
        ),
    )


def _in(section: Section, key: str) -> list[tuple[Section, str]]:
    """The keys of a mapping, each with it."""
    if key not in section:
        return []
    inner = section.section(key)
    return [(inner, name) for name in inner]


def _object(section: Section) -> ObjectLayout:
    section.check_keys(("body", "category"))
    return ObjectLayout(section.string("body"), section.string("category"))


def _hand(name: str, section: Section, hands: int) -> HandLayout:
    section.check_keys(_HAND, ("entry", "opens", "closes"))
    label = f"{name}_" if hands > 1 else ""
    fingers = section.section("fingers")
    joints = []
    for joints_of, joint in _in(section, "joints"):
        ends = joints_of.section(joint)
        ends.check_keys(("closed", "opened"))
        joints.append(FingerJoint(joint, ends.number("closed"), ends.number("opened")))
    return HandLayout(
        GripperSpec(
            name,
            tuple((f"{label}finger_{side}",) for side in fingers),
            (f"{label}palm",),
            section.string("entry") if "entry" in section else f"{label}{CLOSE}",
            section.number("opens") if "opens" in section else -1.0,
            section.number("closes") if "closes" in section else 1.0,
        ),
        frame=section.string("frame"),
        fingers=tuple(fingers.strings(side) for side in fingers),
        palm=section.strings("palm"),
        joints=tuple(joints),
    )
