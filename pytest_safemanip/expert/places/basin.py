"""A sink: what lies in its basin is grasped where the palm has room, a pan is lowered into it, food
is rinsed and a colander filled under its tap.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from pytest_safemanip.expert.motions.grasping import across, grasp_and_lift
from pytest_safemanip.expert.motions.handles import (
    FOLDED_HEIGHT,
    HANDLE_OVER,
    HANDLE_TUCKED,
    STEADY,
    grasp_handle,
    handle,
    level,
)
from pytest_safemanip.expert.motions.putting import BRAKE, SOFTLY, carry_before, held_over, set_down
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, Target, cut, raised
from pytest_safemanip.expert.robot.hand import (
    GAP,
    PALM,
    Grasp,
    finger_angle,
    hand_corners,
    reach_at,
)
from pytest_safemanip.expert.robot.rotations import Array, about_z, fold
from pytest_safemanip.expert.world.contacts import carried_by_something, palm_meets
from pytest_safemanip.expert.world.free_spots import room_at
from pytest_safemanip.expert.world.standing import stand_before
from pytest_safemanip.expert.world.things import Furniture, Thing, other_things
from pytest_safemanip.trace.geometry import matrix
from pytest_safemanip.trace.planar import footprints_overlap

COUNTER_BACK = 0.35
"""How far the base draws back from a counter before a load is turned, m."""
OVER_COUNTER = 0.08
"""Free space below a load that is brought to a basin, m: over what lies on the counter."""
END_ROOM = 0.015
"""From a load to the end of a basin, m."""
BEFORE_MIDDLE = 0.06
"""How far before the middle of a basin a pan is lowered, m: the hand stays off the spout."""
FIRST_REACH, FIRST_PITCH = 0.32, 18.0
"""Base to hand, m, and degrees from straight down, when nothing is held: from its first posture the
arm comes to a tap without touching the spout."""


def grasp_handle_from_above(arm: Arm, role: str) -> Motion:
    """Pinch a vessel's handle where it leaves the vessel, the hand straight down: so it goes into a
    basin, and turns to all sides.

    Raises:
        SkillFailed: if it was not lifted.
    """
    yield from grasp_handle(arm, role, 0.0)


def place_in_basin(arm: Arm, role: str, sink_role: str) -> Motion:
    """Lower a vessel that is held by its handle into the right end of a basin, and draw back.

    Raises:
        SkillFailed: if the hand or the base does not get there.
    """
    thing, sink = Thing(arm, role), Furniture(arm, sink_role)
    pose, half = sink.interior()
    top, floor = float(pose[2] + half[2]), float(pose[2] - half[2])
    hand = level(arm, thing, np.append(-arm.left, 0.0))
    where = right_end(arm, thing, sink)
    yield from bring_level(arm, thing, hand, where)

    for height in (top, floor):
        over = held_over(arm, thing, where, height + HANDLE_OVER)
        yield from arm.move(over, hand, tolerance=0.01, speed=STEADY, steps=80)
    yield from set_down(arm, role)
    yield from arm.move(
        raised(arm.position, top - floor + OVER_COUNTER), tolerance=0.03, speed=STEADY
    )
    yield from arm.drive(arm.base - COUNTER_BACK * arm.forward)
    folded = arm.before(FIRST_REACH, FOLDED_HEIGHT)
    yield from arm.move(folded, arm.hand(FIRST_PITCH), tolerance=0.05, turn_tolerance=0.3)


def right_end(arm: Arm, thing: Thing, sink: Furniture) -> Array:
    """Where the middle of a vessel goes whose handle points to the right, at the height of the
    basin's edge (3,).
    """
    pose, half = sink.interior()
    long = thing.reach(handle(thing)[1]) + float(np.linalg.norm((thing.centre - thing.middle)[:2]))
    aside = arm.aside(pose) - half[0] + END_ROOM + long
    return arm.point(arm.ahead(pose) - BEFORE_MIDDLE, aside, float(pose[2] + half[2]))


def bring_level(arm: Arm, thing: Thing, hand: Array, where: Array) -> Motion:
    """Draw a held vessel back, turn it, and drive until it is over a point.

    Args:
        arm: the arm.
        thing: the vessel.
        hand: orientation of the hand at which the vessel is level (3, 3).
        where: the point, at the height of what it is carried over (3,).
    """
    yield from arm.drive(arm.base - COUNTER_BACK * arm.forward, speed=STEADY)
    base = arm.ahead(arm.base)
    rise = arm.position[2] + where[2] + OVER_COUNTER - thing.bottom
    away = arm.point(base + HANDLE_TUCKED, arm.aside(arm.base), rise)
    yield from arm.move(away, hand, tolerance=0.02, turn_tolerance=0.1, speed=STEADY, steps=160)
    for ahead in (base, base + arm.ahead(where) - arm.ahead(thing.middle)):
        shift = arm.aside(where) - arm.aside(thing.middle)
        yield from arm.drive(arm.floor_point(ahead, arm.aside(arm.base) + shift), speed=STEADY)


TAP_BACK = 0.25
"""How far the base draws back from a tap, m: the hand comes out from beside the spout, whose arm is
17 cm long."""
BELOW_SPOUT = 0.15
"""From the outlet of a spout down to the hand below it, m: a hand that is tipped goes past it."""
BEFORE_WATER = 0.15
"""How far before the water a load is lowered, m: hand and load are off the spout there."""
TAP_SPEED = 0.5
"""Largest command to the base while a load is brought in under a spout."""
RINSE = 2.0
"""How long a load is held under the water, s: RoboCasa wants 25 control steps."""
COLANDER_LUG = 0.040
"""Length of a colander's lug, m."""
LUG_OPEN = 0.75
"""Opening of the fingers beside it, share of the full opening: it is 3 cm wide."""
LUG_DEEP = 0.009
"""From the top of a colander's lug to its middle, m."""
LUG_FROM_ABOVE = 0.09
"""How high above a lug the hand comes in, m: the arm stays under the cabinet above it."""
OFF_WATER = 0.08
"""How far before the water the middle of a colander stands, m: the hand that fills it is off the
spout."""
FILLED = ((165.0, 0.055), (15.0, 0.055), (-90.0, 0.050))
"""Where around the middle of a colander it is filled, degrees from the robot's right, and how far
off, m: three fruits lie beside each other there, none at the back, under the spout."""
FILLED_OVER = 0.015
"""Free space below a load before it is set down, m."""
SOFTER = 0.03
"""Speed at which fruit that is held meets other fruit, beside it, with less than 5 N."""
NEAR_FRUIT, FRUIT_SPEED, FRUIT_OVERLAP = 0.003, 0.005, 0.010
"""From the top of other fruit, above and below, m, the speed there, and by how much fruit then
overlaps that, m: a banana that lands flat on others knocks with 11 to 31 N at the other speed."""
LOWERED_WITHIN = 0.003
"""How near to where it is lowered to the hand comes, m."""
OVER_BASIN = 0.20
"""From the floor of a basin to above its edge, m."""


