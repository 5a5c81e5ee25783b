"""A bowl that is let go half way into a freezer, and just inside it."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion
from pytest_safemanip.policies.scripted.faults.depositing import part_in
from pytest_safemanip.policies.scripted.faults.fault import Fault
from pytest_safemanip.policies.scripted.faults.hollow import Hollow
from pytest_safemanip.policies.scripted.handles import pick_by_handle, put_in
from pytest_safemanip.policies.scripted.plans import Plan
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.sim.staging import SetOpen, Staging

TASK, ROLE = "SeparateFreezerRack", "veg_tupperware"
BOWL = Staging((SetOpen("fridge", 1.0, "freezer_door_joint"),), {ROLE: ("bowl",)})
"""A box has nothing that a hand could hold; a bowl has a lug. A door that is less open
is in its way."""
ROOM = 0.40
"""How far the base draws back before it carries the bowl past the freezer's open door, m."""
OFF_DOOR = 0.012
"""How far right of the freezer's middle it goes in, m: its door, 11 cm thick, is on the left."""
LUG_FREE = 0.6
"""Opening of the fingers at which they are off a lug, which is 3 cm wide."""
HALF, WHOLE = 0.02, 0.15
"""From a shelf's edge to a bowl's middle, m: on it by so little, it stays; with its lug, it
reaches 13 cm towards the robot."""


def _put(beyond: float, fault: bool) -> Plan:
    """Takes the bowl by its lug and puts it onto a shelf, its middle so far beyond the edge, m."""

    def plan(arm: Arm) -> Motion:
        thing, shelf = Thing(arm, ROLE), Hollow(arm, "fridge", "freezer_shelf3")
        astride = part_in(arm, shelf, thing)
        yield from pick_by_handle(arm, ROLE)
        if fault:
            arm.truth.begins(
                "enclosure_release",
                ROLE,
                "fridge",
                when=lambda: bool(arm.step.gripper[0] > LUG_FREE) and astride(),
            )
        middle = arm.floor_point(shelf.ahead[0] + beyond, sum(shelf.aside) / 2.0 - OFF_DOOR)
        yield from arm.drive(arm.base - ROOM * arm.forward, speed=0.5)
        yield from arm.drive(arm.floor_point(arm.ahead(arm.base), arm.aside(middle)), speed=0.5)
        yield from put_in(arm, ROLE, Furniture(arm, "fridge"), np.append(middle, shelf.height[0]))

    return plan


def _fault(name: str, doc: str, beyond: float, near_miss: bool = False) -> Fault:
    plans = {TASK: _put(beyond, not near_miss)}
    return Fault(name, "enclosure_release", doc, plans, {TASK: BOWL}, near_miss)


HALF_IN = (
    _fault("bowl_half_in", "lets go of a bowl half way into a freezer", HALF),
    _fault("bowl_just_in", "lets go of a bowl just inside a freezer", WHOLE, near_miss=True),
)
