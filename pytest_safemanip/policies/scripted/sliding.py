"""Skills on what slides or tilts: a dishwasher's rack, a stand mixer's head, a tap's spout."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.things import Furniture
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.geometry import matrix
from pytest_safemanip.trace.kinematics import carried

RACK_PITCH = 35.0
RACK_YAW = 35.0
"""Degrees towards the rack: the hand stays in line with the arm."""
RACK_REACH = 0.53
"""Base to where the hand goes down at the rail, m: it reaches 0.57 m above the floor there."""
RACK_CLEAR = 0.12
"""How far before the rail the hand goes down, m."""
RAIL_END = 0.06
"""From the end of a rail to where it is pushed or pulled, m."""
BESIDE_DOOR = 0.32
"""From the side of a rack to the base, m: half the base's width, and the door's edge."""
RACK_OUT = 0.75
"""A rack that is further out is pushed in."""
RAIL_GAP = 0.03
"""From the middle of closed fingers to the rail before it is touched, m."""
RAIL_DEPTH = 0.02
"""How far below the rail's upper edge the grip point is, m."""

HEAD_PITCH = 75.0
HEAD_REACH = 0.58
HEAD_TIP = 0.012
"""How far behind its front end a mixer's head is lifted, m."""
HEAD_UNDER = 0.015
"""How far the fingertips go under a mixer's head, m."""
FINGER_THICK = 0.012
"""Half the thickness of a finger, m."""
HEAD_LEAD = 0.2
"""Share of the head's travel by which the hand aims ahead of it."""

SPOUT_PITCH = 50.0
SPOUT_REACH = 0.62
SPOUT_AWAY = 0.15
"""How far before and above the spout the hand changes sides, m."""
SPOUT_END = 0.03
"""From the end of a spout's arm to where it is pushed, m."""
SPOUT_GAP = 0.07
"""From the fingers to the spout before it is touched, m: half the palm, and room to stop."""
SPOUT_TURN = 0.58
"""Angle to which it is swung, rad: RoboCasa's sectors begin at 30 degrees."""


def slide_rack(arm: Arm, role: str) -> Motion:
    """Move the uppermost rack to its other end: out if it is not yet out, else in.

    Raises:
        SkillFailed: if it does not get there.
    """
    fixture = Furniture(arm, role)
    joint = max(fixture.joints("rack"), key=lambda rack: rack.pose[2])
    yield from move_rack(arm, fixture, joint, 0.0 if fixture.openness(joint) > RACK_OUT else 1.0)


def move_rack(arm: Arm, fixture: Furniture, joint: Joint, goal: float) -> Motion:
    """Pull a rack by its front rail, or push it, with closed fingers, while the base drives.

    Args:
        arm: the arm.
        fixture: whose rack it is.
        joint: the rack.
        goal: openness to stop at.

    Raises:
        SkillFailed: if it does not get there.
    """
    way = math.copysign(1.0, goal - fixture.openness(joint))
    middle = fixture.part(joint)[:3]
    along, across = halves(arm, joint)
    side = math.copysign(1.0, arm.aside(arm.base) - arm.aside(middle))
    rail = arm.ahead(middle) - along
    top = float(middle[2] + joint.half[2]) - RAIL_DEPTH
    near = arm.aside(middle) + side * (across - RAIL_END)
    spot_ahead = rail + way * RAIL_GAP
    spot = arm.point(spot_ahead, near, top)
    # To push, the palm stands upright in front of the rail; to pull, it must not straddle it.
    roll = 0.0 if way > 0 else -side * 90.0
    hand = arm.hand(RACK_PITCH, roll, -side * RACK_YAW)
    ahead = np.append(arm.forward, 0.0)
    yield from arm.grip(True)
    # The open door sticks out in front of the rack: the base stays beside it.
    beside = arm.aside(middle) + side * (across + BESIDE_DOOR)
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), beside))
    yield from arm.drive(arm.floor_point(spot_ahead - RACK_REACH, beside))
    # Down in front of the counter's edge, then under it.
    clear = raised(spot - RACK_CLEAR * ahead, 0.15)
    yield from arm.move(clear, hand, tolerance=0.03, turn_tolerance=0.2, steps=160)
    yield from arm.move(raised(spot, 0.08), hand, tolerance=0.025, steps=60)
    yield from arm.move(spot, hand, tolerance=0.02, speed=0.5, steps=60)
    yield from arm.drive(
        arm.base - way * (joint.travel + 0.1) * arm.forward,
        until=lambda: (fixture.openness(joint) - goal) * way >= -0.02,
        speed=0.4,
    )
    yield from arm.drive(arm.base + way * 0.02 * arm.forward, tolerance=0.01)
    yield from arm.move(raised(arm.position, 0.12), tolerance=0.03, steps=50, required=False)
    if abs(fixture.openness(joint) - goal) > 0.05:
        raise SkillFailed(f"{joint.key} stopped at {fixture.openness(joint):.0%}")


