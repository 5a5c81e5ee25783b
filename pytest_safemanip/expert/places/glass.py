"""Small things into a drinking glass: as deep as the fingers go in beside them."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.driving import draw_in, tuck
from pytest_safemanip.expert.motions.putting import BRAKE, USUAL, carry_before, leave
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, cut, raised
from pytest_safemanip.expert.robot.base import LAG, NOTCH
from pytest_safemanip.expert.robot.hand import OPENING, hand_corners
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.contacts import carried_by_something, pressed_by
from pytest_safemanip.expert.world.standing import elbow_room, solids
from pytest_safemanip.expert.world.things import Thing, other_things
from pytest_safemanip.trace.planar import footprints_overlap

FINGERTIP_THICK, FINGER_FLARE, FINGER_HALF_WIDE = 0.0145, 0.32, 0.0105
"""Thickness of a finger at its tip, m, by how much it grows with the distance from that, and half
its width, m."""
TIPS_BELOW, GLASS_PALM = 0.0095, 0.031
"""From the grip point down to the fingertips, and up to the palm, m."""
LOOSE = 0.025
"""Share of the full opening by which fingers open at least to let go of something: each is 1 mm
off it then."""
GLASS = 0.004
"""Thickness of a glass's wall, m."""
GLASS_ROOM = 0.002
"""Kept free beside each finger in a glass, and beside a load, m: so well is the hand centred."""
HAND_OFF_RIM = 0.003
"""Kept free between hand and rim, m."""
OVER_EDGE = 0.001
"""How far beside the edge of what lies in a glass the middle of the next thing is let go, m: it
lands there and tips off, and does not come to lie on that, off the glass."""
PRESSES = 3.0
"""Force that shows that the hand stands on the glass, N."""
TURN_REACH, TURN_HEIGHT = 0.50, 1.15
"""Base to hand, m, and height of the hand, m, where it is turned to point straight down."""
FALLEN = 0.3
"""How long the fingers wait for what falls between them, s."""
ROLLS = (0.0, 90.0)
"""Of a hand that points straight down, degrees: its palm to the sides, or to the front."""
PALM_BESIDE = 0.006
"""Kept free between the palm and what stands beside it, m."""
OVER_VESSEL = 0.075
"""From the middle of a vessel, m: what is so near lies in it, or is in the hand over it."""


def drop_into_glass(arm: Arm, role: str, glass_role: str) -> Motion:
    """Let something small into a glass from straight above, beside what lies in it.

    Raises:
        SkillFailed: if there is no room for the palm, or hand or base does not get there.
    """
    thing, glass = Thing(arm, role), Thing(arm, glass_role)
    rim = np.append(glass.middle[:2], glass.highest)
    hands = [arm.hand(0.0, roll) for roll in ROLLS]
    free = [hand for hand in hands if palm_is_free(arm, rim, hand, glass)]
    if not free:
        raise SkillFailed("there is no room for the palm over the glass")
    notches = math.ceil((float(arm.step.gripper[0]) + LOOSE + LAG) / NOTCH)
    opened = (notches * NOTCH - LAG) * OPENING / 2.0
    lying = _lies_in(arm, thing, glass)
    beside = _beside(lying, glass) if lying else np.zeros(3)
    hand = max(free, key=lambda hand: depth(glass, hand, opened, beside))
    yield from draw_in(arm)
    yield from tuck(arm, TURN_REACH, TURN_HEIGHT, hand)
    shift = elbow_room(arm, glass.middle)
    yield from carry_before(arm, role, glass.middle, glass.highest + BRAKE, shift=shift)

    # What comes to tip off an edge is itself to be there, not the hand.
    in_hand = (thing.centre - arm.position) * (1.0, 1.0, 0.0)
    off = beside - in_hand if lying else _off_wall(arm, thing, glass)
    deep = depth(glass, hand, opened, off)
    yield from _let_fall(arm, thing, glass, hand, rim + off, deep, notches)
    yield from leave(arm)


