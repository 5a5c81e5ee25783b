"""Shutting a dishwasher from beside its open door: its rack pushed in, its door lifted and pushed.

The arm does not get under the door's end, which lies 40 cm above the floor. But its liner is
hollow: from above, the fingers pinch a side edge of the door like a pan's handle, and it turns
between them while they lift it.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.policies.scripted.closing import FOLDED, SHUT, door_point
from pytest_safemanip.policies.scripted.grasping import FINGERTIP
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.sliding import move_rack
from pytest_safemanip.policies.scripted.things import Furniture
from pytest_safemanip.trace.elements import Joint

RISEN = 1.10
"""Height from which the hand comes back to the base, m: lower, its wrist is at its limit there."""
DRAWN = 0.35
"""How far the base draws back from the rack that it has pushed in, m: the hand from under the
counter."""
EDGE = 0.035
"""Width of the door's side edge, m."""
IN_HOLLOW = 0.026
"""From the door's front to the grip point, m: the inner fingertip is in its hollow liner."""
END = 0.036
"""From the door's end to where its side edge is pinched, m: the palm has no room farther in when
the door is steep."""
OVER_EDGE = 0.07
"""How far above the edge the hand comes to rest before it takes it, m."""
LIFT_AHEAD = 0.32
"""How far before the base the hand pinches the edge, m."""
LIFT_LEAD, LIFT_SPEED = 0.3, 0.75
"""Share of the door's travel by which the hand aims ahead of it, and its speed, share of the top
speed: it yields to the door's weight, which is more for it than its own."""
LIFTED = 0.33
"""Openness at which the door is let go, for the wrist to stay before the counter; its hinge holds
it."""

PUSHED = 0.55
"""Height at which the door is pushed, share of its own: the hand stays below its handle."""
IN_FROM = 0.05
"""From its side to where it is pushed, m: beside its handle."""
PUSH_PITCH, PUSH_YAW = 50.0, 25.0
"""Degrees towards the door: nearly along the arm."""
PUSH_AHEAD = 0.58
"""How far before the base the hand pushes, m."""
PUSH_GAP = 0.10
"""From the grip point to the door before it is touched, m: the palm is over the fingertips."""
PUSH_LAST = 0.12
"""Openness at which the arm takes over from the base, which cannot stop as gently."""
PUSH_LEAD, PUSH_SPEED = 0.15, 0.3
"""Share of the door's travel by which the hand then aims ahead of it, and its speed, share of the
top speed: more slowly, the hinge's friction stops it."""


def shut_door(arm: Arm, fixture_role: str) -> Motion:
    """Push in the upper rack of a dishwasher, lift its door by its side edge, pinched from above,
    and push it shut.

    Raises:
        SkillFailed: if it does not shut.
    """
    fixture = Furniture(arm, fixture_role)
    joint = fixture.joint("door_joint")
    yield from fold(arm)
    yield from move_rack(arm, fixture, upper_rack(fixture), 0.0)
    yield from arm.drive(arm.base - DRAWN * arm.forward)
    yield from fold(arm)
    yield from _lift_edge(arm, fixture, joint)
    yield from fold(arm)
    yield from _push_face(arm, fixture, joint)
    if fixture.openness(joint) > SHUT:
        raise SkillFailed(f"{joint.key} stayed {fixture.openness(joint):.1%} open")


def fold(arm: Arm) -> Motion:
    """Bring the hand back in front of the base: from there every joint turns as far as it takes."""
    yield from rise(arm)
    here = arm.base
    before = arm.point(arm.ahead(here) + FOLDED[0], arm.aside(here), FOLDED[1])
    hand = arm.hand(FOLDED[2])
    yield from arm.move(before, hand, tolerance=0.05, turn_tolerance=0.2, required=False)


def rise(arm: Arm) -> Motion:
    """Draw the hand straight up, out of the rack or off the door."""
    up = raised(arm.position, max(0.0, RISEN - float(arm.position[2])))
    yield from arm.move(up, tolerance=0.06, required=False)


