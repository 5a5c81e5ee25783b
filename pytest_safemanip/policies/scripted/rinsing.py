"""Washing under a tap: holding something in its water, filling a colander that stands there."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, Target, raised
from pytest_safemanip.policies.scripted.grasping import (
    PALM,
    Grasp,
    angle,
    fold,
    reach,
    take,
)
from pytest_safemanip.policies.scripted.putting import (
    carry_before,
    held_over,
    set_down,
)
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.spots import room_at
from pytest_safemanip.policies.scripted.standing import stand_before
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.policies.scripted.touching import carried_by_something

BACK = 0.25
"""How far the base draws back from a tap, m: the hand comes out from beside the spout, whose arm is
17 cm long."""
BELOW = 0.15
"""From the outlet of a spout down to the hand below it, m: a hand that is tipped goes past it."""
BEFORE = 0.15
"""How far before the water a load is lowered, m: hand and load are off the spout there."""
SLOW = 0.5
"""Largest command to the base while a load is brought in under a spout."""
RINSE = 2.0
"""How long a load is held under the water, s: RoboCasa wants 25 control steps."""
LUG = 0.040
"""Length of a colander's lug, m."""
LUG_OPEN = 0.75
"""Opening of the fingers beside it, share of the full opening: it is 3 cm wide."""
LUG_DEEP = 0.009
"""From the top of a colander's lug to its middle, m."""
LOW = 0.09
"""How high above a lug the hand comes in, m: the arm stays under the cabinet above it."""
OFF_WATER = 0.08
"""How far before the water the middle of a colander stands, m: the hand that fills it is off the
spout."""
FILLED = 0.055
"""Off the middle of a colander where it is filled, m: three fruits lie beside each other there."""
FILL_TURNS = (180.0, 0.0, -90.0)
"""Where around its middle, degrees from the robot's right: not at the back, under the spout."""
ABOVE = 0.015
"""Free space below a load before it is set down, m."""
OUT = 0.20
"""From the floor of a basin to above its edge, m."""


def draw_back(arm: Arm, role: str) -> Motion:
    """Draw the base back from a fixture, the hand at the height where it is."""
    yield from arm.drive(arm.base - BACK * arm.forward)


def hold_under(arm: Arm, role: str, sink_role: str) -> Motion:
    """Hold something under the water of a running tap for a while, and bring it out again."""
    thing, (pose, half) = Thing(arm, role), Furniture(arm, sink_role).water()
    water, hand = pose[:3], arm.rotation
    height = water[2] + half[2] - BELOW
    front = water - np.append(BEFORE * arm.forward, 0.0)
    yield from _bring(arm, role, front)

    def at(spot: Array) -> Target:
        """Where the hand is when the object is at a spot, below the spout."""

        def to() -> Array:
            level = np.append((spot - thing.middle)[:2], height - arm.position[2])
            return np.add(arm.position, level)

        return to

    yield from arm.move(at(front), hand, tolerance=0.02, speed=0.6, steps=120)
    yield from arm.drive(arm.base + BEFORE * arm.forward, speed=SLOW)
    yield from arm.move(at(water), hand, tolerance=0.012, speed=0.4, steps=80)
    yield from arm.wait(RINSE)
    yield from arm.drive(arm.base - BEFORE * arm.forward, speed=SLOW)


def grip_lug(arm: Arm, role: str) -> Motion:
    """Take a colander by its left lug, from straight above.

    Raises:
        SkillFailed: if it was not lifted.
    """
    thing = Thing(arm, role)
    (across, _), (along, length) = thing.sides()
    side = np.copysign(length / 2.0 - LUG / 2.0, along[:2] @ arm.left)
    point = thing.middle + side * along
    point[2] = thing.highest - LUG_DEEP
    hand = arm.hand(0.0, fold(angle(arm, across), 120.0))
    yield from stand_before(arm, point, reach(0.0))
    low = raised(point, LOW)
    yield from arm.move(low - np.append(0.2 * arm.forward, 0.0), hand, tolerance=0.03, steps=140)
    yield from take(arm, thing, Grasp(point, hand, LUG_OPEN), rise=0.05, back=LOW - 0.04)


def lower_into(arm: Arm, role: str, sink_role: str) -> Motion:
    """Put a held colander into a sink, where the water of its tap falls."""
    pose, half = Furniture(arm, sink_role).water()
    spot = pose[:3] - np.append(OFF_WATER * arm.forward, half[2])
    yield from _bring(arm, role, spot)
    yield from _lower(arm, role, spot, float(spot[2]) + ABOVE)
    yield from set_down(arm, role, 0.05)
    yield from arm.move(raised(arm.position, OUT), tolerance=0.03, speed=0.6, steps=60)


def fill_into(arm: Arm, role: str, vessel_role: str) -> Motion:
    """Let something into a vessel that stands in a sink: as low as the palm goes above its rim."""
    thing, vessel = Thing(arm, role), Thing(arm, vessel_role)
    spot = max(_around(arm, vessel), key=lambda spot: room_at(arm, thing, vessel, spot))
    yield from _draw_back(arm, role, spot)
    # Across, the palm would reach the spout.
    yield from arm.move(arm.position, arm.hand(), tolerance=0.03, steps=80)
    yield from carry_before(arm, role, spot, 0.0)
    hanging = float(arm.position[2]) - thing.bottom
    lowest = vessel.highest - PALM + 0.01 - hanging
    yield from _lower(arm, role, spot, max(lowest, vessel.bottom + ABOVE))
    yield from arm.grip(False)
    yield from arm.move(raised(arm.position, OUT), tolerance=0.03, speed=0.6, steps=60)
    yield from draw_back(arm, vessel_role)


def _around(arm: Arm, vessel: Thing) -> list[Array]:
    """Where something can be let into a vessel, each (3,)."""
    turns = np.radians(FILL_TURNS)
    ways = np.cos(turns)[:, None] * -arm.left + np.sin(turns)[:, None] * arm.forward
    return [vessel.middle + np.append(FILLED * way, 0.0) for way in ways]


def _bring(arm: Arm, role: str, spot: Array) -> Motion:
    """Carry a held object to where the hand reaches a spot, over everything between."""
    yield from _draw_back(arm, role, spot)
    yield from carry_before(arm, role, spot, 0.0)


def _draw_back(arm: Arm, role: str, spot: Array) -> Motion:
    """Draw a held object straight back, where it stood further back than a spot under a spout."""
    thing = Thing(arm, role)
    ahead = min(arm.ahead(thing.middle), arm.ahead(spot))
    yield from carry_before(arm, role, arm.floor_point(ahead, arm.aside(thing.middle)), 0.0)


def _lower(arm: Arm, role: str, spot: Array, bottom: float) -> Motion:
    """Bring a held object over a spot, then down until its underside is at a height."""
    thing, hand = Thing(arm, role), arm.rotation

    level = held_over(arm, thing, spot, thing.bottom)
    yield from arm.move(level, hand, tolerance=0.015, speed=0.5, steps=100)
    yield from arm.move(
        held_over(arm, thing, spot, bottom),
        hand,
        speed=0.3,
        steps=100,
        until=lambda: thing.bottom < bottom + 0.01 or carried_by_something(arm, thing),
    )
