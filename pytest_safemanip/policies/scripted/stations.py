"""Setting up a board for cutting that stands elsewhere, behind the robot too: a tool on its near
half, a food on its far half.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion
from pytest_safemanip.policies.scripted.grasping import across, reach, take
from pytest_safemanip.policies.scripted.leaning import elbow_room
from pytest_safemanip.policies.scripted.putting import bring_onto, leave
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.standing import nearest, stand, stand_before
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.policies.scripted.tools import lay_down
from pytest_safemanip.policies.scripted.travelling import (
    ABOVE,
    PITCH,
    SPEED,
    TUCKED,
    draw_in,
    travel,
    tuck,
)

NEAR, FAR = 0.075, 0.065
"""From a board's middle to the tool before it, and to the food behind it, m: boards are 21 cm wide,
and open fingers reach 4 cm beyond the middle of what they let go."""
OFF_TOOL = 0.42
"""How far the base then draws back, m: the hand passes over the tool."""
BACK = 0.20
"""How far it draws back before it drives along a counter, m: the hand is off what stands there."""
BEFORE = 0.48
"""Base to hand then, m."""
TURN_WIDE, TURN_ROOM = 0.45, 0.14
"""What is so far to either side is in the way of a base that turns, and how far it is drawn back
from that, m: it turns about its middle, and its corners reach 8 cm farther than its front."""


def bring_to(arm: Arm, role: str, target_role: str) -> Motion:
    """Bring a held tool, which lies across the hand, before another thing that stands elsewhere,
    on what is behind the robot too.

    Raises:
        SkillFailed: if the base finds no way there.
    """
    yield from draw_in(arm)
    height = arm.position[2] + ABOVE - Thing(arm, role).bottom
    yield from tuck(arm, TUCKED, height, arm.hand(PITCH, 90.0))
    if arm.ahead(Thing(arm, target_role).middle) < arm.ahead(arm.base):
        yield from turn_round(arm)
    yield from travel(arm, role, target_role)


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
    yield from stand(arm, min(arm.ahead(arm.base), free), aside, SPEED)
    yield from arm.turn(180.0)


def lay_before(arm: Arm, role: str, board_role: str) -> Motion:
    """Lay a held tool along a board, on its near half."""
    board = Thing(arm, board_role)
    beyond = across_board(arm, board)
    yaw = arm.bearing(beyond)
    spot = board.middle - NEAR * beyond
    yield from lay_down(arm, role, board, spot, board.highest, yaw, elbow_room(arm, spot))


def gather(arm: Arm, role: str) -> Motion:
    """Take a food from above and draw it back, off a tall machine that stands beside it.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    thing = Thing(arm, role)
    yield from arm.drive(arm.base - BACK * arm.forward)
    # Hand and wrist turn, and the elbow swings, before they are beside what stands there.
    grasp = across(arm, thing, 0.0)
    yield from tuck(arm, BEFORE, float(arm.position[2]), grasp.hand)
    where = thing.centre
    yield from stand_before(arm, where, reach(0.0), elbow_room(arm, where))
    yield from take(arm, thing, grasp)
    yield from draw_in(arm)


def place_behind(arm: Arm, role: str, board_role: str) -> Motion:
    """Put a held food on a board's far half."""
    board = Thing(arm, board_role)
    spot = board.middle + FAR * across_board(arm, board)
    yield from bring_onto(arm, role, board, spot, elbow_room(arm, spot))
    yield from leave(arm, OFF_TOOL)


def across_board(arm: Arm, board: Thing) -> Array:
    """The direction across a board (3,) that leads away from the robot."""
    axis, _ = max(board.sides(), key=lambda side: abs(arm.ahead(side[0])))
    level = axis * (1.0, 1.0, 0.0)
    return np.asarray(level * math.copysign(1.0, arm.ahead(level)), np.float64)
