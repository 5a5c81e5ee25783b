"""Driving to a fixture, and carrying something to another counter around the furniture."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.hand import reach_at
from pytest_safemanip.expert.robot.rotations import Array, about_y, about_z
from pytest_safemanip.expert.world.routes import route
from pytest_safemanip.expert.world.standing import nearest, stand
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.trace.geometry import corners

STAND_FRONT = 0.20
"""Base to what it stands in front of, m: as far as RoboCasa puts robots from a counter. Its wheels
reach 15 cm before its origin. RoboCasa wants it within 20 cm of its own place, which does not
allow for the handles of the drawers below a counter: they stick out by 11 cm."""
HAND_HEIGHT = 0.10
"""What is this far above or below the grip point, m, is in the hand's way."""
HAND_CLEARANCE = 0.12
"""From the grip point to what it stops in front of, m: half the palm, and room to stop."""
DRIVE_BACK = 0.15
"""How far the base draws back before it drives along the counters, m: over what stands there."""
FRONT_DEPTH = 0.75
"""What lies this far before a fixture, m, stands before it and not beneath."""


def drive_to(arm: Arm, role: str) -> Motion:
    """Stand in front of a fixture, facing as now: back first, then along, then up to it."""
    low, high = Furniture(arm, role).extent()
    middle = (low + high) / 2.0
    reach = arm.ahead(arm.position) - arm.ahead(arm.base)
    stand = _front(arm, middle) - STAND_FRONT
    tall = _front(arm, np.append(middle[:2], arm.position[2]), HAND_HEIGHT)
    stand = min(stand, tall - reach - HAND_CLEARANCE)
    back = min(arm.ahead(arm.base), stand) - DRIVE_BACK
    yield from arm.drive(arm.floor_point(back, arm.aside(arm.base)))
    yield from arm.drive(arm.floor_point(back, arm.aside(middle)), steps=300)
    yield from arm.drive(arm.floor_point(stand, arm.aside(middle)))


def _front(arm: Arm, point: Array, height: float = math.inf) -> float:
    """Where the furniture above, at and below a point begins, along the forward direction.

    Args:
        arm: gives the scene and the direction.
        point: a point of the world (3,).
        height: how far above and below it counts, m.
    """
    fronts = [math.inf]
    for surface in arm.scene.surfaces:
        if arm.scene.entity[surface.entity].kind != "fixture":
            continue
        points = corners(np.array(surface.pose), surface.half)
        low, high = points[:, 2].min() - height, points[:, 2].max() + height
        aside = [arm.aside(corner) for corner in points]
        front = min(arm.ahead(corner) for corner in points)
        beside = min(aside) <= arm.aside(point) <= max(aside) and low <= point[2] <= high
        if beside and abs(arm.ahead(point) - front) < FRONT_DEPTH:
            fronts.append(front)
    return min(fronts)


DRAW_BACK = 0.40
"""How far the base draws back before a load is tucked in, m: off what stands on the counter."""
CARRY_REACH = 0.42
"""Base to hand on the way, m: as close as the wrist allows."""
CARRY_HEIGHT = 1.08
"""Height of a load's lowest point on the way, m: 16 cm above counters, over what stands on them."""
DRAW_IN = 0.12
"""How far a stretched arm is first drawn in, m."""
CARRY_PITCH = 20.0
"""Degrees from straight down that the hand is pitched on the way: straight down, the wrist reaches
its limit so close to the base."""
BALANCE_PITCH, BALANCE_HEIGHT, BALANCE_TUCKED = 70.0, 1.30, 0.46
"""Likewise, and height of the hand and base to hand, m, where one finger is below what is held."""
STOP_SHORT = 0.35
"""How far before its last place the way ends, m: room to raise and to tip a load."""
CARRY_SPEED = 0.6
"""Share of the base's top speed at which a load hardly swings where it starts and stops."""
LONG_WAY = 400
"""Control steps for a stretch across the room."""
TIP_STEP = 4.0
"""Degrees by which the hand is tipped at a time with something heavy, which swings otherwise."""


