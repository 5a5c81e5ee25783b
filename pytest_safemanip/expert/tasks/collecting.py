"""Bringing what stands in one cabinet to its like in another one."""

from __future__ import annotations

from pytest_safemanip.expert.motions.driving import carry_to
from pytest_safemanip.expert.places.cabinet.grasping import grasp_turned_first, in_reach
from pytest_safemanip.expert.places.cabinet.placing import place_on_shelf_near
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.world.things import Thing

ABREAST = 0.12
"""Two things whose places differ by less along a shelf stand one behind the other, m."""


def move_beside(
    arm: Arm, role: str, other_role: str, cabinet_role: str, to_role: str, into_role: str
) -> Motion:
    """Take two cups out of one cabinet and put them near a third one in another, the farther first:
    the other may then be near enough where it is. One that the hand gets at only when the other one
    is gone comes second.

    Args:
        arm: the arm.
        role: one cup.
        other_role: the other one.
        cabinet_role: where they are.
        to_role: the third one.
        into_role: where that is.

    Raises:
        SkillFailed: if one was not lifted, or there is no room.
    """
    cups = in_order(arm, role, other_role, Thing(arm, to_role))
    for cup in cups if in_reach(arm, cups[0], cabinet_role) else cups[::-1]:
        yield from grasp_turned_first(arm, cup, cabinet_role)
        yield from carry_to(arm, cup, to_role, gently=True)
        yield from place_on_shelf_near(arm, cup, into_role, to_role)


def in_order(arm: Arm, role: str, other_role: str, third: Thing) -> tuple[str, str]:
    """The one that is farther from a third one first; of two behind each other the nearer."""
    one, other = Thing(arm, role), Thing(arm, other_role)
    off = [abs(arm.aside(t.middle) - arm.aside(third.middle)) for t in (one, other)]
    later = off[0] < off[1]
    if abs(off[0] - off[1]) < ABREAST:
        later = arm.ahead(one.middle) > arm.ahead(other.middle)
    return (other_role, role) if later else (role, other_role)
