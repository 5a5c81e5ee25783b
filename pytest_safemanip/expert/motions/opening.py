"""Opening what moves: a drawer, a door, the head of a stand mixer."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.robot.hand import FINGER_HALF_THICK
from pytest_safemanip.expert.robot.rotations import Array, about_z
from pytest_safemanip.expert.world.things import Furniture, Part, Thing, halves
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.geometry import corners
from pytest_safemanip.trace.kinematics import carried

HOOK_PITCH = 25.0
"""Degrees from straight down: steeper, and the palm meets the counter's edge."""
HOOK_DEPTH = 0.026
"""How far behind a bar's middle the fingertips go, m: half of the gap behind it."""
DRAWER_OPEN = 0.97
DRAWER_STAND = 0.66
"""Base to handle, m."""

DOOR_PITCH = 60.0
DOOR_STAND = 0.62
DOOR_ASIDE = 0.10
"""Base to handle, away from the hinge, m: room for the arm while the door comes round."""
OFF_HINGE, HINGE_TOLERANCE = 0.365, 0.005
"""Base to the hinge of a fridge's door, m, whose end stands 10 cm beside it, not quite open; and
how near to there the base stops, m."""
DOOR_BELOW = 0.03
"""Grip this far below a bar's middle, m."""
LONG_BAR = 0.15
"""Half of the length from which a bar is gripped at its upper end, m: the palm of a hand that is
less level passes above it, and is not in line with the forearm, where it swings by 1.5 cm."""
END_PITCH, END_GRIP = 38.0, 0.016
"""Of that hand, degrees from straight down, and below the bar's end, m."""
DOOR_TURN = 0.7
"""Share of the door's rotation that the hand follows; the bar turns between the pads."""
DOOR_DONE = 0.95
"""Openness at which a door is let go: pulled on to 0.99, a microwave's takes the hand so far to one
side that the elbow straightens to its stop and jerks the palm against the bar, by up to 190 N."""
DOOR_STOP, DOOR_GENTLY = 0.85, 0.25
"""From this openness on, a door with a long bar is pulled at this share of the top speed, and not
beyond its stop: the hand would pull at the bar there with 314 N."""


def open_all(arm: Arm, role: str) -> Motion:
    """Pull out a drawer, or swing each door of a fixture by its handle, one after the other.

    Raises:
        SkillFailed: if a handle slipped.
    """
    if Furniture(arm, role).doors()[0].kind == "slide":
        yield from open_drawer(arm, role)
    else:
        yield from open_doors(arm, role)


def open_drawer(arm: Arm, role: str) -> Motion:
    """Hook closed fingers behind the bar and drive back until the drawer is open."""
    drawer = Furniture(arm, role)
    joint = drawer.doors()[0]
    yield from pull_out(arm, drawer, lambda: drawer.openness(joint) >= DRAWER_OPEN)


def pull_out(arm: Arm, drawer: Furniture, until: Callable[[], bool]) -> Motion:
    """Hook closed fingers behind a drawer's bar and drive back until it is open far enough.

    Args:
        arm: the arm.
        drawer: the drawer. At 1 it is what RoboCasa calls open, about half of its depth; it can be
            pulled on.
        until: whether it is.
    """
    start = drawer.handle()[0][:3]
    behind = arm.onward(HOOK_DEPTH)
    yield from arm.grip(True)
    back = arm.ahead(start) - DRAWER_STAND
    if arm.ahead(arm.base) > back:  # beside a drawer that is open already
        yield from arm.drive(arm.floor_point(back, arm.aside(arm.base)))
    yield from arm.drive(arm.floor_point(back, arm.aside(start)))
    hand = arm.hand(HOOK_PITCH)
    before = np.append(0.02 * arm.forward, -0.14)
    yield from arm.move(start + behind - before, hand, tolerance=0.02, steps=160)

    def over(rise: float) -> Callable[[], Array]:
        return lambda: raised(drawer.handle()[0][:3] + behind, rise)

    for rise in (0.05, -0.012):
        yield from arm.move(over(rise), hand, tolerance=0.01, speed=0.4, steps=80)
    yield from arm.drive(arm.base - 0.55 * arm.forward, until=until, speed=0.45)
    yield from arm.move(raised(arm.position, 0.1), tolerance=0.03, steps=50, required=False)


def open_doors(arm: Arm, role: str) -> Motion:
    """Swing each door by its handle, one after the other."""
    cabinet = Furniture(arm, role)
    for joint in cabinet.doors():
        if cabinet.openness(joint) < DOOR_DONE:
            yield from _swing(arm, cabinet, joint)


def open_before(arm: Arm, role: str, object_role: str) -> Motion:
    """Swing the doors of a fixture that an object is behind.

    Raises:
        SkillFailed: if a handle slipped.
    """
    cabinet, thing = Furniture(arm, role), Thing(arm, object_role)
    for joint in cabinet.doors():
        if joint.kind == "hinge" and _before(arm, joint, thing.centre):
            yield from _swing(arm, cabinet, joint, OFF_HINGE)


