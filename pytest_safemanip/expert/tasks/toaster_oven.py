"""A small oven on a counter: its rack is drawn out, loaded from above, pushed in; its timer is set.

A hand with something long in it has no room inside: the rack comes out to it.
"""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.motions import operating
from pytest_safemanip.expert.motions.navigation import face
from pytest_safemanip.expert.robot.arm import GENTLY, Arm, Motion, SkillFailed, fold_arm, raised
from pytest_safemanip.expert.robot.hand import FINGERTIP
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.standing import nearest, stand_before
from pytest_safemanip.expert.world.things import Furniture, Part

PITCH = 45.0
"""Degrees from straight down at which closed fingers come in below an oven's roof."""
STAND = 0.64
"""Base to hand, m, where it comes to a rack."""
PUSH_STAND = 0.58
"""Likewise where it pushes one in, which takes it farther in the end."""
BEHIND_EDGE = 0.025
"""How far behind its edge fingertips come down on a rack, m."""
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
    (joint,) = oven.joints(Part.RACK)
    edge = rack_edge(arm, oven)
    spot = raised(edge + arm.onward(BEHIND_EDGE), FINGERTIP)
    hand, ahead = arm.hand(PITCH), np.append(arm.forward, 0.0)
    yield from arm.grip(True)
    yield from stand_before(arm, edge, STAND)
    yield from arm.move(raised(spot - 0.14 * ahead, 0.06), hand, tolerance=0.02, steps=160)
    yield from arm.move(raised(spot, 0.02), hand, tolerance=0.008, speed=0.5, steps=60)
    yield from arm.move(
        raised(spot, -PRESSED), hand, tolerance=0.004, speed=0.1, steps=25, required=False
    )
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
    (joint,) = oven.joints(Part.RACK)
    edge = rack_edge(arm, oven)
    hand, ahead = arm.hand(PITCH), np.append(arm.forward, 0.0)
    before = raised(edge - BEFORE_EDGE * ahead, PUSHED_AT)
    yield from arm.grip(True)
    yield from stand_before(arm, before, PUSH_STAND)
    yield from arm.move(raised(before, 0.08), hand, tolerance=0.02, steps=160)
    yield from arm.move(before, hand, tolerance=0.006, speed=0.4, steps=60, required=False)
    aside = arm.aside(arm.base)
    farthest = nearest(arm, aside, aside)
    yield from arm.drive(
        arm.floor_point(min(arm.ahead(arm.base) + joint.travel + 0.1, farthest), aside),
        until=lambda: oven.openness(joint) <= NEARLY,
        speed=GENTLY,
    )
    yield from arm.move(
        lambda: arm.point(arm.ahead(arm.position) + PUSH, arm.aside(before), before[2]),
        hand,
        speed=SLOWLY,
        steps=120,
        until=lambda: oven.openness(joint) <= RACK_IN,
        required=False,
    )
    yield from fold_up(arm)
    if oven.openness(joint) > 2.0 * RACK_IN:
        raise SkillFailed(f"{joint.key} stayed {oven.openness(joint):.0%} out")


def fold_up(arm: Arm) -> Motion:
    """Raise the hand, draw back, and fold the arm as an episode begins."""
    yield from arm.move(raised(arm.position, 0.12), tolerance=0.03, speed=0.5, required=False)
    yield from arm.drive(arm.base - BACK * arm.forward)
    yield from fold_arm(arm)


def rack_edge(arm: Arm, oven: Furniture) -> Array:
    """Middle of the upper front edge of an oven's rack, where it is now (3,)."""
    pose, half = oven.interior()
    return arm.point(arm.ahead(pose) - half[1], arm.aside(pose), float(pose[2] - half[2]))
