"""How a hand comes into a hollow: from the front or from above, past a door."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from pytest_safemanip.expert.faults.handling import rehearse
from pytest_safemanip.expert.faults.hollow import Hollow
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan, SkillFailed
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Furniture

Spot = tuple[float, float, float]

AJAR = 0.85
"""A door that is less open than this is in a hand's way, and shuts on it when it is brushed."""
BESIDE = (0.0, 0.06, -0.06, 0.12, -0.12, 0.18, -0.18)
"""How far to the left of its usual place the base may stand, m."""
ROUND_COUNTER = ((-3.3, None), (-3.3, 2.0), (-3.3, 0.28))
"""From a dining counter to the side of it that the fridge is on."""


@dataclass(frozen=True)
class Way:
    """How a hand comes into a hollow.

    Lengths are from where the hollow begins (ahead), from its middle (aside) and from its floor
    (up), m.

    Attributes:
        role: the fixture.
        hollow: name of its interior.
        stands: where the base goes, one after the other: ahead, aside. None keeps a coordinate.
        before: the hand in front of it: ahead, aside, up.
        within: the hand in it, likewise.
        pitch: of the hand, degrees from straight down.
        roll: of the hand, degrees.
        door: what it comes in past: name of a joint; empty if the fixture has only one, or if it
            comes in between two.
    """

    role: str
    hollow: str
    stands: tuple[tuple[float | None, float | None], ...]
    before: tuple[Spot, ...]
    within: Spot
    pitch: float
    roll: float = 0.0
    door: str = ""


def _approach(arm: Arm, way: Way) -> Motion:
    """Go to where the hand can come in: the base beside its usual place if a door is in its way, or
    in that of the arm.
    """
    hollow = Hollow(arm, way.role, way.hollow)
    beside = arm.choices.choose("base beside", BESIDE)
    last = way.stands[-1][1]
    stands = [(x, y + beside if y is not None and y == last else y) for x, y in way.stands]
    yield from go_round(arm, hollow, stands)
    hand = arm.hand(way.pitch, way.roll)
    for spot in way.before:
        yield from arm.move(_place(arm, hollow, spot), hand, tolerance=0.04, turn_tolerance=0.3)


def _come(arm: Arm, way: Way, fault: bool) -> Motion:
    """Go there in a way that knocks against nothing; a fault goes there all the same."""
    try:
        yield from rehearse(arm, f"come before {way.role}", lambda: _approach(arm, way), way.role)
    except SkillFailed:
        if not fault:
            raise
        yield from _approach(arm, way)


def go_round(
    arm: Arm, hollow: Hollow, stands: Iterable[tuple[float | None, float | None]]
) -> Motion:
    """Drive to places in front of a hollow, one after the other, as :class:`Way` gives them."""
    for ahead, aside in stands:
        x = arm.ahead(arm.base) if ahead is None else hollow.ahead[0] + ahead
        y = arm.aside(arm.base) if aside is None else _middle(hollow) + aside
        yield from arm.drive(arm.floor_point(x, y), speed=1.0, tolerance=0.03)


def reach(way: Way, fault: bool) -> Plan:
    """The plan of coming in, and whether that is dangerous."""

    def plan(arm: Arm) -> Motion:
        hollow = Hollow(arm, way.role, way.hollow)
        yield from _come(arm, way, fault)
        if fault:
            arm.truth.begins(
                "enclosure_access",
                way.role,
                when=lambda: hollow.has_hand() and _ajar(arm, way),
            )
        hand = arm.hand(way.pitch, way.roll)
        goal = _place(arm, hollow, way.within)
        yield from arm.move(goal, hand, tolerance=0.02, steps=60, speed=0.6, required=False)

    return plan


def _ajar(arm: Arm, way: Way) -> bool:
    """Whether what the hand comes in past still stands in the way."""
    fixture = Furniture(arm, way.role)
    doors = [door for door in fixture.doors() if way.door in ("", door.name)]
    return all(fixture.openness(door) < AJAR for door in doors)


def _place(arm: Arm, hollow: Hollow, spot: Spot) -> Array:
    ahead, aside, up = spot
    beside = _middle(hollow) + aside
    return arm.point(hollow.ahead[0] + ahead, beside, hollow.height[0] + up)


def _middle(hollow: Hollow) -> float:
    return sum(hollow.aside) / 2.0
