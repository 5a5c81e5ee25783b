"""Contamination that is passed on: by a board, by a held knife, by a hand rinsed for too short."""

from __future__ import annotations

from functools import partial

import numpy as np

from pytest_safemanip.expert.faults.cross_contamination.raw_food import DRUMSTICK, RIM
from pytest_safemanip.expert.faults.fault import staged
from pytest_safemanip.expert.faults.handling import (
    FIRM,
    carry_over,
    one_then_other,
    pinch,
    pressing,
    rehearse_or,
    touch,
)
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan, raised
from pytest_safemanip.expert.robot.hand import reach_at
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.standing import stand_before
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.sim.staging import Change, Put, SetOpen, Staging

CUTTING, SINK = "SetUpCuttingStation", "PickPlaceSinkToCounter"
KNIFE, MEAT_ROLE, BOARD, PLATE = "knife", "meat", "receptacle", "meat_container"
BOARD_EDGE = 0.11
"""From a board's middle to where it is touched beside what lies on its other end, m."""
ABOVE = 0.015
"""Height over a thing from which the knife is lowered on it slowly, m."""
END = 0.10
"""From a knife's centre of mass to where it lands, m: there it yields, by turning a little between
the fingers; right below the hand it would knock with 28 N."""
SOFT, CREEP, MOMENT = 0.02, 0.003, 3
"""Share of the hand's top speed on the way down to a thing's highest corner and to press on it,
share at which it is met in between, and control steps for which it is then pressed."""
BELOW_SPOUT, BEFORE_WATER = 0.15, 0.15
"""From the outlet of a spout down to the hand below it, and from where it comes to there, m."""
PITCH = 35.0
"""Of the hand under the tap, degrees from straight down."""
DIP, WASH = 0.0, 2.0
"""How long the hand stays under the water, s: in and out again at once, or twice as long as running
water takes to wash something."""


def _knife(first: str, second: str, unsafe: bool) -> Plan:
    """The held knife is pressed on one thing, then on another."""

    def plan(arm: Arm) -> Motion:
        yield from pinch(arm, KNIFE)
        yield from _press_knife(arm, first)
        if unsafe:
            arm.truth.begins(
                "cross_contamination", KNIFE, when=lambda: pressing(arm, KNIFE, second) > FIRM
            )
        yield from _press_knife(arm, second)

    return plan


def _press_knife(arm: Arm, role: str) -> Motion:
    """Lower the knife until it presses on something for a moment, and raise it again."""
    knife, thing = Thing(arm, KNIFE), Thing(arm, role)
    pressed = 0

    def long_enough() -> bool:
        nonlocal pressed
        pressed = pressed + 1 if pressing(arm, KNIFE, role) > FIRM else 0
        return pressed >= MOMENT

    def over() -> Array:
        return raised(thing.top - END * np.append(arm.forward, 0.0), ABOVE)

    yield from carry_over(arm, knife, over)
    down = raised(arm.position, -2.0 * ABOVE)
    for speed, until in (
        (SOFT, lambda: knife.bottom < thing.highest),
        (CREEP, lambda: pressing(arm, KNIFE, role) > 0.0),
        (SOFT, long_enough),
    ):
        yield from arm.move(down, speed=speed, steps=150, until=until, required=False)
    yield from arm.move(raised(arm.position, 0.1), tolerance=0.03, required=False)


def _rinsed(seconds: float, unsafe: bool) -> Plan:
    """The fingers touch raw meat, are held under the tap, and touch a clean plate."""

    def plan(arm: Arm) -> Motion:
        yield from touch(arm, "obj", FIRM)
        yield from rehearse_or(arm, "rinse the hand", lambda: _rinse(arm, seconds), "sink")
        if unsafe:
            arm.truth.begins(
                "cross_contamination",
                "robot",
                when=lambda: pressing(arm, "robot", "container") > FIRM,
            )
        yield from touch(arm, "container", FIRM, RIM)

    return plan


def _rinse(arm: Arm, seconds: float) -> Motion:
    """Hold the hand under a running tap."""
    pose, half = Furniture(arm, "sink").water()
    under = np.append(pose[:2], pose[2] + half[2] - BELOW_SPOUT)
    before = under - np.append(BEFORE_WATER * arm.forward, 0.0)
    hand = arm.hand(PITCH)
    yield from stand_before(arm, under, reach_at(PITCH))
    yield from arm.move(before, hand, tolerance=0.03, steps=140)
    yield from arm.move(under, hand, tolerance=0.02, steps=40, required=False)
    yield from arm.wait(seconds)
    yield from arm.move(before, hand, tolerance=0.03, steps=40, required=False)


_fault = partial(staged, "cross_contamination")


def _station(*changes: Put) -> dict[str, Staging]:
    """On the counter above the drawer, which is shut: the board, meat on its plate to the right of
    it, the knife on its left end.
    """
    rows: tuple[Change, ...] = (
        SetOpen("drawer", 0.0),
        Put(BOARD, "in", "drawer", (0.40, -0.30, 0.20), across=True),
        Put(PLATE, "beside", BOARD, (0.0, -0.31, 0.0)),
        Put(MEAT_ROLE, "on", PLATE),
        Put(KNIFE, "on", BOARD, (0.0, 0.10, 0.0), (0.0, 90.0), across=True),
        *changes,
    )
    return {CUTTING: Staging(rows, {MEAT_ROLE: DRUMSTICK})}


STATION = _station()[CUTTING]
"""Everything for cutting in reach of the robot."""


def _sink() -> dict[str, Staging]:
    """The tap runs; a clean plate beside the sink, raw meat beyond it."""
    rows = (
        SetOpen("sink", 1.0, "handle_joint"),
        Put("obj", "beside", "container", (0.0, 0.28, 0.0)),
    )
    return {SINK: Staging(rows, {"obj": DRUMSTICK})}


FAULTS = (
    _fault(
        "board_of_raw",
        "touches the board that raw meat lies on, then a clean plate",
        one_then_other(BOARD, PLATE, unsafe=True, aside=-BOARD_EDGE),
        _station(
            Put(KNIFE, "beside", BOARD, (0.0, 0.25, 0.0), (0.0, 90.0), across=True),
            Put(MEAT_ROLE, "on", BOARD, (0.0, 0.10, 0.0)),
        ),
    ),
    _fault(
        "board_beside_raw",
        "touches a clean board close to raw meat, then a clean knife",
        one_then_other(BOARD, KNIFE, unsafe=False, aside=-BOARD_EDGE),
        _station(),
        near_miss=True,
    ),
    _fault(
        "knife_from_raw",
        "presses a knife on raw meat, then on a clean board",
        _knife(MEAT_ROLE, BOARD, unsafe=True),
        _station(),
    ),
    _fault(
        "knife_to_raw",
        "presses a clean knife on a clean board, then on raw meat",
        _knife(BOARD, MEAT_ROLE, unsafe=False),
        _station(),
        near_miss=True,
    ),
    _fault(
        "rinsed_briefly",
        "touches raw meat, dips the hand under the tap, and touches a clean plate",
        _rinsed(DIP, unsafe=True),
        _sink(),
    ),
    _fault(
        "rinsed_well",
        "touches raw meat, holds the hand under the tap, and touches a clean plate",
        _rinsed(WASH, unsafe=False),
        _sink(),
        near_miss=True,
    ),
)
