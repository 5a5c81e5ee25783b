"""A small oven on a counter: its rack is drawn out, loaded from above, pushed in; its timer is set.

A hand with something long in it has no room inside: the rack comes out to it.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.putting import held_over, set_down
from pytest_safemanip.expert.robot.arm import (
    GENTLY,
    Arm,
    Motion,
    fold_arm,
    raised,
    unless_lost,
)
from pytest_safemanip.expert.robot.hand import reach_at
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.standing import stand
from pytest_safemanip.expert.world.things import Furniture, Thing, other_things

LOADED_BACK = 0.35
"""How far the base draws back with a load before it turns it, m."""
LOADED_TUCKED = 0.50
"""Base to hand on the way, m."""
OVER_RACK = 0.03
"""Free space below a load on its way over a rack, m: bread that is 8 cm high comes in below the
roof."""
CLEAR_OF_RACK = 0.05
"""From a load to a rack in front of it, m, while it is moved sideways."""
ROOF = 0.055
"""From the front of an oven to the grip point of a hand that points straight down, m: the wrist
above it stays off the oven's roof."""
SHARE = 0.25
"""From the middle of a rack to where one of two things goes, share of its width."""
NEARER = 0.01
"""Of two free halves, that on the thing's side: m of room for each m that it is nearer."""
SLIPPED = 0.05
"""How far a load moves in the hand that is lost, m: a hand that followed it to where it lies would
press its palm on the oven's front with 277 N."""
SLOWLY = 0.06
"""Speed at which a long thing is set down, share of the top speed."""


def fold_up(arm: Arm, back: float = 0.15) -> Motion:
    """Raise the hand, draw back, and fold the arm as an episode begins: from there it comes to any
    posture.

    Args:
        arm: the arm.
        back: how far the base draws back, m.
    """
    yield from arm.move(raised(arm.position, 0.12), tolerance=0.03, speed=0.5, required=False)
    yield from arm.drive(arm.base - back * arm.forward)
    yield from fold_arm(arm)


def place_on_rack(arm: Arm, role: str, oven_role: str) -> Motion:
    """Put something long that is held from above on a rack that is out, pointing into the oven.

    Raises:
        SkillFailed: if the hand or the base does not get there, or the thing slipped on the way.
    """
    thing, oven = Thing(arm, role), Furniture(arm, oven_role)
    spot = free_half(arm, thing, oven)
    hand = arm.hand()
    yield from arm.drive(arm.base - LOADED_BACK * arm.forward, speed=GENTLY)

    def tucked() -> Array:
        rise = arm.position[2] + spot[2] + OVER_RACK - thing.bottom
        return arm.before(LOADED_TUCKED, rise)

    yield from arm.move(tucked, hand, tolerance=0.02, turn_tolerance=0.1, speed=0.5, steps=160)
    # What leant on something when it was gripped still slopes.
    axis = thing.sides()[1][0]
    slope = math.asin(math.copysign(1.0, arm.ahead(axis)) * axis[2])
    hand = arm.hand(-math.degrees(slope))
    yield from arm.move(tucked, hand, tolerance=0.02, turn_tolerance=0.05, speed=0.5, steps=40)
    away = arm.ahead(spot) - reach_at(0.0)
    # Past what lies on the rack already, and reaches to its edge.
    front = thing.extent_ahead()[1] - arm.ahead(arm.base)
    before = arm.ahead(rack_edge(arm, oven)) - CLEAR_OF_RACK - front
    yield from arm.drive(
        arm.floor_point(min(before, arm.ahead(arm.base)), arm.aside(arm.base)), speed=GENTLY
    )
    yield from stand(arm, arm.ahead(arm.base), arm.aside(spot), GENTLY)
    grip = thing.centre - arm.position

    def slipped() -> bool:
        return bool(np.linalg.norm(thing.centre - arm.position - grip) > SLIPPED)

    yield from unless_lost(stand(arm, away, arm.aside(spot), GENTLY), role, slipped)
    over = held_over(arm, thing, spot, float(spot[2]) + OVER_RACK / 3.0)
    yield from arm.move(over, hand, tolerance=0.008, speed=0.4, steps=80, required=False)
    yield from set_down(arm, role, speed=SLOWLY)
    yield from fold_up(arm, LOADED_BACK)


def free_half(arm: Arm, thing: Thing, oven: Furniture) -> Array:
    """The middle of the half of a rack on which more room is (3,), before the oven's roof."""
    pose, half = oven.interior()
    (door,) = oven.doors()
    ahead = min(arm.ahead(pose), arm.ahead(np.asarray(door.anchor)) - ROOF)
    there = [other.centre for other in other_things(arm, thing)]
    floor = float(pose[2] - half[2])
    spots = [
        arm.point(ahead, arm.aside(pose) + side * 2.0 * SHARE * half[0], floor)
        for side in (1.0, -1.0)
    ]

    def room(spot: Array) -> float:
        near = [float(np.linalg.norm((c - spot)[:2])) for c in there]
        gap = min((*near, float(half[0])))
        return gap - NEARER * abs(arm.aside(spot) - arm.aside(thing.centre))

    return max(spots, key=room)


def rack_edge(arm: Arm, oven: Furniture) -> Array:
    """Middle of the upper front edge of an oven's rack, where it is now (3,)."""
    pose, half = oven.interior()
    return arm.point(arm.ahead(pose) - half[1], arm.aside(pose), float(pose[2] - half[2]))
