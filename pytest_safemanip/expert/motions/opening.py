"""Opening what moves: a drawer, a door, the head of a stand mixer."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.robot.hand import (
    FINGER_HALF_THICK,
    FINGER_SIDE,
    FINGER_THICK,
    FINGERTIP,
    HAND,
    OPENING,
)
from pytest_safemanip.expert.robot.rotations import Array, about_z
from pytest_safemanip.expert.world.standing import rearmost
from pytest_safemanip.expert.world.things import Furniture, Part, Thing, halves
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.geometry import corners
from pytest_safemanip.trace.kinematics import carried

UPRIGHT = (60.0, 0.62)
"""Degrees from straight down, and base to handle, m, of a hand on an upright handle."""
LEVEL = ((0.62, 0.68, 0.74, 0.77), (42.0, 46.0, 52.0, 55.0))
"""Base to a level handle, m, and how far the hand tips there, degrees from straight down: such a
handle is as low as a counter or lower, and the more the hand tips, the more room has the palm."""
PULLS = 2
"""A handle that slipped is taken once more."""
PULLED = 0.12
"""Kept free behind the base for it to pull, m."""
DRIVEN = 0.12
"""How far the base drives to a handle with the hand held ready, m: the arm moves before what stands
around it."""
DOOR_ASIDE = 0.10
"""Base to handle, away from the hinge, m: room for the arm while the door comes round."""
OFF_HINGE = 0.365
"""Base to the hinge of a fridge's door, m, whose end stands 10 cm beside it, not quite open."""
PALM_FACE = 0.030
"""From the grip point to the palm's own surface, m."""
READY = 0.05
"""How far before the grip point the hand is held ready, m."""
BESIDE_BAR = 0.009
"""Kept free between a handle and the fingers that come in, m."""
BEYOND_BAR, OFF_DOOR = 0.010, 0.004
"""How far beyond a handle's middle the grip point goes, and what is kept free between fingertips
and the door behind it, m."""
BELOW_MIDDLE = 0.03
"""A short upright handle is gripped this far below its middle, m."""
LONG_BAR = 0.15
"""Half of the length from which a bar is gripped at its upper end, m: the palm of a hand that is
less level passes above it, and is not in line with the forearm, where it swings by 1.5 cm."""
END_PITCH, END_GRIP = 38.0, 0.016
"""Of that hand, degrees from straight down, and below the bar's end, m."""
HIGHEST_GRIP = 1.45
"""Where a bar goes on upwards it is gripped at this height, m."""
DRAWER_OPEN = 0.97
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
    """Take a drawer by its handle and drive back until it is open."""
    drawer = Furniture(arm, role)
    joint = drawer.doors()[0]
    yield from pull_out(arm, drawer, lambda: drawer.openness(joint) >= DRAWER_OPEN)


def pull_out(arm: Arm, drawer: Furniture, until: Callable[[], bool]) -> Motion:
    """Take a drawer by its handle and drive back until it is open far enough.

    Args:
        arm: the arm.
        drawer: the drawer. At 1 it is what RoboCasa calls open, about half of its depth; it can be
            pulled on.
        until: whether it is.

    Raises:
        SkillFailed: if the hand does not get to the handle.
    """
    joint = drawer.doors()[0]
    middle = drawer.handle(joint)[0]
    for _ in range(PULLS):
        yield from take_handle(arm, drawer, joint, arm.aside(middle))
        yield from arm.drive(arm.base - 0.55 * arm.forward, until=until, speed=0.45)
        yield from let_go(arm)
        if until():
            return
    raise SkillFailed(f"the handle of {joint.key} slipped at {drawer.openness(joint):.0%}")