def _let_fall(
    arm: Arm, thing: Thing, glass: Thing, hand: Array, over: Array, deep: float, notches: int
) -> Motion:
    """Lower a load into a glass, let go of it, and come up again.

    Args:
        arm: the arm.
        thing: the load.
        glass: the glass.
        hand: orientation of the hand, which points straight down (3, 3).
        over: above where, at the height of the rim (3,).
        deep: how far below that the fingertips go, m.
        notches: to which the fingers open.
    """
    above = raised(over, max(TIPS_BELOW, float(arm.position[2]) - thing.bottom) + BRAKE)
    yield from arm.move(above, hand, tolerance=0.015, turn_tolerance=0.05, speed=0.6)
    yield from arm.move(above, hand, tolerance=0.001, speed=0.2, required=False, exact=True)
    low = raised(over, TIPS_BELOW - deep)
    yield from cut(
        arm.move(low, hand, tolerance=0.001, speed=USUAL, steps=120, required=False),
        lambda: carried_by_something(arm, thing) or _stands_on(arm, glass),
    )
    yield from arm.open_by(notches - arm.notch)
    yield from arm.wait(FALLEN)
    yield from arm.move(above, hand, tolerance=0.02, speed=0.3, steps=80)
    yield from arm.grip(False)


def palm_is_free(arm: Arm, point: Array, hand: Array, over: Thing) -> bool:
    """Whether neither furniture nor an object stands where the palm is over a vessel, if the hand
    (3, 3) has its grip point at a point (3,).
    """
    palm = hand_corners(hand) + point
    low, high = palm[:, 2].min(), palm[:, 2].max()
    middle = over.middle[:2]
    off = [t for t in other_things(arm) if math.dist(t.centre[:2], middle) > OVER_VESSEL]
    return not any(
        piece[:, 2].min() < high
        and piece[:, 2].max() > low
        and footprints_overlap(palm, piece, -PALM_BESIDE)
        for piece in (*solids(arm), *(thing.corners for thing in off))
    )


def depth(glass: Thing, hand: Array, opened: float, off: Array) -> float:
    """How deep the fingertips go into a glass, m; negative: they stay above the rim.

    Args:
        glass: the glass.
        hand: orientation of the hand, which points straight down (3, 3).
        opened: from the grip point to each finger, m.
        off: from the middle of the glass to the grip point, from above (3,).
    """
    side, normal = (abs(float(off @ hand[:, k])) for k in (0, 1))
    wide = _inside(glass) ** 2 - (normal + FINGER_HALF_WIDE) ** 2
    free = math.sqrt(max(0.0, wide)) - GLASS_ROOM - side - opened - FINGERTIP_THICK
    return (
        min(free / FINGER_FLARE, TIPS_BELOW + GLASS_PALM - HAND_OFF_RIM)
        if free > 0.0
        else -HAND_OFF_RIM
    )


def _beside(lying: Thing, glass: Thing) -> Array:
    """From the middle of a glass to beside what lies in it, where there is more room (3,)."""
    (narrow, width), _ = lying.sides()
    there = float((lying.centre - glass.middle) @ narrow)
    edges = [there + side * (width / 2.0 + OVER_EDGE) for side in (-1.0, 1.0)]
    return min(edges, key=abs) * narrow * (1.0, 1.0, 0.0)


def _off_wall(arm: Arm, thing: Thing, glass: Thing) -> Array:
    """From the middle of a glass to where a load that reaches to one side of the fingers stays off
    the wall (3,).
    """
    side, normal = arm.rotation[:, 0], arm.rotation[:, 1]
    load = thing.corners - arm.position
    across = load @ normal
    most = math.sqrt((_inside(glass) - GLASS_ROOM) ** 2 - float(np.abs(load @ side).max()) ** 2)
    back = min(0.0, most - float(across.max())) + max(0.0, -most - float(across.min()))
    return np.asarray(back * normal, np.float64)


def _lies_in(arm: Arm, thing: Thing, glass: Thing) -> Thing | None:
    """What lies in a glass already."""
    inside = [
        other
        for other in other_things(arm, thing, glass)
        if float(np.linalg.norm((other.centre - glass.middle)[:2])) < _inside(glass)
    ]
    return inside[0] if inside else None


def _inside(glass: Thing) -> float:
    return glass.sides()[0][1] / 2.0 - GLASS


def _stands_on(arm: Arm, glass: Thing) -> bool:
    return any(glass.entity in pressed_by(arm, part, PRESSES) for part in ("palm", "finger"))


def drop_either_into_glass(arm: Arm, role: str, other_role: str, glass_role: str) -> Motion:
    """Let the one of two alike things that is held into a glass, from straight above."""

    def off_hand(name: str) -> float:
        return float(np.linalg.norm(Thing(arm, name).centre - arm.position))

    yield from drop_into_glass(arm, min(role, other_role, key=off_hand), glass_role)
