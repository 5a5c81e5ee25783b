"""Closing what stands open: a door is pushed to, a drop door flipped up, a drawer pushed in."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pytest_safemanip.expert.robot.arm import FOLDED, Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.robot.hand import FINGERTIP
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Furniture
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.kinematics import carried, opening_direction

SHUT = 0.004
"""A door that is no more open than this is shut: RoboCasa asks for half a percent."""

PUSH_HEIGHT = 1.3
"""Where the arm pushes best, m above the floor."""
PUSH_MARGIN = 0.08
"""From a door's edges to where it is pushed, m: between its handle and the hinge."""
PUSH_PITCH = 70.0
PUSH_YAW = 40.0
"""Degrees towards the open door: the fingertips meet it before the palm does, open or shut."""
PUSH_REACH = 0.55
"""Base to hand while it pushes, m."""
PUSH_LAST = 0.12
"""Openness at which the arm takes over from the base, which cannot stop as gently."""
PUSH_GAP = 0.05
"""From the fingertips to the door before it is touched, m."""
PUSH_WIDE = 0.15
"""How far beside the open door the base goes in, m: the palm is this much wider than the tips."""
PUSH_BEFORE = 0.45
"""Base to hand before it reaches out, m."""

FLIP_PITCH = 60.0
FLIP_REACH = 0.60
FLIP_UNDER = 0.010
"""How far a finger goes under the edge of a drop door, m: its handle's bar is not far behind."""
FLIP_OVER = 0.002
"""How far above its edge the fingertips aim that push it, m: they slide down by 2 cm on the way; in
the gap behind its handle they would draw it open again."""
FLIP_TRIES = 2
FINGER = 0.04
"""From the grip point to the inner side of a finger of the open hand, m."""
LEAD = 0.15
"""Share of a door's travel by which the hand aims ahead of it: its spring yields to that."""
SLOW_AT, SLOW = 0.06, 0.07
"""Openness from which a door is pushed slowly, and how slowly."""
FLIPPED = 0.55
"""Openness of a drop door at which it is pushed instead of lifted."""

DRAWER_PITCH = 40.0
DRAWER_STAND = 0.58


def close_all(arm: Arm, role: str) -> Motion:
    """Push shut each door or drawer of a fixture that is open, one after the other.

    Raises:
        SkillFailed: if one does not shut.
    """
    fixture = Furniture(arm, role)
    for joint in fixture.doors():
        if fixture.openness(joint) <= SHUT:
            continue
        yield from arm.grip(True)
        if joint.kind == "slide":
            yield from push_in(arm, fixture, joint)
        elif abs(joint.axis[2]) > 0.5:
            yield from push_door(arm, fixture, joint)
        else:
            yield from flip_door(arm, fixture, joint)
        if fixture.openness(joint) > SHUT:
            raise SkillFailed(f"{joint.key} stayed {fixture.openness(joint):.1%} open")


def push_door(arm: Arm, fixture: Furniture, joint: Joint, until: float = SHUT) -> Motion:
    """Go round a side-hinged door and push it with the fingertips; the base does the moving.

    Args:
        arm: the arm, its fingers closed.
        fixture: whose door it is.
        joint: the door.
        until: openness at which to stop pushing.
    """
    spot, edge, side = _push_spot(arm, joint)
    hand = arm.hand(PUSH_PITCH, 90.0, -side * PUSH_YAW)
    start = door_point(joint, spot, fixture.openness(joint), PUSH_GAP)
    free = door_point(joint, edge, fixture.openness(joint), 0.0)
    stand, aside = arm.ahead(start) - PUSH_REACH, arm.aside(start) + side * PUSH_WIDE
    reach = max(arm.ahead(arm.position) - arm.ahead(arm.base), PUSH_BEFORE)
    back = min(arm.ahead(free) - reach - PUSH_MARGIN, stand, arm.ahead(arm.base))
    yield from arm.drive(arm.floor_point(back, arm.aside(arm.base)))
    yield from arm.drive(arm.floor_point(back, aside))
    # From there every joint turns as far as it takes; from where a load was set down, some do not.
    yield from arm.move(
        arm.point(back + FOLDED[0], aside, FOLDED[1]),
        arm.hand(FOLDED[2]),
        tolerance=0.05,
        turn_tolerance=0.2,
        required=False,
    )
    yield from arm.move(
        arm.point(back + PUSH_BEFORE, aside, start[2]), hand, tolerance=0.03, steps=140
    )
    yield from arm.drive(arm.floor_point(stand, aside))
    yield from arm.move(start, hand, tolerance=0.02, steps=80)
    before = arm.position[:2] - arm.base
    last = max(until, PUSH_LAST)
    for openness in np.arange(fixture.openness(joint), last - 0.1, -0.08).tolist():
        target = door_point(joint, spot, openness, 0.0)[:2] - before
        yield from arm.drive(
            target, speed=0.45, steps=40, until=lambda: fixture.openness(joint) <= last
        )
    yield from _follow(
        arm, fixture, joint, hand, lambda openness: door_point(joint, spot, openness, 0.0), until
    )
    yield from arm.drive(arm.base - 0.2 * arm.forward)