def draw_back_from_tap(arm: Arm) -> Motion:
    """Draw the base back, the hand at the height where it is."""
    yield from arm.drive(arm.base - TAP_BACK * arm.forward)


def rinse(arm: Arm, role: str, sink_role: str) -> Motion:
    """Hold something under the water of a running tap for a while, and bring it out again."""
    thing, (pose, half) = Thing(arm, role), Furniture(arm, sink_role).water()
    water, hand = pose[:3], arm.rotation
    height = water[2] + half[2] - BELOW_SPOUT
    front = water - arm.onward(BEFORE_WATER)
    yield from _carry_before(arm, role, front)

    def at(spot: Array) -> Target:
        """Where the hand is when the object is at a spot, below the spout."""

        def to() -> Array:
            level = np.append((spot - thing.middle)[:2], height - arm.position[2])
            return np.add(arm.position, level)

        return to

    yield from arm.move(at(front), hand, tolerance=0.02, speed=0.6, steps=120)
    yield from arm.drive(arm.base + BEFORE_WATER * arm.forward, speed=TAP_SPEED)
    yield from arm.move(at(water), hand, tolerance=0.012, speed=0.4, steps=80)
    yield from arm.wait(RINSE)
    yield from arm.drive(arm.base - BEFORE_WATER * arm.forward, speed=TAP_SPEED)


def grasp_colander_lug(arm: Arm, role: str) -> Motion:
    """Take a colander by its left lug, from straight above.

    Raises:
        SkillFailed: if it was not lifted.
    """
    thing = Thing(arm, role)
    (across, _), (along, length) = thing.sides()
    side = np.copysign(length / 2.0 - COLANDER_LUG / 2.0, along[:2] @ arm.left)
    point = thing.middle + side * along
    point[2] = thing.highest - LUG_DEEP
    hand = arm.hand(0.0, fold(finger_angle(arm, across), 120.0))
    yield from stand_before(arm, point, reach_at(0.0))
    low = raised(point, LUG_FROM_ABOVE)
    yield from arm.move(low - arm.onward(0.2), hand, tolerance=0.03, steps=140)
    yield from grasp_and_lift(
        arm, thing, Grasp(point, hand, LUG_OPEN), rise=0.05, back=LUG_FROM_ABOVE - 0.04
    )