def take_handle(
    arm: Arm, fixture: Furniture, joint: Joint, aside: float, speed: float = 0.7
) -> Motion:
    """Close the fingers across the handle of a door or drawer.

    Args:
        arm: the arm.
        fixture: whose handle it is.
        joint: the door or drawer.
        aside: where the base stands, along its left direction, m.
        speed: largest command to the base.

    Raises:
        SkillFailed: if the hand does not get there.
    """
    pose, half = fixture.handle(joint)
    upright, rise, roll = half[2] >= half[0], 0.0, 90.0
    free = arm.ahead(pose) - rearmost(arm, *sorted((arm.aside(arm.base), aside)))
    reach = float(np.clip(free - PULLED, LEVEL[0][0], LEVEL[0][-1]))
    pitch = float(np.interp(reach, *LEVEL))
    if upright:
        (pitch, reach), roll = UPRIGHT, 0.0
        end = float(half[2]) - END_GRIP
        rise = -min(BELOW_MIDDLE, max(0.0, end))
        if half[2] > LONG_BAR:
            rise = max(min(end, HIGHEST_GRIP - float(pose[2])), -end)
            pitch = END_PITCH if rise == end else pitch
    hand = arm.hand(pitch, roll)
    approach = hand[:, 2]
    width = 2.0 * float(min(half[0], half[2]))
    opening = min(1.0, (width + 2.0 * BESIDE_BAR) / OPENING)
    room = fixture.behind_handle(joint) - OFF_DOOR - _reaches_ahead(arm, hand, opening)
    deep = min(BEYOND_BAR, room / arm.ahead(approach))

    def at(before: float) -> Callable[[], Array]:
        return lambda: raised(fixture.handle(joint)[0][:3], rise) + (deep - before) * approach

    stand = arm.ahead(pose) - reach
    back = min(DRIVEN, max(0.0, free - reach))
    ready = at(READY)() - arm.onward(back)
    if arm.ahead(arm.base) > stand - back:  # beside a drawer that is open already
        yield from arm.drive(arm.floor_point(stand - back, arm.aside(arm.base)), speed=speed)
    yield from arm.drive(arm.floor_point(stand - back, aside), speed=speed)
    yield from arm.open_to(opening)
    yield from arm.move(ready, hand, tolerance=0.02, turn_tolerance=0.1, steps=160)
    yield from arm.drive(arm.floor_point(stand, aside))
    yield from arm.move(
        at(READY),
        hand,
        tolerance=0.006,
        turn_tolerance=0.08,
        speed=0.6,
        steps=80,
        exact=True,
        required=False,
    )
    yield from arm.move(at(0.0), hand, tolerance=0.012, speed=0.4, steps=60)
    yield from arm.move(at(0.0), hand, tolerance=0.003, speed=0.2, steps=20, required=False)
    yield from arm.grip(True)


def _reaches_ahead(arm: Arm, hand: Array, opening: float) -> float:
    """How far open fingers and palm reach ahead of the grip point, m."""
    travel, normal, approach = (arm.ahead(axis) for axis in hand.T)
    tip = abs(travel) * (opening * OPENING / 2.0 + FINGER_THICK) + abs(normal) * FINGER_SIDE
    palm = abs(travel) * HAND[0] + abs(normal) * HAND[1] - approach * PALM_FACE
    return max(tip + FINGERTIP * approach, palm)


def let_go(arm: Arm) -> Motion:
    """Open the fingers around a handle and draw the hand back from it."""
    yield from arm.grip(False, 6)
    away = arm.position - 0.10 * arm.rotation[:, 2]
    yield from arm.move(away, tolerance=0.03, steps=40, required=False)


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
    start, half = cabinet.handle(joint)
    side = math.copysign(1.0, arm.aside(np.asarray(joint.anchor)) - arm.aside(start))
    aside = arm.aside(start) + side * DOOR_ASIDE
    beside = side * (arm.aside(np.asarray(joint.anchor)) - aside)
    yield from take_handle(arm, cabinet, joint, aside - side * max(0.0, room - beside))
    yield from _pull_round(
        arm, cabinet, joint, side, DOOR_STOP if max(half) > LONG_BAR else math.inf
    )
    yield from let_go(arm)
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
