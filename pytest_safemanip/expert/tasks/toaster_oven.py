"""A small oven on a counter: its rack is drawn out, loaded from above, pushed in; its timer is set.

A hand with something long in it has no room inside: the rack comes out to it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pytest_safemanip.expert.motions import operating
from pytest_safemanip.expert.motions.navigation import face
from pytest_safemanip.expert.robot.arm import GENTLY, Arm, Motion, SkillFailed, fold_arm, raised
from pytest_safemanip.expert.robot.hand import FINGERTIP
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.standing import nearest, stand_before
from pytest_safemanip.expert.world.things import Furniture, Part
from pytest_safemanip.expert.world.ways import Leg, foresee, go

PITCHES = (45.0, 60.0)
"""Degrees from straight down at which closed fingers come in below an oven's roof."""
STAND = 0.64
"""Base to hand, m, where it comes to a rack."""
PUSH_STAND = 0.58
"""Likewise where it pushes one in, which takes it farther in the end."""
BEHIND_EDGE = (0.025, 0.015, 0.005)
"""How far behind its edge the grip point is when fingertips come down on a rack, m: tips of tipped
fingers are farther in."""
PRESSED = 0.012
"""How far below its surface they aim then, m: what they press with drags it along."""
RACK_OUT, RACK_IN = 0.97, 0.01
"""Openness of a rack that is out, and of one that is in."""
NEARLY = 0.15
"""Openness from which the hand alone pushes a rack: the base would drive it against its stop."""
PUSH = 0.02
"""How far ahead of where it is the hand aims then, m: the rack yields to that."""
BEFORE_EDGE = 0.035
"""From the grip point to a rack's edge before it is pushed, m."""
PUSHED_AT = 0.010
"""Grip point above a rack's surface when it is pushed by its edge, m: the tips stay off the open
door below."""

SLOWLY = 0.06
"""Speed at which the hand alone pushes, share of the top speed."""
BACK = 0.15
"""How far the base draws back before the arm is folded, m."""


def open_rack(arm: Arm, role: str) -> Motion:
    """Drag an oven's rack out over its open door, with fingertips that press on its front.

    Raises:
        SkillFailed: if it does not come out.
    """
    if arm.choices.choose("as any other rack", (False, True)):
        yield from operating.open_rack(arm, role)
        return
    yield from face(arm, role)
    oven = Furniture(arm, role)
    joint = oven.only(Part.RACK)
    edge = rack_edge(arm, oven)
    ahead = np.append(arm.forward, 0.0)
    yield from arm.grip(True)
    yield from stand_before(arm, edge, STAND)
    ways = [
        [
            Leg(raised(spot - 0.14 * ahead, 0.06), arm.hand(pitch), 0.02),
            Leg(raised(spot, 0.02), arm.hand(pitch), 0.008, 0.5, 60),
            Leg(raised(spot, -PRESSED), arm.hand(pitch), 0.004, 0.1, 25, touches=True),
        ]
        for behind in BEHIND_EDGE
        for spot in [raised(edge + arm.onward(behind), FINGERTIP)]
        for pitch in PITCHES
    ]
    *coming, pressed = clear_way(arm, oven, ways)
    yield from go(arm, coming)
    yield from go(arm, [pressed], required=False)
    yield from arm.drive(
        arm.base - (joint.travel + 0.05) * arm.forward,
        until=lambda: oven.openness(joint) >= RACK_OUT,
        speed=GENTLY,
    )
    yield from fold_up(arm)
    if oven.openness(joint) < RACK_OUT - 0.05:
        raise SkillFailed(f"{joint.key} came out by {oven.openness(joint):.0%}")


def close_rack(arm: Arm, role: str) -> Motion:
    """Push an oven's rack in by its front edge.

    Raises:
        SkillFailed: if it does not go in.
    """
    if arm.choices.choose("as any other rack", (False, True)):
        yield from operating.close_rack(arm, role)
        return
    yield from face(arm, role)
    oven = Furniture(arm, role)
    joint = oven.only(Part.RACK)
    edge = rack_edge(arm, oven)
    ahead = np.append(arm.forward, 0.0)
    before = raised(edge - BEFORE_EDGE * ahead, PUSHED_AT)
    yield from arm.grip(True)
    yield from stand_before(arm, before, PUSH_STAND)
    ways = [
        [
            Leg(raised(before, 0.08), arm.hand(pitch), 0.02),
            Leg(before, arm.hand(pitch), 0.006, 0.4, 60),
        ]
        for pitch in PITCHES
    ]
    above, last = clear_way(arm, oven, ways)
    yield from go(arm, [above])
    yield from go(arm, [last], required=False)
    aside = arm.aside(arm.base)
    farthest = nearest(arm, aside, aside)
    yield from arm.drive(
        arm.floor_point(min(arm.ahead(arm.base) + joint.travel + 0.1, farthest), aside),
        until=lambda: oven.openness(joint) <= NEARLY,
        speed=GENTLY,
    )
    yield from arm.move(
        lambda: arm.point(arm.ahead(arm.position) + PUSH, arm.aside(before), before[2]),
        last.hand,
        speed=SLOWLY,
        steps=120,
        until=lambda: oven.openness(joint) <= RACK_IN,
        required=False,
    )
    yield from fold_up(arm)
    if oven.openness(joint) > 2.0 * RACK_IN:
        raise SkillFailed(f"{joint.key} stayed {oven.openness(joint):.0%} out")


def clear_way(arm: Arm, oven: Furniture, ways: Sequence[Sequence[Leg]]) -> Sequence[Leg]:
    """The first of some ways to a rack on which nothing else is touched, or else the first one."""
    permits = [("finger", f"{oven.entity}/rack")]
    return next((way for way in ways if foresee(arm, way, permits).free), ways[0])


def fold_up(arm: Arm) -> Motion:
    """Raise the hand, draw back, and fold the arm as an episode begins."""
    yield from arm.move(raised(arm.position, 0.12), tolerance=0.03, speed=0.5, required=False)
    yield from arm.drive(arm.base - BACK * arm.forward)
    yield from fold_arm(arm)


def rack_edge(arm: Arm, oven: Furniture) -> Array:
    """Middle of the upper front edge of an oven's rack, where it is now (3,)."""
    pose, half = oven.interior()
    return arm.point(arm.ahead(pose) - half[1], arm.aside(pose), float(pose[2] - half[2]))
