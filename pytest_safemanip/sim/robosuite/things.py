"""What is what in a model that robosuite has compiled, by the names of its bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import mujoco

from pytest_safemanip.sim.mujoco.layout import (
    FingerJoint,
    FixtureLayout,
    HandLayout,
    JointLayout,
    Layout,
    ObjectLayout,
    Region,
    RobotLayout,
)
from pytest_safemanip.sim.robosuite.robots import Arm
from pytest_safemanip.trace.elements import ActionEntry

CATEGORIES: Mapping[str, str] = MappingProxyType(
    {
        "cube": "cube",
        "cubeA": "cube",
        "cubeB": "cube",
        "Milk": "milk",
        "Bread": "bread",
        "Cereal": "cereal",
        "Can": "can",
        "SquareNut": "nut",
        "RoundNut": "nut",
        "pot": "pot",
        "hammer": "hammer",
    }
)
"""Of robosuite's objects, as in ``tasks/objects.yaml``."""
_ROOTS = ("_main", "_root")
"""What robosuite puts behind an object's name for the body that all of it hangs on."""
_WALL, _HALF, _DEPTH = 0.01, (0.2, 0.25), 0.04
"""Of a bin: half thickness of its walls, half extents between their middles, half of how far they
rise above its floor, m (robosuite's ``arenas/bins_arena.xml``)."""
_FLOOR = 0.02
"""Height of a bin's floor above the middle of its body, m."""


def layout(
    model: Any,
    robots: Sequence[str],
    arms: Sequence[Arm],
    actions: tuple[ActionEntry, ...],
    control_period: float,
    only: str = "",
) -> Layout:
    """The layout of a model.

    Args:
        model: a ``mujoco.MjModel``.
        robots: the robots' names.
        arms: theirs.
        actions: what their actions consist of.
        control_period: s.
        only: the one object of a task that takes one of several; its role is ``obj`` too. The
            others are far away, where robosuite drops them.
    """
    bodies = [model.body(number).name for number in range(model.nbody)]
    return Layout(
        control_period=control_period,
        robot=RobotLayout(
            name="+".join(robots),
            bodies=tuple(f"robot{number}_base" for number in range(len(robots))),
            hands=tuple(_hand(arm) for arm in arms),
            base="robot0_base",
        ),
        actions=actions,
        objects={name: what for name, what in _objects(model).items() if only in ("", name)},
        fixtures={name: fixture for name, fixture in _fixtures().items() if _has(bodies, fixture)},
        roles={"obj": only} if only else {},
        cameras=cameras_of(model),
    )


def cameras_of(model: Any) -> dict[str, float]:
    """What robosuite's policies see through, of any version: the view from in front and those in
    the hands, and that their images are square.
    """
    names = [model.camera(number).name for number in range(model.ncam)]
    return {name: 1.0 for name in names if name.endswith(("agentview", "eye_in_hand"))}


def _hand(arm: Arm) -> HandLayout:
    model, prefix = arm.hand, arm.prefix
    return HandLayout(
        spec=arm.gripper,
        frame=f"{prefix}grip_site",
        fingers=tuple(tuple(f"{prefix}{b}" for b in bodies) for bodies in model.fingers.values()),
        palm=(f"{prefix}{model.palm}",),
        joints=tuple(
            FingerJoint(f"{prefix}{name}", *positions) for name, positions in model.joints.items()
        ),
    )


def _objects(model: Any) -> dict[str, ObjectLayout]:
    """What moves freely."""
    found = {}
    for joint in range(model.njnt):
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
            body = model.body(model.jnt_bodyid[joint]).name
            name = body
            for root in _ROOTS:
                name = name.removesuffix(root)
            found[name] = ObjectLayout(body, CATEGORIES.get(name, name.lower()))
    return found


def _has(bodies: Sequence[str], fixture: FixtureLayout) -> bool:
    return all(body in bodies for body in fixture.bodies)


def _fixtures() -> dict[str, FixtureLayout]:
    return {
        "table": FixtureLayout(("table",), "Table"),
        "bin1": FixtureLayout(("bin1",), "Bin", interiors={"bin": _compartment("bin1", 0, 0)}),
        "bin2": FixtureLayout(
            ("bin2",),
            "Bin",
            interiors={
                "milk": _compartment("bin2", -1, -1),
                "bread": _compartment("bin2", 1, -1),
                "cereal": _compartment("bin2", -1, 1),
                "can": _compartment("bin2", 1, 1),
            },
        ),
        "peg1": FixtureLayout(("peg1",), "Peg"),
        "peg2": FixtureLayout(("peg2",), "Peg"),
        "Door": FixtureLayout(
            ("Door_main",),
            "Door",
            # The latch is no joint of its own here: the handle on it is what the door is moved by.
            joints={"Door_hinge": JointLayout(closed=0.0, opened=0.4, gives_access=True)},
            parts={"Door_latch": "handle"},
            handles={"handle": Region("Door_latch", (0.075, 0.015, 0.02), (0.075, -0.1, 0.0))},
        ),
    }


def _compartment(body: str, x: int, y: int) -> Region:
    """A space between a bin's walls: all of it, or the quarter on one side along each axis."""
    parts = 2 if x else 1
    half = tuple(_side(length, parts) for length in _HALF)
    centre = tuple(way * length / 2 for way, length in zip((x, y), _HALF, strict=True))
    return Region(body, (*half, _DEPTH), (*centre, _FLOOR + _DEPTH))


def _side(length: float, parts: int) -> float:
    return length / parts - _WALL