def _lift_edge(arm: Arm, fixture: Furniture, joint: Joint) -> Motion:
    """Pinch the side edge of the open door near its end, and lift it most of the way."""
    anchor, middle, half = (np.asarray(v) for v in (joint.anchor, joint.pose[:3], joint.half))
    side = math.copysign(1.0, arm.aside(arm.base) - arm.aside(middle))
    aside = arm.aside(middle) + side * (half[0] - EDGE / 2.0)
    shut = arm.point(arm.ahead(anchor) + IN_HOLLOW, aside, middle[2] + half[2] - END)

    def edge(openness: float) -> Array:
        return door_point(joint, shut, openness, 0.0)

    def come_down(over: float, tolerance: float, speed: float) -> Motion:
        yield from arm.move(
            lambda: raised(edge(fixture.openness(joint)), over),
            hand,
            tolerance=tolerance,
            turn_tolerance=0.06,
            speed=speed,
            steps=80,
            required=False,
            exact=True,
        )

    hand, start = arm.hand(), edge(fixture.openness(joint))
    yield from arm.drive(arm.floor_point(arm.ahead(start) - LIFT_AHEAD, arm.aside(arm.base)))
    yield from arm.grip(False)
    yield from arm.move(raised(start, 0.30), hand, tolerance=0.04, turn_tolerance=0.1, steps=140)
    yield from come_down(OVER_EDGE, 0.008, 0.8)
    yield from come_down(0.0, 0.005, 0.3)
    yield from arm.grip(True)
    yield from arm.move(
        lambda: edge(fixture.openness(joint) - LIFT_LEAD),
        hand,
        speed=LIFT_SPEED,
        steps=150,
        until=lambda: fixture.openness(joint) < LIFTED,
        required=False,
    )
    if fixture.openness(joint) > LIFTED:
        raise SkillFailed(f"{joint.key} was not lifted")
    yield from arm.grip(False)


def _push_face(arm: Arm, fixture: Furniture, joint: Joint) -> Motion:
    """Push a door that is nearly shut with the fingertips, beside its handle."""
    anchor, middle, half = (np.asarray(v) for v in (joint.anchor, joint.pose[:3], joint.half))
    side = math.copysign(1.0, arm.aside(arm.base) - arm.aside(middle))
    aside = arm.aside(middle) + side * (half[0] - IN_FROM)
    face = arm.point(arm.ahead(anchor), aside, anchor[2] + PUSHED * 2.0 * half[2])
    hand = arm.hand(PUSH_PITCH, yaw=-side * PUSH_YAW)

    def pushed(openness: float) -> Array:
        return door_point(joint, face, openness, 0.0) - FINGERTIP * hand[:, 2]

    lean = (face[2] - anchor[2]) * math.tan(fixture.openness(joint) * joint.travel)
    start = face - np.append((lean + PUSH_GAP) * arm.forward, 0.0)
    yield from arm.grip(True)
    yield from arm.drive(arm.floor_point(arm.ahead(start) - PUSH_AHEAD, arm.aside(arm.base)))
    yield from arm.move(start, hand, tolerance=0.03, turn_tolerance=0.2, steps=140)
    yield from arm.drive(
        arm.base + (lean + PUSH_GAP) * arm.forward,
        speed=0.4,
        until=lambda: fixture.openness(joint) < PUSH_LAST,
    )
    yield from arm.move(
        lambda: pushed(fixture.openness(joint) - PUSH_LEAD),
        hand,
        speed=PUSH_SPEED,
        steps=100,
        until=lambda: fixture.openness(joint) <= SHUT,
        required=False,
    )
    yield from arm.move(arm.position - 0.15 * hand[:, 2], tolerance=0.03, required=False)


def upper_rack(fixture: Furniture) -> Joint:
    """The rack that slides out uppermost."""
    return max(fixture.joints("rack"), key=lambda rack: rack.pose[2])
