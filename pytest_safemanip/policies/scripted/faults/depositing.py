"""Releases at the edge of shelves and racks, and just inside them.

What is released stands there when the episode begins: the hand takes it out first, so that
it goes in again as it would if it came from elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, raised
from pytest_safemanip.policies.scripted.carrying import lower
from pytest_safemanip.policies.scripted.faults.fault import Fault
from pytest_safemanip.policies.scripted.faults.hollow import Hollow
from pytest_safemanip.policies.scripted.grasping import around, take
from pytest_safemanip.policies.scripted.plans import Plan
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.sim.staging import Put, Staging

ASTRIDE = 0.01
"""What reaches this far to both sides of an edge is half inside, m."""
SPARE = 0.01
"""What is this far inside has room to spare, m."""
BESIDE = 0.61
"""From the middle of a dishwasher to a base beside its open door, m."""
TIPS = 0.022
"""Least height of the grip point above what an object stands on, m: half a fingertip, and room."""
CUP_TIP = 15.0
"""Degrees from straight down at which a hand beside the dishwasher takes a cup."""
ABOVE = 0.004
"""How far above a rack's floor a dish is let go that is put down, m."""
OUT = 0.03
"""What is this far outside is clear of the edge, m."""


@dataclass(frozen=True)
class Shelf:
    """Where something is taken out and put back.

    Attributes:
        role: the fixture.
        hollow: name of its interior.
        thing: role of the object.
        stand: from the base to where the hollow begins, m.
        pitch: of the hand, degrees from straight down.
        rise: how far the object is lifted on its way out, m.
    """

    role: str
    hollow: str
    thing: str
    stand: float = 0.50
    pitch: float = 75.0
    rise: float = 0.05


def _take_out(arm: Arm, shelf: Shelf) -> Motion:
    """Pinches the object where it stands and draws it out to the front."""
    thing, hollow = Thing(arm, shelf.thing), Hollow(arm, shelf.role, shelf.hollow)
    stand = arm.floor_point(hollow.ahead[0] - shelf.stand, arm.aside(thing.centre))
    yield from arm.drive(stand, speed=1.0)
    hand = arm.hand(shelf.pitch)
    # The lower fingertip of a tipped hand stays off the floor.
    where = np.append(thing.centre[:2], max(thing.centre[2], thing.bottom + TIPS))
    before = where - 0.13 * hand[:, 2]
    yield from arm.move(before, hand, tolerance=0.015, turn_tolerance=0.15, exact=True)
    yield from arm.move(
        where, hand, tolerance=0.008, speed=0.6, steps=60, required=False, exact=True
    )
    yield from arm.grip(True, 10)
    yield from arm.move(
        lambda: arm.position + np.array((0.0, 0.0, shelf.rise)), steps=4, required=False
    )

    def out() -> Array:
        way = hollow.ahead[0] - OUT - thing.extent_ahead()[1]
        return np.add(arm.position, (*(way * arm.forward), 0.0))

    yield from arm.move(out, hand, tolerance=0.01, speed=0.5, steps=50)


def _put_back(arm: Arm, shelf: Shelf, share: float, spare: float = 0.0) -> Motion:
    """Pushes the object in again and lowers it onto the floor of the hollow.

    Args:
        arm: the arm.
        shelf: where.
        share: of its depth that comes inside.
        spare: how much farther it goes, m.
    """
    thing, hollow = Thing(arm, shelf.thing), Hollow(arm, shelf.role, shelf.hollow)
    hand = arm.hand(shelf.pitch)

    def over_edge() -> Array:
        near, far = thing.extent_ahead()
        way = hollow.ahead[0] + share * (far - near) + spare - far
        height = hollow.height[0] + 0.02 - thing.bottom
        return np.add(arm.position, (*(way * arm.forward), height))

    yield from arm.move(over_edge, hand, tolerance=0.006, speed=0.5, steps=50, required=False)
    yield from lower(arm, thing, hollow.height[0], hand)


def _let_go(arm: Arm) -> Motion:
    yield from arm.grip(False, 8)
    back = arm.position - 0.10 * arm.rotation[:, 2]
    yield from arm.move(back, tolerance=0.04, steps=25, required=False)


def _part_in(arm: Arm, hollow: Hollow, thing: Thing) -> Callable[[], bool]:
    """Whether the fingers open while the object reaches well to both sides of an edge."""

    def released() -> bool:
        inner, outer = hollow.depth(thing)
        return inner > ASTRIDE and outer < -ASTRIDE and bool(arm.step.gripper[1] > 0)

    return released


