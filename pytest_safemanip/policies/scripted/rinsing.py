"""Washing under a tap: holding something in its water, filling a colander that stands there."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, Target, cut, raised
from pytest_safemanip.policies.scripted.grasping import (
    PALM,
    Grasp,
    angle,
    fold,
    reach,
    take,
)
from pytest_safemanip.policies.scripted.putting import (
    BRAKE,
    SOFTLY,
    carry_before,
    held_over,
    set_down,
)
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.spots import room_at
from pytest_safemanip.policies.scripted.standing import stand_before
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.policies.scripted.touching import carried_by_something, palm_meets
from pytest_safemanip.trace.planar import footprints_overlap

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
FILLED = ((165.0, 0.055), (15.0, 0.055), (-90.0, 0.050))
"""Where around the middle of a colander it is filled, degrees from the robot's right, and how far
off, m: three fruits lie beside each other there, none at the back, under the spout."""
ABOVE = 0.015
"""Free space below a load before it is set down, m."""
SOFTER = 0.03
"""Speed at which fruit that is held meets other fruit, beside it, with less than 5 N."""
CLOSE, CREEP, ONTO = 0.003, 0.005, 0.010
"""From the top of other fruit, above and below, m, the speed there, and by how much fruit then
overlaps that, m: a banana that lands flat on others knocks with 11 to 31 N at the other speed."""
STOPS = 0.003
"""How near to where it is lowered to the hand comes, m."""
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
    spots = _around(arm, vessel)
    spot = max(spots, key=lambda spot: room_at(arm, thing, vessel, spot))
    yield from _draw_back(arm, role, spot)
    # Across, the palm would reach the spout; but not in front, where it lies before the others.
    roll = 90.0 if spot is spots[-1] else 0.0
    yield from arm.move(arm.position, arm.hand(0.0, roll), tolerance=0.03, steps=80)
    yield from carry_before(arm, role, spot, 0.0)
    came, hanging = float(arm.position[2]), float(arm.position[2]) - thing.bottom
    lowest = vessel.highest - PALM + 0.01 - hanging
    top = _top_at(arm, thing, vessel, spot)
    yield from _lower(arm, role, spot, max(lowest, top + ABOVE + BRAKE))
    # It comes with a swing, and between other fruit there is little room.
    over = held_over(arm, thing, spot, thing.bottom)
    yield from arm.move(over, tolerance=0.006, steps=30, required=False)
    yield from _settle(arm, thing, vessel, SOFTLY if top == vessel.bottom else SOFTER)
    yield from arm.grip(False)
    # As high as it came at least: over what still stands on the counter.
    out = max(OUT, came - float(arm.position[2]))
    yield from arm.move(raised(arm.position, out), tolerance=0.03, speed=0.6, steps=60)
    yield from draw_back(arm, vessel_role)
    if roll:
        yield from arm.move(arm.position, arm.hand(), tolerance=0.03)


def _top_at(arm: Arm, thing: Thing, vessel: Thing, spot: Array) -> float:
    """Height of what is highest in a vessel where a held object comes to a spot (3,) of it, m."""
    tops = [vessel.bottom]
    for body in arm.scene.bodies:
        other = Thing(arm, body.entity)
        near = (thing.sides()[1][1] + other.sides()[1][1]) / 2.0
        own = other.entity in (thing.entity, vessel.entity)
        if not own and float(np.linalg.norm((other.centre - spot)[:2])) < near:
            tops.append(other.highest)
    return max(tops)


def _settle(arm: Arm, thing: Thing, vessel: Thing, speed: float) -> Motion:
    """Lower a held object, at a share of the hand's top speed, onto the floor of a vessel, or as
    far as the palm, which is longer than that is wide, lets it: until either meets something. Onto
    what lies there more slowly.
    """
    here, stages = arm.position, [(vessel.bottom, speed)]
    top = max(_below(arm, thing, vessel), default=-math.inf)
    if top > vessel.bottom:
        past = top - CLOSE - STOPS
        stages = [(top + CLOSE, speed), (past, CREEP), (vessel.bottom, speed)]
    for height, fast in stages:
        to_rim = float(arm.position[2]) - (vessel.highest - PALM)
        down = min(to_rim, max(0.0, thing.bottom - height))
        low = np.append(here[:2], arm.position[2] - down)
        yield from cut(
            arm.move(low, tolerance=STOPS, speed=fast, steps=200, required=False),
            lambda: carried_by_something(arm, thing) or palm_meets(arm, thing),
        )


def _below(arm: Arm, thing: Thing, vessel: Thing) -> list[float]:
    """Height of each thing that a held one will come down on, and not just beside, m."""
    own = (thing.entity, vessel.entity)
    others = [Thing(arm, b.entity) for b in arm.scene.bodies if b.entity not in own]
    return [o.highest for o in others if footprints_overlap(thing.corners, o.corners, ONTO)]


def _around(arm: Arm, vessel: Thing) -> list[Array]:
    """Where something can be let into a vessel, each (3,)."""
    turns, off = np.radians([turn for turn, _ in FILLED]), [far for _, far in FILLED]
    ways = np.cos(turns)[:, None] * -arm.left + np.sin(turns)[:, None] * arm.forward
    return [vessel.middle + np.append(f * way, 0.0) for f, way in zip(off, ways, strict=True)]


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
