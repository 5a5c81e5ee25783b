"""A dishwasher, from beside its open door: its racks slide, dishes go into the upper one, and it is
shut.

The arm does not get under the door's end, which lies 40 cm above the floor. But its liner is
hollow: from above, the fingers pinch a side edge of the door like a pan's handle, and it turns
between them while they lift it.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.operating import close_all, close_rack
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, fold_arm, raised
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Furniture, Part
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.kinematics import carried

RISEN = 1.10
"""Height from which the hand comes back to the base, m: lower, its wrist is at its limit there."""
RACK_BACK = 0.35
"""How far the base draws back from the rack that it has pushed in, m: the hand from under the
counter."""
DOOR_EDGE = 0.035
"""Width of the door's side edge, m."""
IN_HOLLOW = 0.026
"""From the door's front to the grip point, m: the inner fingertip is in its hollow liner."""
OFF_DOOR_END = 0.036
"""From the door's end to where its side edge is pinched, m: the palm has no room farther in when
the door is steep."""
OVER_EDGE = 0.07
"""How far above the edge the hand comes to rest before it takes it, m."""
LIFT_AHEAD = 0.32
"""How far before the base the hand pinches the edge, m."""
LIFT_LEAD, LIFT_SPEED = 0.3, 0.75
"""Share of the door's travel by which the hand aims ahead of it, and its speed, share of the top
speed: it yields to the door's weight, which is more for it than its own."""
DOOR_LIFTED = 0.33
"""Openness at which the door is let go, for the wrist to stay before the counter; its hinge holds
it."""


def close_by_edge(arm: Arm, fixture_role: str) -> Motion:
    """Push in the upper rack of a dishwasher, lift its door by its side edge, pinched from above,
    and push it shut.

    Raises:
        SkillFailed: if it does not shut.
    """
    if arm.choices.choose("as any other door", (False, True)):
        yield from close_rack(arm, fixture_role)
        yield from close_all(arm, fixture_role)
        return
    fixture = Furniture(arm, fixture_role)
    joint = fixture.joint(Part.DOOR)
    yield from close_rack(arm, fixture_role)
    yield from arm.drive(arm.base - RACK_BACK * arm.forward)
    yield from rise_and_fold(arm)
    yield from _lift_edge(arm, fixture, joint)
    yield from rise_and_fold(arm)
    yield from close_all(arm, fixture_role)


def rise_and_fold(arm: Arm) -> Motion:
    """Bring the hand back in front of the base: from there every joint turns as far as it takes."""
    yield from rise_off(arm)
    yield from fold_arm(arm, required=False)


def rise_off(arm: Arm) -> Motion:
    """Draw the hand straight up, out of the rack or off the door."""
    up = raised(arm.position, max(0.0, RISEN - float(arm.position[2])))
    yield from arm.move(up, tolerance=0.06, required=False)


def _lift_edge(arm: Arm, fixture: Furniture, joint: Joint) -> Motion:
    """Pinch the side edge of the open door near its end, and lift it most of the way."""
    anchor, middle, half = (np.asarray(v) for v in (joint.anchor, joint.pose[:3], joint.half))
    side = math.copysign(1.0, arm.aside(arm.base) - arm.aside(middle))
    aside = arm.aside(middle) + side * (half[0] - DOOR_EDGE / 2.0)
    shut = arm.point(arm.ahead(anchor) + IN_HOLLOW, aside, middle[2] + half[2] - OFF_DOOR_END)

    def edge(openness: float) -> Array:
        return _door_point(joint, shut, openness)

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
        until=lambda: fixture.openness(joint) < DOOR_LIFTED,
        required=False,
    )
    if fixture.openness(joint) > DOOR_LIFTED:
        raise SkillFailed(f"{joint.key} was not lifted")
    yield from arm.grip(False)


def _door_point(joint: Joint, spot: Array, openness: float) -> Array:
    """A point of the shut door, where it is at an openness (3,)."""
    pose = np.append(spot, (1.0, 0.0, 0.0, 0.0))
    return np.asarray(carried(joint, pose, np.array(openness))[:3])