def carry_to(arm: Arm, role: str, target_role: str, gently: bool = False) -> Motion:
    """Bring a held object before another one that stands elsewhere, on an island say.

    The robot keeps facing as it does, its base moves sideways too: both a counter on the wall and
    the stools' side of an island, where things to dine with stand, are used facing the wall.

    Args:
        arm: the arm.
        role: the held object.
        target_role: the other one.
        gently: whether the hand is tipped bit by bit.

    Raises:
        SkillFailed: if the base finds no way there.
    """
    yield from draw_in(arm)
    for pitch in np.arange(arm.pitch, CARRY_PITCH, -TIP_STEP).tolist() if gently else ():
        tipped = pitched(arm, pitch)
        yield from arm.move(arm.position, tipped, tolerance=0.03, turn_tolerance=0.03, steps=20)
    height = arm.position[2] + CARRY_HEIGHT - Thing(arm, role).bottom
    yield from tuck(arm, CARRY_REACH, height, pitched(arm, CARRY_PITCH))
    yield from travel(arm, role, target_role)


def carry_balanced(arm: Arm, role: str, target_role: str) -> Motion:
    """Bring something small before another thing that stands elsewhere, with one finger below it:
    between two fingers that are level a ball sinks by half a millimetre in a second, and in half a
    minute is past their tips.

    The hand rolls while it points down: on a level one, which is in line with the forearm, one
    joint or another does it, and may come to its end.

    Raises:
        SkillFailed: if the base finds no way there.
    """
    yield from draw_in(arm)
    upright, rolled = arm.hand(CARRY_PITCH), arm.hand(CARRY_PITCH, 90.0)
    for hand in (upright, rolled):
        yield from tuck(arm, CARRY_REACH, BALANCE_HEIGHT, hand)
    yield from tuck(arm, BALANCE_TUCKED, BALANCE_HEIGHT, arm.hand(BALANCE_PITCH, 90.0))
    yield from travel(arm, role, target_role)
    for hand in (rolled, upright):
        yield from tuck(arm, CARRY_REACH, BALANCE_HEIGHT, hand)


def draw_in(arm: Arm) -> Motion:
    """Draw the base back, and a stretched arm in."""
    yield from arm.drive(arm.base - DRAW_BACK * arm.forward, speed=CARRY_SPEED)
    # Upwards a little: a straight arm bends at once where it is not pulled along its own line.
    bent = arm.position + np.append(-DRAW_IN * arm.forward, 0.02)
    yield from arm.move(bent, tolerance=0.03, speed=0.5, steps=40, required=False)


def tuck(arm: Arm, ahead: float, height: float, hand: Array) -> Motion:
    """Hold the hand before the base.

    Args:
        arm: the arm.
        ahead: how far before it, m.
        height: above the floor, m.
        hand: orientation (3, 3).

    Raises:
        SkillFailed: if the hand does not get there.
    """
    tucked = arm.before(ahead, height)
    yield from arm.move(tucked, hand, tolerance=0.03, turn_tolerance=0.15, speed=0.6, steps=120)


def travel(arm: Arm, role: str, target_role: str) -> Motion:
    """Drive to where a tucked hand is before an object, around what stands on the floor."""
    thing, target = Thing(arm, role), Thing(arm, target_role)
    aside = arm.aside(target.middle)
    ahead = arm.ahead(target.middle) - reach_at(CARRY_PITCH)
    goal = arm.floor_point(ahead - STOP_SHORT, aside)
    for place in route(arm, thing, goal):
        yield from arm.drive(place, speed=CARRY_SPEED, steps=LONG_WAY)


def pitched(arm: Arm, pitch: float) -> Array:
    """The hand as it is, but pitched so far from straight down (3, 3)."""
    heading = about_z(math.degrees(math.atan2(arm.forward[1], arm.forward[0])))
    turned: Array = heading @ about_y(arm.pitch - pitch) @ heading.T @ arm.rotation
    return turned


TURN_WIDE, TURN_ROOM = 0.45, 0.14
"""What is so far to either side is in the way of a base that turns, and how far it is drawn back
from that, m: it turns about its middle, and its corners reach 8 cm farther than its front."""


def turn_round(arm: Arm, room: float = TURN_ROOM) -> Motion:
    """Turn the base until it faces the other way, its wheels off the furniture.

    Args:
        arm: the arm.
        room: how far the base is drawn back from what stands before it, m.

    Raises:
        SkillFailed: if it does not arrive.
    """
    aside = arm.aside(arm.base)
    free = nearest(arm, aside - TURN_WIDE, aside + TURN_WIDE) - room
    yield from stand(arm, min(arm.ahead(arm.base), free), aside, CARRY_SPEED)
    yield from arm.turn(180.0)
