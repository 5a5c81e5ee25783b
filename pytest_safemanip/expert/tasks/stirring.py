"""Stirring what is in a pot on a stove, with a spatula that lies on the counter."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from pytest_safemanip.expert.motions.driving import draw_in
from pytest_safemanip.expert.motions.grasping import come_in, lift
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.robot.base import CAREFUL
from pytest_safemanip.expert.robot.hand import Grasp, reach_at
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.contacts import palm_presses
from pytest_safemanip.expert.world.hand_room import beside_furniture
from pytest_safemanip.expert.world.standing import stand_before
from pytest_safemanip.expert.world.things import Thing, other_things
from pytest_safemanip.trace.geometry import corners, matrix

STIR_PITCH = 70.0
"""Degrees from straight down: the blade slopes as much, and the forearm is low enough."""
STIR_REACH = 0.68
"""Base to hand at which the arm holds that pitch so low, m; nearer, the wrist comes to its end."""
BLADE = 0.35
"""Length of a spatula's blade, share of its own."""
ROOTS = (0.03, 0.018, 0.05, 0.07, 0.09)
"""From the end of the blade's root to where the handle is pinched, m, the preferred first: the
farther, the more the blade turns it in the fingers."""
ROOM_AROUND = (0.016, 0.030)
"""Least free space around the hand, and as much as is as good as more, m: a toaster's lever stands
out from what is known of it."""
HANDLE_FROM_ABOVE = 0.20
"""How far above the handle the hand comes down from, m: over a toaster beside it."""
TIPS_OFF_COUNTER = 0.0125
"""Grip point above the underside of a handle, m: the fingertips stay off the counter."""
PASSING_HEIGHT = 1.28
"""Height of the hand on its way along the counter, m: its fingers pass over a toaster."""
MOST_ROLL = 120.0
"""To which the last joint of the wrist turns, degrees."""
TURN_HEIGHT = 1.20
"""Of the hand while it is pitched, m: the blade comes down to 14 cm below it."""
BLADE_OVER = 0.03
"""From what is highest to the end of a blade that passes over it, m."""
BLADE_DEEP = 0.024
"""From a pot's underside up to the end of the blade, m: at half the height of a mushroom, which
would tip if it were pushed lower, and hop."""
FAR_END, NEAR_END = 0.050, -0.050
"""Where a stroke begins at the farthest, and ends, from the middle of the pot towards its far side,
m."""
BLADE_ROOM = 0.010
"""From what is in a pot to where a stroke begins, m: half the blade's thickness, and some room."""
OFF_WALL = 0.015
"""Kept free between the upper end of a spatula and the wall behind a pot, m."""
STROKE_STEP = 0.0008
"""By how much the blade is drawn on in a control step, m. Faster, what it pushes hops: on landing
it stops, and the blade hits it anew."""
MOST_TURN = 10.0
"""How far the blade turns in the fingers before a stroke is ended, degrees: what it pushes has come
to the pot's near wall."""
STROKES = 3


def grasp_blade_root(arm: Arm, role: str) -> Motion:
    """Pinch a spatula near its blade, from straight above, the palm on its handle, so that its
    blade can be turned to the robot.

    Raises:
        SkillFailed: if there is no room for the hand beside it, or if it was not lifted.
    """
    tool = Thing(arm, role)
    yield from draw_in(arm)
    high = np.append(arm.position[:2], PASSING_HEIGHT)
    yield from arm.move(high, tolerance=0.03, speed=0.6, required=False)
    yield from stand_before(arm, tool.com, reach_at(0.0))
    way = long_axis(tool)
    hand = arm.hand(0.0, min((arm.bearing(way) + 180.0) % 360.0, MOST_ROLL))
    root = tool.centre + tool.reach(way) * (1.0 - 2.0 * BLADE) * way
    places = [np.append((root - off * way)[:2], tool.highest) for off in ROOTS]
    point = max(places, key=lambda place: min(beside_furniture(arm, place, hand), ROOM_AROUND[1]))
    if beside_furniture(arm, point, hand) < ROOM_AROUND[0]:
        raise SkillFailed(f"there is no room for the hand over {tool.entity}")
    yield from arm.open_to(1.0)
    for height in (HANDLE_FROM_ABOVE, HANDLE_FROM_ABOVE / 2.0):
        over = raised(point, height)
        yield from arm.move(over, hand, tolerance=0.02, turn_tolerance=0.08, steps=140)
    yield from come_in(arm, Grasp(point, hand, 1.0), ((0.03, 0.006, 0.6), (0.0, 0.003, 0.3)), 0.05)
    yield from arm.move(
        raised(point, -0.06),
        hand,
        speed=0.06,
        steps=40,
        until=lambda: palm_presses(arm, tool) or arm.position[2] < tool.bottom + TIPS_OFF_COUNTER,
        required=False,
    )
    yield from lift(arm, tool, hand, 0.08)


