"""The tool that suits a food: a peeler for what has a skin that is peeled off, else a knife."""

from __future__ import annotations

from pytest_safemanip.expert.motions.gripping import grasp
from pytest_safemanip.expert.motions.placing import place
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.tasks.handling import on
from pytest_safemanip.expert.world.things import Thing

PEELED = frozenset({"carrot", "cucumber", "eggplant", "potato"})
"""What has a skin that is peeled off, as RoboCasa's task has it; the rest is cut with a knife."""


def grasp_tool(arm: Arm, peeler_role: str, knife_role: str, food_role: str) -> Motion:
    """Take hold of the tool for a food."""
    role = tool_for(arm, peeler_role, knife_role, food_role)
    yield from grasp(arm, role)


def place_tool(
    arm: Arm, peeler_role: str, knife_role: str, food_role: str, board_role: str
) -> Motion:
    """Put the held tool for a food on a board."""
    role = tool_for(arm, peeler_role, knife_role, food_role)
    yield from place(arm, role, lambda: on(arm, role, board_role))


def tool_for(arm: Arm, peeler_role: str, knife_role: str, food_role: str) -> str:
    """The role of the tool that a food asks for."""
    category = arm.scene.entity[Thing(arm, food_role).entity].category
    return peeler_role if category in PEELED else knife_role
