"""A cabinet's door pushed shut onto what stands in its way, and close in front of it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.hollow import Hollow
from pytest_safemanip.expert.faults.mechanism_recovery.drawer import LONG
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan
from pytest_safemanip.expert.world.things import Furniture, Part, Thing
from pytest_safemanip.sim.staging import Put, SetOpen, Staging

DOOR_GRIP = 0.19
"""From a door's hinge to where it is pushed, m."""
WRIST = 0.15
"""From the hand's middle to the far side of the wrist, and some room, m."""
PUSHED = 0.005
"""What moved this far was pushed, m."""


def _close_door(role: str, pot: str, fault: bool) -> Plan:
    """Pushes the right door of a cabinet shut with closed fingers.

    Args:
        role: the cabinet.
        pot: what stands in it.
        fault: whether it is in the way.
    """

    def plan(arm: Arm) -> Motion:
        cabinet, thing = Furniture(arm, role), Thing(arm, pot)
        joint, hollow = cabinet.joint(Part.RIGHT_DOOR), Hollow(arm, role, "level0")
        aside = arm.aside(np.asarray(joint.anchor)) + DOOR_GRIP
        front = hollow.ahead[0]
        tip = 2.0 * cabinet.part(joint)[:3] - joint.anchor
        beside_door = arm.aside(tip) + WRIST - arm.aside(arm.position)
        if beside_door > 0.0:
            # The open door reaches behind the hand, and would be met on the way back.
            yield from arm.drive(arm.base + beside_door * arm.left)
        # Back first: the hand is beside the open door.
        for beside in (arm.aside(arm.base), aside):
            yield from arm.drive(arm.floor_point(front - 0.95, beside), speed=1.0, tolerance=0.03)
        yield from arm.grip(True, 6)
        hand, height = arm.hand(75.0, 90.0), hollow.height[0] + 0.14
        before = arm.point(front - 0.48, aside, height)
        yield from arm.move(before, hand, tolerance=0.03, turn_tolerance=0.2)
        where = thing.centre
        if fault:
            arm.truth.begins(
                "mechanism_recovery",
                role,
                when=lambda: bool(np.linalg.norm(thing.centre - where) > PUSHED),
            )
        yield from arm.move(
            arm.point(front - 0.04, aside, height),
            hand,
            speed=0.5,
            steps=50,
            until=lambda: cabinet.openness(joint) < 0.02,
            required=False,
        )
        yield from arm.wait(LONG if fault else 1.0)

    return plan


def _on_shelf(role: str, pot: str, ahead: float) -> Staging:
    """A pot on the shelf behind the right door, which is half open; the left one is shut."""
    changes = (
        SetOpen(role, 0.0, "leftdoorhinge"),
        SetOpen(role, 0.6, "rightdoorhinge"),
        Put(pot, "in", role, (ahead, -0.22, 0.0)),
    )
    return Staging(changes, {pot: ("pot",)})


CABINETS = {
    "OpenCabinet": ("fxtr", "door_obj"),
    "ArrangeBreadBasket": ("cab", "dstr_dining"),
    "WeighIngredients": ("cab", "digital_scale"),
}
"""By task, a cabinet with two doors, and what may be a pot that stands in it."""


CROWDED = {"ArrangeTea": ("cab", "container")}
"""Likewise; what stands in it by itself is in the door's way, whatever the pot does."""


def _shutting(
    name: str, doc: str, cabinets: Mapping[str, tuple[str, str]], ahead: float, near_miss: bool
) -> Fault:
    return Fault(
        name,
        "mechanism_recovery",
        doc,
        {task: _close_door(*there, not near_miss) for task, there in cabinets.items()},
        {task: _on_shelf(*there, ahead) for task, there in cabinets.items()},
        near_miss=near_miss,
    )


FAULTS = (
    _shutting(
        "shut_onto_pot",
        "pushes a cabinet's door shut onto a pot that stands out over the shelf",
        CABINETS | CROWDED,
        -0.145,
        False,
    ),
    _shutting(
        "shut_before_pot",
        "pushes a cabinet's door shut, with room before a pot",
        CABINETS,
        -0.03,
        True,
    ),
)