def place_under_tap(arm: Arm, role: str, sink_role: str) -> Motion:
    """Put a held colander into a sink, where the water of its tap falls."""
    pose, half = Furniture(arm, sink_role).water()
    spot = pose[:3] - np.append(OFF_WATER * arm.forward, half[2])
    yield from _carry_before(arm, role, spot)
    yield from _lower_over(arm, role, spot, float(spot[2]) + FILLED_OVER)
    yield from set_down(arm, role, 0.05)
    yield from arm.move(raised(arm.position, OVER_BASIN), tolerance=0.03, speed=0.6, steps=60)


def place_into_colander(arm: Arm, role: str, vessel_role: str) -> Motion:
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
    yield from _lower_over(arm, role, spot, max(lowest, top + FILLED_OVER + BRAKE))
    # It comes with a swing, and between other fruit there is little room.
    over = held_over(arm, thing, spot, thing.bottom)
    yield from arm.move(over, tolerance=0.006, steps=30, required=False)
    yield from _settle(arm, thing, vessel, SOFTLY if top == vessel.bottom else SOFTER)
    yield from arm.grip(False)
    # As high as it came at least: over what still stands on the counter.
    out = max(OVER_BASIN, came - float(arm.position[2]))
    yield from arm.move(raised(arm.position, out), tolerance=0.03, speed=0.6, steps=60)
    yield from draw_back_from_tap(arm)
    if roll:
        yield from arm.move(arm.position, arm.hand(), tolerance=0.03)


def _top_at(arm: Arm, thing: Thing, vessel: Thing, spot: Array) -> float:
    """Height of what is highest in a vessel where a held object comes to a spot (3,) of it, m."""
    tops = [vessel.bottom]
    for other in other_things(arm, thing, vessel):
        near = (thing.sides()[1][1] + other.sides()[1][1]) / 2.0
        if float(np.linalg.norm((other.centre - spot)[:2])) < near:
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
        past = top - NEAR_FRUIT - LOWERED_WITHIN
        stages = [(top + NEAR_FRUIT, speed), (past, FRUIT_SPEED), (vessel.bottom, speed)]
    for height, fast in stages:
        to_rim = float(arm.position[2]) - (vessel.highest - PALM)
        down = min(to_rim, max(0.0, thing.bottom - height))
        low = np.append(here[:2], arm.position[2] - down)
        yield from cut(
            arm.move(low, tolerance=LOWERED_WITHIN, speed=fast, steps=200, required=False),
            lambda: carried_by_something(arm, thing) or palm_meets(arm, thing),
        )


def _below(arm: Arm, thing: Thing, vessel: Thing) -> list[float]:
    """Height of each thing that a held one will come down on, and not just beside, m."""
    others = other_things(arm, thing, vessel)
    return [
        o.highest for o in others if footprints_overlap(thing.corners, o.corners, FRUIT_OVERLAP)
    ]


def _around(arm: Arm, vessel: Thing) -> list[Array]:
    """Where something can be let into a vessel, each (3,)."""
    turns, off = np.radians([turn for turn, _ in FILLED]), [far for _, far in FILLED]
    ways = np.cos(turns)[:, None] * -arm.left + np.sin(turns)[:, None] * arm.forward
    return [vessel.middle + np.append(f * way, 0.0) for f, way in zip(off, ways, strict=True)]


def _carry_before(arm: Arm, role: str, spot: Array) -> Motion:
    """Carry a held object to where the hand reaches a spot, over everything between."""
    yield from _draw_back(arm, role, spot)
    yield from carry_before(arm, role, spot, 0.0)


def _draw_back(arm: Arm, role: str, spot: Array) -> Motion:
    """Draw a held object straight back, where it stood further back than a spot under a spout."""
    thing = Thing(arm, role)
    ahead = min(arm.ahead(thing.middle), arm.ahead(spot))
    yield from carry_before(arm, role, arm.floor_point(ahead, arm.aside(thing.middle)), 0.0)


def _lower_over(arm: Arm, role: str, spot: Array, bottom: float) -> Motion:
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