def stir(arm: Arm, pot_role: str, role: str) -> Motion:
    """Draw a held spatula towards the robot through what is in a pot.

    Raises:
        SkillFailed: if the blade has no room behind that, or if hand or base does not get there.
    """
    pot, tool = Thing(arm, pot_role), Thing(arm, role)
    yield from turn_down(arm)
    hand = arm.hand(STIR_PITCH)
    food, ahead = inside(arm, pot, tool), np.append(arm.forward, 0.0)
    top = BLADE_OVER + max([pot.highest, *(thing.highest for thing in food)])
    over = np.append(arm.position[:2], _hand_at(arm, tool, np.append(pot.middle[:2], top))[2])
    yield from arm.move(over, hand, tolerance=0.02, speed=0.5)
    far = min(FAR_END, room_behind(arm, pot, tool))
    for thing in food:
        if arm.ahead(thing.centre - pot.middle) + thing.reach(ahead) + BLADE_ROOM > far:
            raise SkillFailed(f"there is no room for the blade behind {thing.entity}")
    stand = STIR_REACH - far - arm.ahead(arm.position - end(tool))
    yield from stand_before(arm, pot.middle, stand, speed=CAREFUL)
    for _ in range(STROKES):
        yield from stroke(arm, pot, tool, far, top)


def stroke(arm: Arm, pot: Thing, tool: Thing, far: float, top: float) -> Motion:
    """Lower a blade into a pot, draw it towards the robot, and raise it again.

    Args:
        arm: the arm.
        pot: the pot.
        tool: what has the blade.
        far: where the stroke begins, from the middle of the pot, m.
        top: height at which the blade passes over the pot, m.
    """
    hand = arm.hand(STIR_PITCH)
    for height, speed in ((top, 0.4), (pot.bottom + BLADE_DEEP, 0.2)):
        begin = np.append((pot.middle[:2] + far * arm.forward), height)
        yield from arm.move(
            partial(_hand_at, arm, tool, begin), hand, tolerance=0.01, speed=speed, steps=160
        )
    most = turned(arm, tool) + MOST_TURN
    way = arm.onward(NEAR_END - far)
    for share in np.linspace(0.0, 1.0, math.ceil((far - NEAR_END) / STROKE_STEP)).tolist():
        if turned(arm, tool) > most:
            break
        here = _hand_at(arm, tool, begin + share * way)
        yield from arm.move(here, hand, tolerance=0.0, steps=1, required=False)
    up = _hand_at(arm, tool, np.append(end(tool)[:2], top))
    yield from arm.move(up, hand, tolerance=0.015, speed=0.3, required=False)


def turned(arm: Arm, tool: Thing) -> float:
    """Degrees from across the hand, in its middle plane, to a held tool."""
    return math.degrees(math.asin(min(1.0, abs(float(long_axis(tool) @ arm.rotation[:, 2])))))


def room_behind(arm: Arm, pot: Thing, tool: Thing) -> float:
    """How far beyond the middle of a pot the end of a blade may be, m, for the other end of a tool
    that leans over it to be free of the wall.
    """
    leans = max(arm.ahead(corner) for corner in tool.corners) - arm.ahead(end(tool))
    walls = []
    for surface in arm.scene.surfaces:
        points = np.asarray(corners(np.asarray(surface.pose, np.float64), surface.half), np.float64)
        along, aside = points[:, :2] @ arm.forward, points[:, :2] @ arm.left
        behind = along.min() > arm.ahead(pot.middle)
        abreast = aside.min() < arm.aside(pot.middle) < aside.max()
        if behind and abreast and points[:, 2].min() < tool.highest < points[:, 2].max():
            walls.append(float(along.min()))
    return min(walls, default=math.inf) - arm.ahead(pot.middle) - leans - OFF_WALL


def turn_down(arm: Arm) -> Motion:
    """Draw a held spatula back, raise it, and turn its blade to the robot and down."""
    yield from draw_in(arm)
    high = raised(arm.position, max(0.0, TURN_HEIGHT - float(arm.position[2])))
    yield from arm.move(high, tolerance=0.03, speed=0.5, steps=60)
    for pitch in (0.0, STIR_PITCH / 2, STIR_PITCH):
        hand = arm.hand(pitch)
        yield from arm.move(arm.position, hand, tolerance=0.04, turn_tolerance=0.1, speed=0.5)


def inside(arm: Arm, pot: Thing, tool: Thing) -> list[Thing]:
    """What is in a pot, but for a tool."""
    radius = pot.sides()[0][1] / 2.0
    return [
        thing
        for thing in other_things(arm, pot)
        if thing.entity != tool.entity and np.linalg.norm((thing.centre - pot.middle)[:2]) < radius
    ]


def _hand_at(arm: Arm, tool: Thing, goal: Array) -> Array:
    """Where the hand is when the end of a held tool is at a point (3,)."""
    return np.asarray(arm.position + goal - end(tool), np.float64)


def end(tool: Thing) -> Array:
    """The middle of the end of a tool's blade (3,)."""
    way = long_axis(tool)
    return np.asarray(tool.centre + tool.reach(way) * way, np.float64)


def long_axis(tool: Thing) -> Array:
    """Along a tool, towards its blade, where its weight is, however it is held (3,)."""
    axes = matrix(tool.pose[3:])
    axis = axes[:, int(np.argmax([tool.reach(axes[:, k]) for k in range(3)]))]
    return np.asarray(axis * math.copysign(1.0, (tool.com - tool.centre) @ axis), np.float64)