def flip_door(arm: Arm, fixture: Furniture, joint: Joint, until: float = SHUT) -> Motion:
    """Lift a drop door with a finger under its edge, then push it shut.

    Args:
        arm: the arm.
        fixture: whose door it is.
        joint: the door.
        until: openness at which to stop pushing.
    """
    top = np.add(joint.pose[:3], (0.0, 0.0, joint.half[2] - FLIP_UNDER))
    front = min(arm.ahead(np.asarray(joint.anchor)), arm.ahead(top))
    face = arm.point(front, arm.aside(top), top[2])
    where = door_point(joint, face, fixture.openness(joint), 0.0)
    yield from arm.drive(arm.floor_point(arm.ahead(where) - FLIP_REACH, arm.aside(where)))
    if fixture.openness(joint) > FLIPPED:
        yield from _lift_door(arm, fixture, joint, face)
    hand, rim = arm.hand(FLIP_PITCH), raised(face, FLIP_UNDER + FLIP_OVER)
    yield from arm.grip(True)
    # Up here the wrist turns freely; on the way down it would be at its limit, and twist.
    yield from arm.move(arm.position, hand, tolerance=0.03, turn_tolerance=0.2, required=False)

    def pushed(openness: float, gap: float) -> Array:
        return door_point(joint, rim, openness, gap) - FINGERTIP * hand[:, 2]

    for _ in range(FLIP_TRIES):
        yield from arm.move(pushed(fixture.openness(joint), PUSH_GAP), hand, tolerance=0.02)
        yield from _follow(arm, fixture, joint, hand, lambda openness: pushed(openness, 0.0), until)
        yield from arm.move(arm.position - 0.15 * hand[:, 2], tolerance=0.03, required=False)
        if fixture.openness(joint) <= until:
            return


def push_in(arm: Arm, fixture: Furniture, joint: Joint, until: float = SHUT) -> Motion:
    """Push a drawer in by its handle with closed fingers, driving forward."""
    bar = fixture.handle(joint)[0][:3]
    hand = arm.hand(DRAWER_PITCH)
    yield from arm.drive(arm.floor_point(arm.ahead(bar) - DRAWER_STAND - 0.1, arm.aside(bar)))
    before = bar - arm.onward(0.08)
    yield from arm.move(before + np.array((0.0, 0.0, 0.1)), hand, tolerance=0.02, steps=140)
    yield from arm.move(before, hand, tolerance=0.015, steps=60)
    yield from arm.drive(
        arm.base + 0.6 * arm.forward, speed=0.4, until=lambda: fixture.openness(joint) <= until
    )
    yield from arm.drive(arm.base - 0.1 * arm.forward)


def _lift_door(arm: Arm, fixture: Furniture, joint: Joint, face: Array) -> Motion:
    hand = arm.hand(FLIP_PITCH, 90.0)
    approach = hand[:, 2]
    across = hand[:, 0] * math.copysign(1.0, hand[2, 0])

    def under(openness: float, gap: float) -> Array:
        touched = door_point(joint, face, openness, gap)
        return np.asarray(touched - FINGERTIP * approach + FINGER * across)

    first = fixture.openness(joint)
    yield from arm.grip(False)
    start = under(first, 0.006)
    ahead = np.append(arm.forward, 0.0)
    yield from arm.move(start - 0.05 * ahead + 0.08 * across, hand, tolerance=0.02, steps=140)
    yield from arm.move(start - 0.05 * ahead, hand, tolerance=0.01, steps=60)
    yield from arm.move(start, hand, tolerance=0.006, speed=0.4, steps=40, required=False)
    yield from _follow(
        arm, fixture, joint, hand, lambda openness: under(openness, 0.0), FLIPPED - 0.05
    )
    if fixture.openness(joint) > 0.8:
        raise SkillFailed(f"{joint.key} was not lifted")
    yield from arm.move(arm.position - 0.12 * approach, hand, tolerance=0.03, required=False)


def _follow(
    arm: Arm,
    fixture: Furniture,
    joint: Joint,
    hand: Array,
    at: Callable[[float], Array],
    until: float,
) -> Motion:
    """Push a door along its arc; the hand aims a little ahead of where the door is. Slowly at the
    end: the door does not slam.
    """

    def ahead() -> Array:
        return at(fixture.openness(joint) - LEAD)

    def past(goal: float) -> Callable[[], bool]:
        return lambda: fixture.openness(joint) <= goal

    for goal, speed in ((max(until, SLOW_AT), 0.6), (until, SLOW)):
        yield from arm.move(ahead, hand, speed=speed, steps=150, until=past(goal), required=False)


def door_point(joint: Joint, spot: Array, openness: float, gap: float) -> Array:
    """A point of the shut door, where it is at an openness, moved away from the door (3,)."""
    where = carried(joint, np.append(spot, (1.0, 0.0, 0.0, 0.0)), np.array(openness))[:3]
    return np.asarray(where + gap * opening_direction(joint, where))


def _push_spot(arm: Arm, joint: Joint) -> tuple[Array, Array, float]:
    """Where the grip point is when it pushes the shut door (3,), the door's edge there (3,), and on
    which side the hinge is: 1 to the left, -1 to the right.
    """
    anchor, middle = np.asarray(joint.anchor), np.asarray(joint.pose[:3])
    side = math.copysign(1.0, arm.aside(anchor) - arm.aside(middle))
    width = 2.0 * abs(arm.aside(middle) - arm.aside(anchor))
    low, high = middle[2] - joint.half[2], middle[2] + joint.half[2]
    height = float(np.clip(PUSH_HEIGHT, low + PUSH_MARGIN, high - PUSH_MARGIN))
    front = arm.ahead(anchor)
    spot = arm.point(
        front - FINGERTIP, arm.aside(anchor) - side * (width - 2 * PUSH_MARGIN), height
    )
    return spot, arm.point(front, arm.aside(anchor) - side * width, height), side
