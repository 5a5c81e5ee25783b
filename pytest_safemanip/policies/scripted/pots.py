"""Putting two things into a pot on a stove, beside each other."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed
from pytest_safemanip.policies.scripted.grasping import GAP, across, hand_corners, reach, take
from pytest_safemanip.policies.scripted.hand_room import beside_furniture, beside_things
from pytest_safemanip.policies.scripted.putting import carry_over, held_over, leave
from pytest_safemanip.policies.scripted.standing import duck, stand_before
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.policies.scripted.travelling import draw_in

PICK_PITCH = 15.0
"""Degrees from straight down: the fingertips still reach below the middle of a mushroom."""
SET_PITCH = 40.0
"""Likewise over a pot: wrist and forearm pass below a microwave over the stove's rear."""
TURNS = (0.0, 90.0, 45.0, 135.0)
"""Of the fingers about what they pinch, degrees; what is not round has but the first two."""
ROUND = 1.02
"""Length by width below which a thing is round."""
BESIDE = 0.029
"""From the middle of a pot to that of either of two things beside each other in it, m."""
BEFORE = 0.012
"""How far before its middle they lie, m: behind them there is room for the blade."""
OFF_RIM, OFF_FLOOR = 0.006, 0.012
"""Free space between palm and rim, and below what is let go, m."""
EASE = 0.1
"""How much farther the fingers are opened to let go, share of their opening: what lies beside them
is not pushed."""


def put_both(arm: Arm, role: str, other_role: str, pot_role: str) -> Motion:
    """Put two things from the counter into a pot, beside each other, the lower one first: the
    fingers that let go of the other one are beside it.

    Raises:
        SkillFailed: if hand or base does not get there, or one was not lifted.
    """
    sides = {role: -BESIDE, other_role: BESIDE}
    for name in sorted(sides, key=lambda name: Thing(arm, name).height):
        yield from pick_beside(arm, name)
        yield from set_into(arm, name, pot_role, sides[name])


def pick_beside(arm: Arm, role: str) -> Motion:
    """Pinch a thing on the counter, the fingers turned away from what stands beside it.

    Raises:
        SkillFailed: if there is no room for the fingers, or if it was not lifted.
    """
    thing = Thing(arm, role)
    yield from duck(arm, arm.aside(thing.centre))
    yield from stand_before(arm, thing.centre, reach(PICK_PITCH))
    (_, width), (_, length) = thing.sides()
    turns = TURNS if length < ROUND * width else TURNS[:2]
    grasps = [
        across(arm, thing, PICK_PITCH, turn=turn) for turn in turns if turn == 0.0 or length < GAP
    ]
    free = [
        min(beside_things(arm, thing, grasp), beside_furniture(arm, grasp.point, grasp.hand))
        for grasp in grasps
    ]
    best = max(range(len(grasps)), key=lambda number: min(free[number], 0.0))
    if beside_things(arm, thing, grasps[best]) < 0.0:
        raise SkillFailed(f"there is no room for the fingers beside {thing.entity}")
    yield from take(arm, thing, grasps[best])


def set_into(arm: Arm, role: str, pot_role: str, aside: float) -> Motion:
    """Let a held thing into a pot, the palm just above its rim.

    Args:
        arm: the arm.
        role: the held thing.
        pot_role: the pot.
        aside: how far to the left of its middle the thing goes, m.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    thing, pot = Thing(arm, role), Thing(arm, pot_role)
    yield from draw_in(arm)
    hand = arm.hand(SET_PITCH)
    yield from arm.move(arm.position, hand, tolerance=0.03, turn_tolerance=0.08, speed=0.5)
    spot = pot.middle + np.append(arm.floor_point(-BEFORE, aside), 0.0)
    yield from carry_over(arm, role, spot, pot.highest)
    palm = float(hand_corners(arm.rotation)[:, 2].min())
    down = float(arm.position[2]) + palm - pot.highest - OFF_RIM
    low = thing.bottom - max(0.0, min(down, thing.bottom - pot.bottom - OFF_FLOOR))
    yield from arm.move(
        held_over(arm, thing, spot, low),
        hand,
        speed=0.1,
        steps=120,
        until=lambda: thing.bottom < low + 0.002,
        required=False,
    )
    yield from arm.open_to(float(arm.step.gripper[0]) + EASE)
    yield from leave(arm)