BASIN_PITCHES = ((-0.05, 0.03, 0.11), (-5.0, 10.0, 20.0))
"""From the middle of a basin to what lies in it, m, and degrees from straight down: at the back the
hand goes in under the spout; further to the front it is steeper, for the arm to stay off the front
wall."""
BEFORE_SPOUT = 0.05
"""From the middle of a basin to where the hand passes in front of the spout, m."""
PALM_ROOM = 0.010
"""Kept free around the palm, m: it arrives within 6 mm, and a hand that is 3 degrees askew has its
ends 5 mm elsewhere."""
PLUMP_RATIO = 1.6
"""Length by width up to which fingers that close aslant turn a thing between them."""
FINGER_TURNS = (0.0, 15.0, -15.0, 30.0, -30.0, 45.0, -45.0, 60.0, -60.0, 75.0, -75.0, 90.0)
"""Of the fingers from a thing's narrow side, degrees, the least first."""
STEEPER = (0.0, 5.0, 10.0)
"""How much steeper than elsewhere in the basin the hand may be, degrees."""
END_SHARES = (0.0, 0.1, -0.1, 0.2, -0.2)
"""From the middle of a long thing to where it is held, shares of its length."""


def grasp_in_basin(arm: Arm, role: str, sink_role: str) -> Motion:
    """Pinch an object in a sink, and bring it out in front of the spout.

    Raises:
        SkillFailed: if it is too wide, lies where the hand has no room, or was not lifted.
    """
    thing, sink = Thing(arm, role), Furniture(arm, sink_role)
    middle = arm.ahead(sink.interior(thing.centre)[0])
    deep = arm.ahead(thing.centre) - middle
    pitch = float(np.interp(deep, *BASIN_PITCHES))
    grasp = roomy(arm, thing, sink, pitch)
    where = thing.centre
    yield from stand_before(arm, where, reach_at(pitch))
    above = arm.ahead(grasp.point) - 0.15 * math.sin(math.radians(pitch))
    front = arm.point(min(above, middle - 0.08), arm.aside(where), grasp.point[2] + 0.20)
    yield from arm.move(front, grasp.hand, tolerance=0.03, turn_tolerance=0.1, steps=120)
    yield from grasp_and_lift(arm, thing, grasp, rise=0.05)
    ahead = min(arm.ahead(arm.position), middle - BEFORE_SPOUT)
    out = arm.point(ahead, arm.aside(arm.position), arm.position[2] + 0.18)
    yield from arm.move(out, tolerance=0.03, speed=0.6, steps=60)


def roomy(arm: Arm, thing: Thing, sink: Furniture, pitch: float) -> Grasp:
    """The first grasp in which the palm has room in the basin, else the one with most of it.

    Args:
        arm: the arm.
        thing: what lies in the basin.
        sink: the basin.
        pitch: of the hand, degrees, where there is room for it.

    Raises:
        SkillFailed: if it is too wide, or lies where the palm would touch a wall or the floor.
    """
    best, most = None, 0.0
    for grasp in _grasps(arm, thing, pitch):
        room = palm_room(grasp, sink.interior(thing.centre))
        if room > most:
            best, most = grasp, room
        if room >= PALM_ROOM:
            break
    if best is None:
        raise SkillFailed("the hand has no room between the object and the walls of the basin")
    return best


def _grasps(arm: Arm, thing: Thing, pitch: float) -> Iterator[Grasp]:
    """Grasps of a thing, the one that holds it best first."""
    (axis, width), (_, length) = thing.sides()
    plump = length < PLUMP_RATIO * width
    for steeper in STEEPER:
        for turn in FINGER_TURNS if plump else (0.0,):
            if turn and 2.0 * thing.reach(about_z(turn) @ axis) > GAP:
                continue
            for end in (0.0,) if plump else END_SHARES:
                yield across(arm, thing, pitch - steeper, end * length, turn)


def palm_room(grasp: Grasp, basin: tuple[Array, Array]) -> float:
    """From the palm, where the fingers close, to the basin's walls and floor, m; what is above the
    basin has all the room there is.
    """
    pose, half = basin
    palm = hand_corners(grasp.hand) + grasp.point - pose[:3]
    own = palm @ matrix(pose[3:])
    inside = own[own[:, 2] < half[2]]
    walls = (half[:2] - np.abs(inside[:, :2])).min(initial=math.inf)
    return float(min(walls, (inside[:, 2] + half[2]).min(initial=math.inf)))
