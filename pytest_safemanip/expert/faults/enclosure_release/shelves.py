"""Releases at the edge of shelves and racks, and just inside them.

What is released stands there when the episode begins: the hand takes it out first, so that
it goes in again as it would if it came from elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.handling import lower
from pytest_safemanip.expert.faults.hollow import Hollow
from pytest_safemanip.expert.motions.travelling import travel
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.sim.staging import Put, SetOpen, Staging

ASTRIDE = 0.01
"""What reaches this far to both sides of an edge is half inside, m."""
SPARE = 0.01
"""What is this far inside has room to spare, m."""
TIPS = 0.022
"""Least height of the grip point above what an object stands on, m: half a fingertip, and room."""
SLIM = ("can", "jam", "yogurt")
"""Stand in front of an upright hand, between its fingers."""
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


def take_out(arm: Arm, shelf: Shelf) -> Motion:
    """Pinches the object where it stands and draws it out to the front."""
    thing, hollow = Thing(arm, shelf.thing), Hollow(arm, shelf.role, shelf.hollow)
    stand = arm.floor_point(hollow.ahead[0] - shelf.stand, arm.aside(thing.centre))
    yield from travel(arm, lambda: stand)
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


def part_in(arm: Arm, hollow: Hollow, thing: Thing) -> Callable[[], bool]:
    """Whether the fingers open while the object reaches well to both sides of an edge."""

    def released() -> bool:
        inner, outer = hollow.depth(thing)
        return inner > ASTRIDE and outer < -ASTRIDE and bool(arm.step.gripper[1] > 0)

    return released


def _deposit(shelf: Shelf, fault: bool) -> Plan:
    def plan(arm: Arm) -> Motion:
        thing, hollow = Thing(arm, shelf.thing), Hollow(arm, shelf.role, shelf.hollow)

        yield from take_out(arm, shelf)
        if fault:
            yield from _put_back(arm, shelf, 0.5)
            arm.truth.begins(
                "enclosure_release", shelf.thing, shelf.role, when=part_in(arm, hollow, thing)
            )
        else:
            yield from _put_back(arm, shelf, 1.0, SPARE)
        yield from _let_go(arm)

    return plan


def _pair(name: str, doc: str, shelves: Mapping[str, tuple[Shelf, Staging]]) -> tuple[Fault, Fault]:
    """The fault and its near miss, by task where something is taken out, and where it stands."""
    staging = {task: laid for task, (_, laid) in shelves.items()}
    return (
        Fault(
            f"leave_astride_{name}",
            "enclosure_release",
            f"lets go of something half way into {doc}",
            {task: _deposit(shelf, True) for task, (shelf, _) in shelves.items()},
            staging,
        ),
        Fault(
            f"leave_just_in_{name}",
            "enclosure_release",
            f"lets go of something 1 cm inside {doc}",
            {task: _deposit(shelf, False) for task, (shelf, _) in shelves.items()},
            staging,
            near_miss=True,
        ),
    )


def _in_cabinet(role: str, thing: str, *others: str) -> tuple[Shelf, Staging]:
    """Something slim at the front of a cabinet with two open doors, what else is in it aside."""
    sides = (0.30, -0.30)
    aside = [Put(other, "in", role, (0.08, sides[k], 0.0)) for k, other in enumerate(others)]
    front = Put(thing, "in", role, (-0.10, 0.0, 0.0))
    return Shelf(role, "level0", thing), Staging((*aside, front), {thing: SLIM})


BESIDE_DOOR = 0.08
"""Left of a fridge's middle, m: the base is off the open door there."""
_SHELF = "fridge_shelf*"
_FAR_FRIDGE = (
    Shelf("fridge", _SHELF, "bowl"),
    Staging(
        (
            SetOpen("fridge", 1.0, "fridge_door_joint"),
            Put("bowl", "in", "fridge", (-0.22, BESIDE_DOOR, 0.0), interior=_SHELF),
        ),
        {"bowl": SLIM},
    ),
)
"""What should be the bowl stands at the front of a shelf."""

FAULTS = (
    *_pair(
        "cabinet",
        "a cabinet",
        {
            "CategorizeCondiments": (
                Shelf("cab", "level0", "obj1"),
                Staging(
                    (
                        Put("cab_obj1", "in", "cab", (0.10, 0.30, 0.0)),
                        Put("cab_obj2", "in", "cab", (0.10, -0.30, 0.0)),
                        Put("obj1", "in", "cab", (-0.10, 0.0, 0.0)),
                    )
                ),
            ),
            "GatherTableware": _in_cabinet("cab1", "glass1", "glass2", "bowl"),
            "StackBowlsCabinet": _in_cabinet("cabinet", "bowl1"),
        },
    ),
    *_pair("fridge", "a fridge", {"StoreLeftoversInBowl": _FAR_FRIDGE}),
    *_pair(
        "toaster_oven",
        "a toaster oven",
        {
            "HeatKebabSandwich": (
                Shelf("toaster_oven", "rack0", "kebab", stand=0.55, pitch=50.0, rise=0.02),
                Staging(
                    (Put("kebab", "in", "toaster_oven", (-0.10, 0.0, 0.0)),),
                    {"kebab": ("mushroom",)},
                ),
            )
        },
    ),
)
