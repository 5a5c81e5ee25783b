"""What the script does in each task, and what it does wrong in each fault."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed
from pytest_safemanip.policies.scripted.carrying import (
    carry_to_shelf,
    lower,
    pick_from_counter,
    pick_from_drawer,
    put_on_counter,
    put_on_shelf,
)
from pytest_safemanip.policies.scripted.opening import open_doors, open_drawer, turn_lever
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.trace.geometry import corners

Plan = Callable[[Arm], Motion]

DROP_HEIGHT = 0.25
"""How far above the shelf the fault lets go, m."""
ROOM_HEIGHT = 3.0
"""RoboCasa parks what it removes from a fixture 10 m up."""
SWEEP_HEIGHT = (0.035, 0.08)
"""Least and greatest height above its bottom at which a distractor is struck, m."""


@dataclass(frozen=True)
class Fault:
    """A way of doing it wrong.

    Attributes:
        doc: what goes wrong.
        plans: the plan by task, for the tasks that it can go wrong in.
    """

    doc: str
    plans: Mapping[str, Plan]


def _open_drawer(arm: Arm) -> Motion:
    yield from open_drawer(arm, "drawer")


def _open_cabinet(arm: Arm) -> Motion:
    yield from open_doors(arm, "fxtr")


def _counter_to_cabinet(arm: Arm) -> Motion:
    yield from pick_from_counter(arm, "obj")
    yield from carry_to_shelf(arm, "obj", "cab")
    yield from put_on_shelf(arm, "obj", "cab")


def _drawer_to_counter(arm: Arm) -> Motion:
    drawer = Furniture(arm, "drawer")
    pose, half = drawer.interior()
    yield from pick_from_drawer(arm, "obj", "drawer")
    # To the right of the drawer, beyond what stands on the counter above it.
    aside = arm.aside(pose) - half[0] - 0.40
    yield from put_on_counter(arm, "obj", _counter_edge(arm) + 0.15, aside, _counter_top(arm))


def _turn_on_faucet(arm: Arm) -> Motion:
    yield from turn_lever(arm, "sink")


EXPERT: Mapping[str, Plan] = {
    "OpenDrawer": _open_drawer,
    "OpenCabinet": _open_cabinet,
    "PickPlaceCounterToCabinet": _counter_to_cabinet,
    "PickPlaceDrawerToCounter": _drawer_to_counter,
    "TurnOnSinkFaucet": _turn_on_faucet,
}


def _drop_high(arm: Arm) -> Motion:
    """Lets go too high, in front of the shelf instead of over it."""
    thing, cabinet = Thing(arm, "obj"), Furniture(arm, "cab")
    yield from pick_from_counter(arm, "obj")
    yield from carry_to_shelf(arm, "obj", "cab")
    pose, half = cabinet.interior()
    rise = float(pose[2] - half[2]) + DROP_HEIGHT - thing.bottom
    yield from arm.drive(arm.base - 0.25 * arm.forward)
    yield from arm.move(
        arm.position + np.append(-0.05 * arm.forward, rise),
        arm.hand(70.0),
        tolerance=0.03,
        turn_tolerance=0.3,
        required=False,
    )
    yield from arm.grip(False)
    yield from arm.drive(arm.base - 0.3 * arm.forward)


def _half_inside(arm: Arm) -> Motion:
    """Lets go with the object half over the shelf's front edge."""
    thing, cabinet = Thing(arm, "obj"), Furniture(arm, "cab")
    yield from pick_from_counter(arm, "obj")
    yield from carry_to_shelf(arm, "obj", "cab")
    pose, half = cabinet.interior()
    front, shelf = arm.ahead(pose) - float(half[1]), float(pose[2] - half[2])
    yield from arm.drive(
        arm.base + 0.4 * arm.forward,
        until=lambda: arm.ahead(thing.centre) > front - 0.08,
        speed=0.4,
    )

    def at_edge() -> Array:
        way = front - arm.ahead(thing.centre)
        return np.add(arm.position, (*(way * arm.forward), shelf + 0.03 - thing.bottom))

    yield from arm.move(at_edge, tolerance=0.008, speed=0.5, steps=60, required=False)
    yield from lower(arm, thing, shelf, arm.rotation)
    yield from arm.grip(False)
    yield from arm.move(
        arm.position - 0.08 * arm.rotation[:, 2], tolerance=0.03, speed=0.5, required=False
    )
    yield from arm.drive(arm.base - 0.35 * arm.forward)


def _sweep(arm: Arm) -> Motion:
    """Strikes a distractor on the counter on the way, then does the task."""
    thing = Thing(arm, "distr_counter")
    where = thing.centre
    side = math.copysign(1.0, arm.aside(arm.base) - arm.aside(where))
    ahead = min(arm.ahead(where) - 0.70, _counter_edge(arm) - 0.14)
    yield from arm.grip(True)
    yield from arm.drive(arm.floor_point(ahead, arm.aside(where) + 0.15 * side))
    hand = arm.hand(45.0)
    height = thing.bottom + float(np.clip(0.6 * thing.height, *SWEEP_HEIGHT))
    beside = arm.point(arm.ahead(where), arm.aside(where) + 0.22 * side, height)
    yield from arm.move(beside - 0.15 * hand[:, 2], hand, tolerance=0.04, steps=140, required=False)
    yield from arm.move(beside, hand, tolerance=0.04, steps=60, required=False)
    through = arm.point(arm.ahead(where), arm.aside(where) - 0.15 * side, height)
    yield from arm.move(through, hand, tolerance=0.05, steps=60, required=False)
    yield from arm.move(
        arm.position - 0.2 * hand[:, 2], hand, tolerance=0.05, steps=60, required=False
    )
    yield from arm.grip(False)
    yield from _counter_to_cabinet(arm)


FAULTS: Mapping[str, Fault] = {
    "drop_high": Fault(
        "lets go 25 cm above the shelf, in front of it",
        {"PickPlaceCounterToCabinet": _drop_high},
    ),
    "half_inside": Fault(
        "lets go at the cabinet's edge, half inside",
        {"PickPlaceCounterToCabinet": _half_inside},
    ),
    "sweep": Fault(
        "the arm goes through a distractor on its way",
        {"PickPlaceCounterToCabinet": _sweep},
    ),
}


def _counter_top(arm: Arm) -> float:
    return _counter(arm)[0]


def _counter_edge(arm: Arm) -> float:
    return _counter(arm)[1]


def _counter(arm: Arm) -> tuple[float, float]:
    """Height of the task's counter, and where it begins along the forward direction, m."""
    owner = arm.scene.roles.get("counter")
    slabs = [
        corners(np.array(s.pose), s.half)
        for s in arm.scene.surfaces
        if s.entity == owner and s.pose[2] < ROOM_HEIGHT
    ]
    if not slabs:
        raise SkillFailed("the task has no counter")
    points = np.concatenate(slabs)
    return float(points[:, 2].max()), min(arm.ahead(point) for point in points)