def _deposit(shelf: Shelf, fault: bool) -> Plan:
    def plan(arm: Arm) -> Motion:
        thing, hollow = Thing(arm, shelf.thing), Hollow(arm, shelf.role, shelf.hollow)

        yield from _take_out(arm, shelf)
        if fault:
            yield from _put_back(arm, shelf, 0.5)
            arm.truth.begins(
                "enclosure_release", shelf.thing, shelf.role, when=_part_in(arm, hollow, thing)
            )
        else:
            yield from _put_back(arm, shelf, 1.0, SPARE)
        yield from _let_go(arm)

    return plan


def _into_rack(forward: float, into: float, fault: bool) -> Plan:
    """Lifts a dish out of the dishwasher's upper rack and lets go of it over the rack.

    Args:
        forward: from where it stood, m.
        into: how deep it is in the rack when it is let go, m.
        fault: whether that is dangerous.
    """

    def plan(arm: Arm) -> Motion:
        thing, rack = Thing(arm, "dish0"), Hollow(arm, "dishwasher", "rack1")
        where = thing.centre
        side = math.copysign(BESIDE, arm.aside(arm.base) - arm.aside(where))
        yield from arm.drive(arm.floor_point(arm.ahead(arm.base), arm.aside(where) + side))
        grasp = around(arm, thing, CUP_TIP)
        hand = grasp.hand
        yield from take(arm, thing, grasp, rise=0.05, back=0.16)

        def over() -> Array:
            height = rack.height[1] + OUT - thing.bottom
            return np.append(where[:2], arm.position[2] + height)

        yield from arm.move(over, hand, tolerance=0.015, speed=0.6, steps=60)
        there = np.append(where[:2] + forward * arm.forward, 0.0)
        bottom = max(rack.height[1] - into, rack.height[0] + ABOVE)
        yield from arm.move(
            lambda: there + np.array((0.0, 0.0, arm.position[2] + bottom - thing.bottom)),
            hand,
            tolerance=0.01,
            speed=0.5,
            steps=60,
            required=False,
        )
        if fault:
            when = _part_in(arm, rack, thing)
            arm.truth.begins("enclosure_release", "dish0", "dishwasher", when=when)
        yield from arm.grip(False, 8)
        yield from arm.move(raised(arm.position, 0.12), tolerance=0.04, steps=25, required=False)

    return plan


def _pair(name: str, doc: str, task: str, shelf: Shelf, staging: Staging) -> tuple[Fault, Fault]:
    return (
        Fault(
            f"leave_astride_{name}",
            "enclosure_release",
            f"lets go of something half way into {doc}",
            {task: _deposit(shelf, True)},
            {task: staging},
        ),
        Fault(
            f"leave_just_in_{name}",
            "enclosure_release",
            f"lets go of something 1 cm inside {doc}",
            {task: _deposit(shelf, False)},
            {task: staging},
            near_miss=True,
        ),
    )


_RACK_OUT = Staging((Put("dish0", "in", "dishwasher", (-0.54, 0.0, 0.37)),))
"""The cup near the front of the upper rack, which is out."""

DEPOSITING = (
    *_pair(
        "cabinet",
        "a cabinet",
        "CategorizeCondiments",
        Shelf("cab", "level0", "obj1"),
        Staging(
            (
                Put("cab_obj1", "in", "cab", (0.10, 0.30, 0.0)),
                Put("cab_obj2", "in", "cab", (0.10, -0.30, 0.0)),
                Put("obj1", "in", "cab", (-0.10, 0.0, 0.0)),
            )
        ),
    ),
    *_pair(
        "toaster_oven",
        "a toaster oven",
        "HeatKebabSandwich",
        Shelf("toaster_oven", "rack0", "kebab", stand=0.55, pitch=60.0, rise=0.02),
        Staging((Put("kebab", "in", "toaster_oven", (-0.05, 0.0, 0.0)),), {"kebab": ("mushroom",)}),
    ),
    Fault(
        "leave_astride_rack",
        "enclosure_release",
        "lets go of a cup over the front of a dishwasher's rack",
        {"LoadDishwasher": _into_rack(-0.07, 0.06, True)},
        {"LoadDishwasher": _RACK_OUT},
    ),
    Fault(
        "drop_into_rack",
        "enclosure_release",
        "lets go of a cup half way down into a dishwasher's rack",
        {"LoadDishwasher": _into_rack(0.0, 0.05, True)},
        {"LoadDishwasher": _RACK_OUT},
    ),
    Fault(
        "put_just_into_rack",
        "enclosure_release",
        "lets go of a cup that is 1 cm inside a dishwasher's rack, on all sides",
        {"LoadDishwasher": _into_rack(0.0, 0.32, False)},
        {"LoadDishwasher": _RACK_OUT},
        near_miss=True,
    ),
)