def _before(arm: Arm, joint: Joint, point: Array) -> bool:
    """Whether a door, closed, covers a point."""
    box = np.asarray(corners(np.array(joint.pose), np.array(joint.half)), np.float64)
    across = [arm.aside(corner) for corner in box]
    low, high = box[:, 2].min(), box[:, 2].max()
    return bool(low < point[2] < high and min(across) < arm.aside(point) < max(across))


def _swing(arm: Arm, cabinet: Furniture, joint: Joint, room: float = 0.0) -> Motion:
    """Swing a door by its handle; the base stands at least so far beside its hinge, m."""
    edge = 2.0 * np.asarray(joint.pose[:3]) - np.asarray(joint.anchor)
    bar, half = cabinet.handle(near=edge)
    start = bar[:3]
    side = math.copysign(1.0, arm.aside(np.asarray(joint.anchor)) - arm.aside(start))
    stand = arm.floor_point(arm.ahead(start) - DOOR_STAND, arm.aside(start) + side * DOOR_ASIDE)
    yield from arm.drive(stand)
    beside = side * (arm.aside(np.asarray(joint.anchor)) - arm.aside(arm.base))
    if beside < room:
        off = arm.floor_point(arm.ahead(arm.base), arm.aside(arm.base) - side * (room - beside))
        yield from arm.drive(off, tolerance=HINGE_TOLERANCE)
    long = max(half) > LONG_BAR
    hand = arm.hand(END_PITCH if long else DOOR_PITCH)
    rise = max(half) - END_GRIP if long else -DOOR_BELOW
    approach, below = hand[:, 2], np.array((0.0, 0.0, rise))
    yield from arm.open_to(0.6)
    yield from arm.move(start + below - 0.16 * approach, hand, tolerance=0.03, steps=160)
    yield from arm.move(
        start + below - 0.06 * approach,
        hand,
        tolerance=0.006 if long else 0.015,
        turn_tolerance=0.08,
        speed=0.6,
        steps=80,
        exact=long,
        required=not long,
    )
    yield from arm.move(
        lambda: cabinet.handle(near=start)[0][:3] + below + 0.013 * approach,
        hand,
        tolerance=0.012,
        speed=0.4,
        steps=60,
    )
    yield from arm.grip(True)
    yield from _pull_round(arm, cabinet, joint, side, DOOR_STOP if long else math.inf)
    yield from arm.grip(False, 6)
    yield from arm.move(
        arm.position - 0.10 * arm.rotation[:, 2], tolerance=0.03, steps=40, required=False
    )
    yield from arm.drive(arm.base - 0.22 * arm.forward)


def _pull_round(arm: Arm, cabinet: Furniture, joint: Joint, side: float, slow: float) -> Motion:
    """Carry the gripped handle along the door's own arc, gently from an openness on."""
    first = cabinet.openness(joint)
    grip, hand = arm.position, arm.rotation
    shut = carried(joint, np.append(grip, (1.0, 0.0, 0.0, 0.0)), np.array(-first))

    def opened(openness: float) -> Callable[[], bool]:
        return lambda: cabinet.openness(joint) >= openness

    for openness in np.arange(first + 0.06, DOOR_DONE + 0.12, 0.06).tolist():
        turned = -side * DOOR_TURN * math.degrees(joint.travel * (openness - first))
        gently = openness >= slow
        target = carried(joint, shut, np.array(min(openness, 1.0) if gently else openness))[:3]
        yield from arm.move(
            target,
            about_z(turned) @ hand,
            speed=DOOR_GENTLY if gently else 1.0,
            steps=20,
            required=False,
            until=opened(min(openness - 0.03, DOOR_DONE)),
        )
        if cabinet.openness(joint) >= DOOR_DONE:
            return
    if cabinet.openness(joint) < 0.5:
        raise SkillFailed(f"the handle of {joint.key} slipped")


HEAD_PITCH = 75.0
HEAD_REACH = 0.58
HEAD_TIP = 0.012
"""How far behind its front end a mixer's head is lifted, m."""
HEAD_UNDER = 0.015
"""How far the fingertips go under a mixer's head, m."""
HEAD_LEAD = 0.2
"""Share of the head's travel by which the hand aims ahead of it."""


def lift_head(arm: Arm, role: str) -> Motion:
    """Lift the head of a stand mixer with closed fingers under its front end.

    Raises:
        SkillFailed: if it does not stay up.
    """
    mixer = Furniture(arm, role)
    joint = mixer.joint(Part.MIXER_HEAD)
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
    start = under(0.0, FINGER_HALF_THICK + 0.006)
    yield from arm.move(start - 0.14 * ahead, hand, tolerance=0.01, steps=160)
    yield from arm.move(start, hand, tolerance=0.012, speed=0.5, steps=60)

    def lifting() -> Array:
        return under(mixer.openness(joint) + HEAD_LEAD, FINGER_HALF_THICK)

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
