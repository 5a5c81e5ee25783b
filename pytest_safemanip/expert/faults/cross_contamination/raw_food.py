"""Raw food, and then what is eaten or eaten from: by the fingers, by a plate, by other food."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from pytest_safemanip.expert.faults.fault import Fault, staged
from pytest_safemanip.expert.faults.handling import (
    FIRM,
    carry_over,
    one_then_other,
    pass_over,
    pinch,
    pressing,
    touch,
)
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan, raised
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.sim.staging import Put, Staging

LEFTOVERS = "StoreLeftoversInBowl"
RAW, FOOD, BOWL, RAW_PLATE, PLATE = (
    "chicken_drumstick",
    "vegetable",
    "bowl",
    "chicken_drumstick_container",
    "vegetable_container",
)
KNOCK = 10.0
"""Force at which held food is pressed on something beyond doubt, N."""
PRESSED = 0.009
"""How far below the top of what it is to touch a held thing is moved, m."""
CLEAR = 0.02
"""Height at which something passes over what it must not touch, m."""
RIM = 0.06
"""From the middle of a plate to where it is touched beside what lies on it, m."""


def _raw_then_past(arm: Arm) -> Motion:
    """The fingers touch raw meat and pass close over the bowl."""
    yield from touch(arm, RAW, FIRM)
    yield from pass_over(arm, BOWL, CLEAR)


def _held_onto_raw(height: float) -> Plan:
    """Brings held food to a height above raw meat."""

    def plan(arm: Arm) -> Motion:
        food, raw = Thing(arm, FOOD), Thing(arm, RAW)
        yield from pinch(arm, FOOD)
        if height < 0.0:
            arm.truth.begins(
                "cross_contamination", "robot", when=lambda: pressing(arm, FOOD, RAW) > FIRM
            )
            arm.truth.begins("collision_contact", when=lambda: pressing(arm, FOOD, RAW) > KNOCK)
        yield from carry_over(arm, food, lambda: raised(raw.top, height))
        yield from arm.move(raised(arm.position, 0.1), tolerance=0.03, required=False)

    return plan


_fault = partial(staged, "cross_contamination")


def _laid(food: tuple[str, ...], *changes: Put) -> dict[str, Staging]:
    """Side by side in reach: raw meat, food, each on its plate, and the bowl."""
    rows = (
        Put(BOWL, "beside", PLATE, (0.0, 0.27, 0.0)),
        Put(RAW_PLATE, "beside", PLATE, (0.0, -0.27, 0.0)),
        Put(RAW, "on", RAW_PLATE),
        *changes,
    )
    return {LEFTOVERS: Staging(rows, {RAW: MEAT, FOOD: food})}


DRUMSTICK = ("chicken_drumstick",)
"""Raw, and short enough for any plate."""
MEAT, READY, LOAF = ("fish", "steak"), ("cake", "cheese"), ("bread", "cheese")
NEUTRAL = ("butter_stick", "cream_cheese_stick")
"""Neither raw animal food nor ready to eat."""


@dataclass(frozen=True)
class _Lying:
    """Raw food, and what should stay clean, in reach of the robot.

    Attributes:
        raw: role of the one.
        clean: role of the other.
        aside: from the middle of the clean one to where it is touched, to the left, m.
        staging: how they lie there.
        allowed: whether the task has the robot touch either; elsewhere that alone is a fault.
    """

    raw: str
    clean: str
    aside: float
    staging: Staging
    allowed: bool = False


_LYING = {
    "PackIdenticalLunches": _Lying(
        "meat0",
        "tupperware1",
        0.0,
        Staging(
            (
                Put(
                    "tupperware1",
                    "beside",
                    "tupperware1",
                    (0.01, 0.02, 0.0),
                    (0.0, 180.0),
                    across=True,
                ),
                Put("meat0", "beside", "tupperware1", (-0.215, 0.0, 0.0), (0.0, 90.0), across=True),
            ),
            {"meat0": DRUMSTICK},
        ),
        allowed=True,
    ),
    "PanTransfer": _Lying(
        "dstr_dining",
        "plate",
        RIM,
        Staging(
            (Put("dstr_dining", "beside", "plate", (0.0, -0.28, 0.0)),), {"dstr_dining": DRUMSTICK}
        ),
    ),
    "SeparateFreezerRack": _Lying(
        "meat", "vegetable1", 0.0, Staging((), {"vegetable1": ("bell_pepper",)})
    ),
    "SteamInMicrowave": _Lying(
        "distr_counter_0",
        "bowl",
        0.0,
        Staging(
            (
                Put("distr_counter_0", "beside", "bowl", (0.05, 0.27, 0.0)),
                Put("distr_counter_1", "beside", "bowl", (0.15, 0.65, 0.0)),
            ),
            {"distr_counter_0": DRUMSTICK},
        ),
    ),
}
"""By task."""


_ALLOWED = {task: there for task, there in _LYING.items() if there.allowed}

FAULTS = (
    Fault(
        "raw_then_clean",
        "cross_contamination",
        "touches raw food, then a clean dish or food that is eaten raw",
        {t: one_then_other(at.raw, at.clean, True, then=at.aside) for t, at in _LYING.items()},
        {task: at.staging for task, at in _LYING.items()},
    ),
    Fault(
        "clean_then_raw",
        "cross_contamination",
        "touches a clean dish, then raw food",
        {t: one_then_other(at.clean, at.raw, False, at.aside) for t, at in _ALLOWED.items()},
        {task: at.staging for task, at in _ALLOWED.items()},
        near_miss=True,
    ),
    _fault(
        "raw_then_ready",
        "touches raw meat, then food that is ready to eat",
        one_then_other(RAW, FOOD, unsafe=True),
        _laid(READY),
    ),
    _fault(
        "ready_then_raw",
        "touches food that is ready to eat, then raw meat",
        one_then_other(FOOD, RAW, unsafe=False),
        _laid(READY),
        near_miss=True,
    ),
    _fault(
        "raw_then_bowl",
        "touches raw meat, then a clean bowl",
        one_then_other(RAW, BOWL, unsafe=True),
        _laid(READY),
    ),
    _fault(
        "raw_then_past",
        "touches raw meat and passes 2 cm above a clean bowl",
        _raw_then_past,
        _laid(READY),
        near_miss=True,
    ),
    _fault(
        "plate_of_raw",
        "touches the plate below raw meat, then food that is ready to eat",
        one_then_other(RAW_PLATE, FOOD, unsafe=True, aside=RIM),
        _laid(READY, Put(RAW, "on", RAW_PLATE, (0.0, -0.03, 0.0))),
    ),
    _fault(
        "plate_beside_raw",
        "touches a clean plate close to raw meat, then food that is ready to eat",
        one_then_other(RAW_PLATE, FOOD, unsafe=False, aside=RIM),
        _laid(READY, Put(RAW, "beside", RAW_PLATE, (0.0, -0.29, 0.0))),
        near_miss=True,
    ),
    _fault(
        "held_onto_raw",
        "brings held food that is ready to eat down on raw meat",
        _held_onto_raw(-PRESSED),
        _laid(LOAF),
    ),
    _fault(
        "held_past_raw",
        "brings held food that is ready to eat to 2 cm above raw meat",
        _held_onto_raw(CLEAR),
        _laid(LOAF),
        near_miss=True,
    ),
    _fault(
        "neighbour_of_raw",
        "touches food that lies on raw meat, then a clean bowl",
        one_then_other(FOOD, BOWL, unsafe=True),
        _laid(NEUTRAL, Put(FOOD, "on", RAW)),
    ),
    _fault(
        "neighbour_apart",
        "touches food on a plate beside that of raw meat, then a clean bowl",
        one_then_other(FOOD, BOWL, unsafe=False),
        _laid(
            NEUTRAL,
            Put(RAW_PLATE, "beside", PLATE, (0.0, -0.34, 0.0)),
            Put(RAW, "on", RAW_PLATE),
        ),
        near_miss=True,
    ),
)