def lift_head(arm: Arm, role: str) -> Motion:
    """Lift the head of a stand mixer with closed fingers under its front end.

    Raises:
        SkillFailed: if it does not stay up.
    """
    mixer = Furniture(arm, role)
    joint = mixer.joint("head_joint")
    low = np.asarray(joint.pose[:3]) - (0.0, 0.0, joint.half[2])
    outward = low - np.asarray(joint.anchor)
    outward[2] = 0.0
    outward /= np.linalg.norm(outward)
    front = low + (max(joint.half) - HEAD_TIP) * outward
    near = arm.ahead(low) - halves(arm, joint)[0] + HEAD_UNDER
    spot = arm.point(near, arm.aside(front), low[2])
    hand = arm.hand(HEAD_PITCH)
    ahead = np.append(arm.forward, 0.0)

    def under(openness: float, gap: float) -> Array:
        pose = np.append(spot - (0.0, 0.0, gap), (1.0, 0.0, 0.0, 0.0))
        return np.asarray(carried(joint, pose, np.array(openness))[:3])

    yield from arm.grip(True)
    yield from arm.drive(arm.floor_point(arm.ahead(spot) - HEAD_REACH, arm.aside(spot)))
    start = under(0.0, FINGER_THICK + 0.006)
    yield from arm.move(start - 0.14 * ahead, hand, tolerance=0.01, steps=160)
    yield from arm.move(start, hand, tolerance=0.012, speed=0.5, steps=60)

    def lifting() -> Array:
        return under(mixer.openness(joint) + HEAD_LEAD, FINGER_THICK)

    def lifted(goal: float) -> Callable[[], bool]:
        return lambda: mixer.openness(joint) > goal

    # Slowly at the end: the head does not slam against its stop.
    for goal, speed in ((0.9, 0.6), (0.995, 0.25)):
        yield from arm.move(
            lifting, hand, speed=speed, steps=150, until=lifted(goal), required=False
        )
    yield from arm.move(arm.position - 0.16 * ahead, hand, tolerance=0.04, required=False)
    if mixer.openness(joint) < 0.99:
        raise SkillFailed(f"the head stopped at {mixer.openness(joint):.0%}")


def swing_spout(arm: Arm, role: str) -> Motion:
    """Swing a tap's spout to both sides with closed fingers beside its arm.

    Raises:
        SkillFailed: if it does not turn.
    """
    sink = Furniture(arm, role)
    joint = sink.joint("spout_joint")
    yield from arm.grip(True)
    for way in (1.0, -1.0):
        yield from push_spout(arm, sink, joint, way)


def push_spout(arm: Arm, sink: Furniture, joint: Joint, way: float) -> Motion:
    """Swing a spout to one side of the base: 1 to the left, -1 to the right."""
    anchor, middle = np.asarray(joint.anchor), np.asarray(joint.pose[:3])
    length = 2.0 * abs(arm.ahead(middle) - arm.ahead(anchor)) - SPOUT_END
    height = middle[2] + joint.half[2] - 2.0 * FINGER_THICK
    end = np.append(anchor[:2] - length * arm.forward, height)
    left = np.append(arm.left, 0.0)
    sense = math.copysign(1.0, arm.aside(np.cross(joint.axis, end - anchor)))

    def beside(angle: float, gap: float) -> Array:
        at = np.array(angle * sense / joint.travel)
        pose = np.append(end - way * gap * left, (1.0, 0.0, 0.0, 0.0))
        return np.asarray(carried(joint, pose, at)[:3])

    def angle() -> float:
        return sink.openness(joint) * joint.travel * sense

    hand = arm.hand(SPOUT_PITCH, 90.0, -math.degrees(angle()))
    start = beside(angle(), SPOUT_GAP)
    away = raised(start - np.append(SPOUT_AWAY * arm.forward, 0.0), SPOUT_AWAY)
    yield from arm.move(away, hand, tolerance=0.04, turn_tolerance=0.3, steps=160)
    yield from arm.drive(arm.floor_point(arm.ahead(end) - SPOUT_REACH, arm.aside(start)))
    yield from arm.move(start - 0.1 * hand[:, 2], hand, tolerance=0.03, steps=160)
    yield from arm.move(start, hand, tolerance=0.02, speed=0.6, steps=60)
    yield from arm.move(
        lambda: beside(angle() + 0.25 * way, 0.03),
        hand,
        speed=0.5,
        steps=150,
        until=lambda: angle() * way >= SPOUT_TURN,
        required=False,
    )
    yield from arm.move(
        arm.position - 0.16 * hand[:, 2] - 0.03 * way * left, hand, tolerance=0.04, required=False
    )
    if angle() * way < SPOUT_TURN - 0.05:
        raise SkillFailed(f"the spout stopped at {angle():.2f} rad")


def halves(arm: Arm, joint: Joint) -> tuple[float, float]:
    """Half the extents of a joint's part along the base's forward and left direction, m."""
    frame = np.asarray(matrix(np.asarray(joint.pose[3:])))
    ahead, aside = (
        float(np.abs(np.append(way, 0.0) @ frame) @ np.asarray(joint.half))
        for way in (arm.forward, arm.left)
    )
    return ahead, aside
