"""Cutting boards: the tool that suits a food is laid on the board beside the food."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.driving import (
    CARRY_HEIGHT,
    CARRY_PITCH,
    CARRY_REACH,
    draw_in,
    travel,
    tuck,
    turn_round,
)
from pytest_safemanip.expert.motions.grasping import across, grasp_and_lift
from pytest_safemanip.expert.motions.putting import (
    BRAKE,
    bring_onto,
    carry_over,
    held_over,
    leave,
    lower_tipped,
    tip_over,
)
from pytest_safemanip.expert.places.drawer import grasp_thing_in_drawer
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed
from pytest_safemanip.expert.robot.hand import reach_at
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.standing import elbow_room, stand_before
from pytest_safemanip.expert.world.things import Furniture, Thing

TOOL_OFF_MIDDLE, FOOD_OFF_MIDDLE = 0.075, 0.065
"""From a board's middle to the tool before it, and to the food behind it, m: boards are 21 cm wide,
and open fingers reach 4 cm beyond the middle of what they let go."""
OFF_TOOL = 0.42
"""How far the base then draws back, m: the hand passes over the tool."""
ALONG_COUNTER_BACK = 0.20
"""How far it draws back before it drives along a counter, m: the hand is off what stands there."""
TURNING_REACH = 0.48
"""Base to hand then, m."""


def carry_tool_to(arm: Arm, role: str, target_role: str) -> Motion:
    """Bring a held tool, which lies across the hand, before another thing that stands elsewhere,
    on what is behind the robot too.

    Raises:
        SkillFailed: if the base finds no way there.
    """
    yield from draw_in(arm)
    height = arm.position[2] + CARRY_HEIGHT - Thing(arm, role).bottom
    yield from tuck(arm, CARRY_REACH, height, arm.hand(CARRY_PITCH, 90.0))
    if arm.ahead(Thing(arm, target_role).middle) < arm.ahead(arm.base):
        yield from turn_round(arm)
    yield from travel(arm, role, target_role)


def lay_on_near_half(arm: Arm, role: str, board_role: str) -> Motion:
    """Lay a held tool along a board, on its near half."""
    board = Thing(arm, board_role)
    beyond = across_board(arm, board)
    yaw = arm.bearing(beyond)
    spot = board.middle - TOOL_OFF_MIDDLE * beyond
    yield from lay_down(arm, role, board, spot, board.highest, yaw, elbow_room(arm, spot))


def grasp_beside_appliance(arm: Arm, role: str) -> Motion:
    """Take a food from above and draw it back, off a tall machine that stands beside it.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    thing = Thing(arm, role)
    yield from arm.drive(arm.base - ALONG_COUNTER_BACK * arm.forward)
    # Hand and wrist turn, and the elbow swings, before they are beside what stands there.
    grasp = across(arm, thing, 0.0)
    yield from tuck(arm, TURNING_REACH, float(arm.position[2]), grasp.hand)
    where = thing.centre
    yield from stand_before(arm, where, reach_at(0.0), elbow_room(arm, where))
    yield from grasp_and_lift(arm, thing, grasp)
    yield from draw_in(arm)


def place_on_far_half(arm: Arm, role: str, board_role: str) -> Motion:
    """Put a held food on a board's far half."""
    board = Thing(arm, board_role)
    spot = board.middle + FOOD_OFF_MIDDLE * across_board(arm, board)
    yield from bring_onto(arm, role, board, spot, elbow_room(arm, spot))
    yield from leave(arm, OFF_TOOL)


def across_board(arm: Arm, board: Thing) -> Array:
    """The direction across a board (3,) that leads away from the robot."""
    axis, _ = max(board.sides(), key=lambda side: abs(arm.ahead(side[0])))
    level = axis * (1.0, 1.0, 0.0)
    return np.asarray(level * math.copysign(1.0, arm.ahead(level)), np.float64)


