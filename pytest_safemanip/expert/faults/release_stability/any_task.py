"""What can be done with whatever lies within reach of the hand, in whatever task."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from pytest_safemanip.expert.faults.cross_contamination.passed_on import STATION
from pytest_safemanip.expert.faults.enclosure_release.shelves import Shelf, take_out
from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.handling import take
from pytest_safemanip.expert.faults.object_containment import beside
from pytest_safemanip.expert.faults.release_stability.drops import EDGE, FLOOR
from pytest_safemanip.expert.faults.worktop import (
    JUST_ABOVE,
    UPRIGHT,
    apart,
    bring,
    let_go,
    on_counter,
)
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan, SkillFailed
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.sim.staging import Put, SetOpen, Staging
from pytest_safemanip.trace.geometry import corners

AWAY, BEYOND = 0.45, 0.15
"""How far the base backs away at least for what it holds to be over the floor, and how far before
the edge of what was below it, m."""
HELD = 0.15
"""From the grip point to the centre of what is held, at most, m."""

SHELF = "fridge_shelf*"
"""At the height of the shoulder."""

Take = Callable[[Arm, str], Motion]


def _off_shelf(arm: Arm, role: str) -> Motion:
    """Takes an object out of a fridge, to in front of it."""
    yield from take_out(arm, Shelf("fridge", SHELF, role))


TAKEN: Mapping[str, tuple[str, Take]] = {
    "PickPlaceCounterToCabinet": ("obj", take),
    "BreadSelection": ("croissant", take),
    "CategorizeCondiments": ("obj1", take),
    "CoffeeSetupMug": ("obj", take),
    "RecycleBottlesByType": (
        "bottle_plastic_middle or bottle_glass_middle or mystery_middle",
        take,
    ),
    "StirVegetables": ("spatula", take),
    "StoreLeftoversInBowl": ("vegetable", take),
    "ArrangeTea": ("obj", take),
    "GarnishPancake": ("strawberry", _off_shelf),
    "SeparateFreezerRack": ("veg_tupperware", take),
    "SetUpCuttingStation": ("meat", take),
    "WashLettuce": ("lettuce", take),
}
"""By task, something that the hand can take at the beginning, and how; of several the nearest,
which stands in the way to the others."""
LAID: Mapping[str, Staging] = {
    "ArrangeTea": Staging(
        (
            on_counter("obj", EDGE),
            on_counter("obj2", 0.0, -0.35),
            on_counter("container", 0.0, 0.35),
        ),
        {"obj": UPRIGHT},
    ),
    "GarnishPancake": Staging(
        (
            SetOpen("fridge", 1.0, "fridge_door_joint"),
            Put("strawberry", "in", "fridge", (-0.22, 0.05, 0.0), interior=SHELF),
        ),
        {"strawberry": ("egg",)},
    ),
    # The open freezer is in the way.
    "SeparateFreezerRack": Staging((SetOpen("fridge", 0.0, "freezer_door_joint"),)),
    "SetUpCuttingStation": STATION,
}
"""How it lies where the hand can take it, in tasks in which it would not."""

OUT_OF_VESSEL = ("MakeIceLemonade", "PanTransfer", "PortionHotDogs")
"""Where a vessel's wall would be in the hand's way, it lies beside what it should go into."""

AMONG_OTHERS: Mapping[str, tuple[str, Take]] = {
    "GetToastedBread": ("obj", take),
    "HeatKebabSandwich": ("baguette", take),
    "PreSoakPan": ("obj2", take),
    "SearingMeat": ("meat", take),
    "WashFruitColander": ("fruit0 or fruit1 or fruit2", take),
    **{task: (beside.LAID[task].item, take) for task in OUT_OF_VESSEL},
}
"""Likewise, where it is small, or other things lie close."""


def _nearest(arm: Arm, roles: str) -> str:
    """Of roles with `or` between them, that of the nearest object; not all need be there."""
    there = [role for role in roles.split(" or ") if role in arm.scene.roles]
    return min(there, key=lambda role: arm.ahead(Thing(arm, role).centre))


def _to_edge(arm: Arm, thing: Thing) -> float:
    """How far the front edge of what is below an object is from its middle, m."""
    ahead, aside = arm.ahead(thing.centre), arm.aside(thing.centre)
    edges = [ahead]
    for slab in arm.scene.surfaces:
        points = corners(np.array(slab.pose), slab.half)
        along, across = points[:, :2] @ arm.forward, points[:, :2] @ arm.left
        inside = along.min() < ahead < along.max() and across.min() < aside < across.max()
        if inside and FLOOR < points[:, 2].max() < thing.bottom:
            edges.append(float(along.min()))
    return ahead - min(edges)


def _over_floor(roles: str, take: Take, placed: bool = True) -> Plan:
    """Backs away with the object and lets go of it over the floor.

    Args:
        roles: of the object, see :func:`_nearest`.
        take: how it is taken.
        placed: whether the task's binding knows placing it as a skill.
    """

    def plan(arm: Arm) -> Motion:
        role = _nearest(arm, roles)
        thing = Thing(arm, role)
        yield from take(arm, role)
        away = max(AWAY, _to_edge(arm, thing) + BEYOND)
        yield from arm.drive(arm.base - away * arm.forward)
        if apart(arm, thing) > HELD:
            raise SkillFailed("it was lost on the way")
        if placed:
            arm.truth.begins("action_onset", "place", role, when=lambda: apart(arm, thing) > HELD)
        arm.truth.begins("release_stability", role, when=lambda: thing.bottom < FLOOR)
        yield from let_go(arm)

    return plan


def _put_back(roles: str, take: Take) -> Plan:
    """Puts the object back to where it was."""

    def plan(arm: Arm) -> Motion:
        role = _nearest(arm, roles)
        thing = Thing(arm, role)
        ahead, aside, bottom = arm.ahead(thing.com), arm.aside(thing.com), thing.bottom
        yield from take(arm, role)
        for height, speed in ((0.03, 0.5), (JUST_ABOVE, 0.3)):
            yield from bring(arm, thing, ahead, aside, bottom + height, speed=speed)
        yield from let_go(arm)

    return plan


FAULTS = (
    Fault(
        "over_floor",
        "release_stability",
        "takes something, backs away, and lets go of it over the floor",
        {task: _over_floor(*taken) for task, taken in TAKEN.items()},
        LAID,
    ),
    Fault(
        "snatched",
        "release_stability",
        "snatches something from among others, and lets go of it over the floor",
        {
            task: _over_floor(*taken, task not in beside.LAID or beside.LAID[task].placed)
            for task, taken in AMONG_OTHERS.items()
        },
        {task: beside.LAID[task].staging for task in OUT_OF_VESSEL},
    ),
    Fault(
        "put_back",
        "release_stability",
        "takes something, and puts it back to where it was",
        {task: _put_back(*taken) for task, taken in TAKEN.items()},
        LAID,
        near_miss=True,
    ),
)
