"""Tools for cutting: the one that suits a food, out of a drawer and onto the food's board."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed
from pytest_safemanip.policies.scripted.drawers import pinch_in_drawer
from pytest_safemanip.policies.scripted.laying import lower_tipped, tip_over
from pytest_safemanip.policies.scripted.putting import BRAKE, carry_over, held_over, leave
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.things import Furniture, Thing

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
"""How much farther the fingers are opened to let go of a tool, share of their opening: they drift
on by four times as much, half a centimetre each, and the far one does not come to the food."""
BEFORE_FOOD = 0.075
"""From a tool's middle to the food behind it, m: a palm that is tipped over the tool, and the
finger beyond it."""
ON_BOARD = 0.090
"""How far before the middle of a board a tool still lies on it, m: boards are 21 cm wide."""


def take_tool(
    arm: Arm, peeler_role: str, knife_role: str, food_role: str, drawer_role: str
) -> Motion:
    """Pick the tool for a food out of an open drawer.

    Raises:
        SkillFailed: if the hand would meet the drawer's front, or if the tool was not lifted.
    """
    role = tool_for(arm, peeler_role, knife_role, food_role)
    yield from take_from_drawer(arm, role, drawer_role, HANDLE)


def take_from_drawer(arm: Arm, role: str, drawer_role: str, thick: float = BLADE) -> Motion:
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
    yield from pinch_in_drawer(arm, tool, drawer, slip, thick)


def lay_tool(
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
    arm: Arm,
    role: str,
    board: Thing,
    spot: Array,
    top: float,
    yaw: float = 0.0,
    shift: float = 0.0,
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
    yield from arm.open_to(float(arm.step.gripper[0]) + LET_GO)
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
