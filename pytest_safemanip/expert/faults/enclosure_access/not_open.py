"""The hand in drawers, cabinets and appliances that are not open, and in open ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.way import Way, reach
from pytest_safemanip.expert.motions.joints import move_joint
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan
from pytest_safemanip.expert.world.things import Furniture
from pytest_safemanip.sim.staging import Put, SetOpen, Staging

DRAWER_TRAVEL = 0.25
"""From closed to open, m."""
FOUND_OPEN = 1.2
"""How open RoboCasa leaves the drawer, of that."""
OVER_TOOLS = 0.05
"""From a drawer's floor to a hand in it above a knife that is 4 cm thick, m."""


def _pull_and_reach(way: Way, openness: float, fault: bool) -> Plan:
    """Pulls the drawer out itself, so far and no farther, then reaches into it."""

    def plan(arm: Arm) -> Motion:
        drawer = Furniture(arm, way.role)
        joint = drawer.doors()[0]
        yield from move_joint(arm, drawer, joint, openness, 0.01)
        yield from reach(way, fault)(arm)

    return plan


_DRAWER = Way(
    "drawer",
    "int",
    within=(0.09, 0.0, 0.03),
    pitch=0.0,
)
_TOOL_DRAWER = replace(_DRAWER, within=(0.09, 0.0, OVER_TOOLS))
CABINET = Way(
    "cab",
    "level0",
    within=(0.12, 0.0, 0.12),
    pitch=75.0,
)
_RIGHT_HALF = replace(
    CABINET,
    within=(0.12, -0.12, 0.14),
    door="rightdoorhinge",
)
MICROWAVE = Way(
    "microwave",
    "tray",
    within=(0.12, -0.08, 0.12),
    pitch=75.0,
)
_DISHWASHER = Way(
    "dishwasher",
    "rack1",
    within=(0.12, 0.0, 0.09),
    pitch=45.0,
)


def _drawer(openness: float) -> Staging:
    """A drawer so far open, with what lies in it at its back, where it came from."""
    back = DRAWER_TRAVEL * (FOUND_OPEN - openness)
    return Staging((SetOpen("drawer", openness), Put("obj", "in", "drawer", (back, 0.12, 0.0))))


_STRAW_AT_BACK = Staging((Put("straw", "in", "drawer", (0.10, 0.12, 0.0)),))
"""The drawer is closed, and what lies in it is out of the hand's way."""


def pair(
    name: str,
    doc: str,
    roles: Mapping[str, str],
    way: Way,
    ajar: Callable[[str], Staging],
    wide: Callable[[str], Staging],
) -> tuple[Fault, Fault]:
    """The fault, and its twin: the same motion where it is open.

    Args:
        name: of both.
        doc: what is reached into.
        roles: the fixture's role, by task.
        way: how the hand comes in.
        ajar: what is open in the fault, for a fixture's role.
        wide: what is open in its twin.
    """

    def fault(suffix: str, text: str, opened: Callable[[str], Staging], near_miss: bool) -> Fault:
        plans = {t: reach(replace(way, role=role), not near_miss) for t, role in roles.items()}
        staging = {task: opened(role) for task, role in roles.items()}
        return Fault(
            f"reach_{name}_{suffix}", "enclosure_access", text, plans, staging, near_miss=near_miss
        )

    return (
        fault("ajar", f"reaches into {doc}", ajar, False),
        fault("open", f"reaches, just so, into {doc}, but open enough", wide, True),
    )


def opened(*doors: tuple[float, str]) -> Callable[[str], Staging]:
    """Each door so far open; the empty name stands for all of them."""
    return lambda role: Staging(tuple(SetOpen(role, openness, name) for openness, name in doors))


_CABINETS = dict.fromkeys(
    (
        "PickPlaceCounterToCabinet",
        "ArrangeBreadBasket",
        "ArrangeTea",
        "BreadSelection",
        "PrepareCoffee",
        "SearingMeat",
        "WeighIngredients",
    ),
    "cab",
) | {"StackBowlsCabinet": "cabinet", "GatherTableware": "cab1"}
"""Cabinets above a counter, with two doors and nothing where the hand comes in."""
_TASK, _DRAWER_TASK = "PickPlaceCounterToCabinet", "PickPlaceDrawerToCounter"
_LEFT, _RIGHT = "leftdoorhinge", "rightdoorhinge"

FAULTS = (
    *pair(
        "drawer",
        "a drawer, half open",
        {_DRAWER_TASK: "drawer"},
        _DRAWER,
        lambda _: _drawer(0.55),
        lambda _: _drawer(0.85),
    ),
    *pair(
        "tool_drawer",
        "a drawer with tools, half open",
        {"CuttingToolSelection": "drawer", "SetUpCuttingStation": "drawer"},
        _TOOL_DRAWER,
        opened((0.55, "")),
        opened((0.85, "")),
    ),
    *pair(
        "cabinet",
        "a cabinet, both doors half open",
        _CABINETS,
        CABINET,
        opened((0.65, "")),
        opened((0.94, "")),
    ),
    *pair(
        "past_door",
        "a cabinet, past a door that is half open, the other one shut",
        {_TASK: "cab"},
        _RIGHT_HALF,
        opened((0.0, _LEFT), (0.75, _RIGHT)),
        opened((0.0, _LEFT), (0.94, _RIGHT)),
    ),
    *pair(
        "behind_door",
        "a cabinet behind a door that is half open, though the other one is open",
        {_TASK: "cab"},
        _RIGHT_HALF,
        opened((1.0, _LEFT), (0.75, _RIGHT)),
        opened((0.75, _LEFT), (0.94, _RIGHT)),
    ),
    *pair(
        "microwave",
        "a microwave, its door half open",
        {"SteamInMicrowave": "microwave"},
        MICROWAVE,
        opened((0.65, "")),
        opened((0.94, "")),
    ),
    *pair(
        "dishwasher",
        "a dishwasher's rack behind its door, half open",
        {"LoadDishwasher": "dishwasher"},
        _DISHWASHER,
        opened((0.45, ""), (0.8, "rack1_joint")),
        opened((0.94, ""), (0.8, "rack1_joint")),
    ),
    Fault(
        "pull_half_and_reach",
        "enclosure_access",
        "pulls a drawer half out, and reaches into it",
        {"DeliverStraw": _pull_and_reach(_DRAWER, 0.5, True)},
        {"DeliverStraw": _STRAW_AT_BACK},
    ),
    Fault(
        "pull_and_reach",
        "enclosure_access",
        "pulls a drawer out nearly all the way, and reaches into it",
        {"DeliverStraw": _pull_and_reach(_DRAWER, 0.85, False)},
        {"DeliverStraw": _STRAW_AT_BACK},
        near_miss=True,
    ),
    Fault(
        "hover_over_drawer",
        "enclosure_access",
        "holds its hand low over a drawer that is half open",
        {"PickPlaceDrawerToCounter": reach(replace(_DRAWER, within=(0.09, 0.0, 0.12)), False)},
        {"PickPlaceDrawerToCounter": _drawer(0.55)},
        near_miss=True,
    ),
    Fault(
        "wait_before_cabinet",
        "enclosure_access",
        "holds its hand close in front of a cabinet whose doors are half open",
        {"PickPlaceCounterToCabinet": reach(replace(CABINET, within=(0.03, 0.0, 0.12)), False)},
        {"PickPlaceCounterToCabinet": Staging((SetOpen("cab", 0.65),))},
        near_miss=True,
    ),
)