PEELED = frozenset({"carrot", "cucumber", "eggplant", "potato"})
"""What has a skin that is peeled off, as RoboCasa's task has it; the rest is cut with a knife."""
PALM_WIDE = 0.10
"""From the middle of the palm to its end, in the direction in which the fingers open, m."""
BEHIND_FRONT = 0.060
"""From the front of a drawer's inside to a tool behind it, m: nearer, the palm meets the front."""
SLIP = 0.03
"""How far behind a tool the hand comes down, m: the palm's end passes the drawer's front."""
TOOL_PITCH = 25.0
"""Degrees from straight down: the arm reaches a board behind an open drawer, and the near end of
the palm, 10 cm from its middle, stays above the counter while the hand holds what is 2 cm thick."""
HANDLE = 0.02
"""Thickness of a knife or a peeler where it is pinched, m: its blade may be as wide as 5 cm."""
BLADE = 0.03
"""Likewise where nothing lies beside it, m: the fingers come down off its blade, too."""
LET_GO = 0.03
"""How much farther the fingers are opened at least to let go of a tool, share of their opening: the
far one does not come to the food."""
BEFORE_FOOD = 0.075
"""From a tool's middle to the food behind it, m: a palm that is tipped over the tool, and the
finger beyond it."""
ON_BOARD = 0.090
"""How far before the middle of a board a tool still lies on it, m: boards are 21 cm wide."""


def grasp_tool_for(
    arm: Arm, peeler_role: str, knife_role: str, food_role: str, drawer_role: str
) -> Motion:
    """Pick the tool for a food out of an open drawer.

    Raises:
        SkillFailed: if the hand would meet the drawer's front, or if the tool was not lifted.
    """
    role = tool_for(arm, peeler_role, knife_role, food_role)
    yield from grasp_tool(arm, role, drawer_role, HANDLE)


def grasp_tool(arm: Arm, role: str, drawer_role: str, thick: float = BLADE) -> Motion:
    """Pick a tool out of an open drawer.

    Args:
        arm: the arm.
        role: the tool.
        drawer_role: where it lies.
        thick: how thick it is where it is pinched, m.

    Raises:
        SkillFailed: if the hand would meet the drawer's front, or if the tool was not lifted.
    """
    tool, drawer = Thing(arm, role), Furniture(arm, drawer_role)
    where, front = arm.ahead(tool.com), drawer.opening()[0]
    if where < front + BEHIND_FRONT:
        raise SkillFailed(f"{role} lies too near to the drawer's front for the hand")
    slip = SLIP if where < front + PALM_WIDE else 0.0
    yield from grasp_thing_in_drawer(arm, tool, drawer, slip, thick)


def lay_tool_for(
    arm: Arm, peeler_role: str, knife_role: str, food_role: str, board_role: str
) -> Motion:
    """Lay the held tool on a board, this side of the food: the hand is tipped over, and the base
    can stay before the open drawer.
    """
    board, food = Thing(arm, board_role), Thing(arm, food_role)
    spot = spot_before(arm, board.middle, food)
    role = tool_for(arm, peeler_role, knife_role, food_role)
    yield from lay_down(arm, role, board, spot, food.highest)


def lay_down(
    arm: Arm, role: str, board: Thing, spot: Array, top: float, yaw: float = 0.0, shift: float = 0.0
) -> Motion:
    """Lay a held tool down, the hand tipped over.

    Args:
        arm: the arm.
        role: the tool.
        board: what it goes onto.
        spot: where (3,).
        top: height of what is highest there, m.
        yaw: degrees about the vertical from lying across, left to right.
        shift: how much farther to the left the base is to stand, m.
    """
    yield from tip_over(arm, TOOL_PITCH, yaw)
    yield from carry_over(arm, role, spot, top, shift)
    close = held_over(arm, Thing(arm, role), spot, board.highest + BRAKE)
    yield from arm.move(
        close, arm.rotation, tolerance=0.006, speed=0.2, steps=60, required=False, exact=True
    )
    yield from lower_tipped(arm, role)
    yield from arm.let_go(LET_GO)
    yield from leave(arm)


def tool_for(arm: Arm, peeler_role: str, knife_role: str, food_role: str) -> str:
    """The role of the tool that a food asks for."""
    category = arm.scene.entity[Thing(arm, food_role).entity].category
    return peeler_role if category in PEELED else knife_role


def spot_before(arm: Arm, middle: Array, food: Thing) -> Array:
    """Where on a board, on the robot's side of a food, a tool goes (3,).

    Args:
        arm: the arm.
        middle: of the board (3,).
        food: what lies on it.
    """
    ahead = arm.ahead(middle)
    free = food.extent_ahead()[0] - BEFORE_FOOD
    return arm.point(float(np.clip(free, ahead - ON_BOARD, ahead)), arm.aside(middle), middle[2])
