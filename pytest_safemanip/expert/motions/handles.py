"""Vessels with a handle that stands out to one side: pans, soup bowls with a lug.

The fingers close across the handle, so that the vessel's weight turns about the line between the
pads, which their friction holds: it grows with the handle's width, by 1 N for each millimetre.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pytest_safemanip.expert.motions.grasping import MOST_YAW, grasp_and_lift
from pytest_safemanip.expert.motions.putting import held_over, leave, set_down
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.robot.hand import Grasp, finger_angle, reach_at
from pytest_safemanip.expert.robot.rotations import Array, about_z, fold, upright
from pytest_safemanip.expert.world.hand_room import palm_has_room
from pytest_safemanip.expert.world.standing import STAND_OFFSETS, stand_before
from pytest_safemanip.expert.world.things import Furniture, Thing, other_things
from pytest_safemanip.trace.geometry import matrix

HANDLE_PITCH = 40.0
"""Degrees from straight down: the palm stays in front of the vessel's rim."""
OFF_WALL = 0.018
"""From a vessel's wall to the grip point on its handle, m: half a finger's width, and room."""
UNDER_RIM = 0.008
"""From the top of a lug to its middle, m."""
HANDLE_RISE = 0.06
CLEAR_OF_DOOR = 0.05
"""From a load to an open door in front of it, m, while it is carried past."""
STEADY = 0.5
"""Share of the top speed at which a load hardly swings on its handle."""
HANDLE_TUCKED = 0.50
"""Base to hand on the way, m."""
ASTRAY = 0.25
"""A hand that is this far to one side of the base is not reached out with, m."""
FOLDED_HEIGHT = 1.2
"""Height of the hand in front of the base, m: below wall cabinets, over what counters carry."""
HANDLE_OVER = 0.03
"""Free space below a load on the way in, m."""
LEAVE_BACK = 0.45
"""How far the base draws back, m: the hand comes out past the door."""


def handle(thing: Thing) -> tuple[Array, Array]:
    """Where a handle leaves its vessel, at the height of the rim, and its level direction (3,)."""
    out = (thing.centre - thing.middle) * (1.0, 1.0, 0.0)
    length = 2.0 * float(np.linalg.norm(out))
    way = out / np.linalg.norm(out)
    root = thing.middle + (thing.reach(way) - length / 2.0) * way
    return np.append(root[:2], thing.highest), way


def grasp_by_handle(arm: Arm, role: str) -> Motion:
    """Pinch a vessel's handle where it leaves the vessel, and lift it level.

    Raises:
        SkillFailed: if it was not lifted.
    """
    yield from grasp_handle(arm, role, HANDLE_PITCH)


def grasp_handle(
    arm: Arm, role: str, pitch: float, offsets: Sequence[float] = STAND_OFFSETS
) -> Motion:
    """Pinch a vessel's handle where it leaves the vessel, and lift it level.

    Args:
        arm: the arm.
        role: the vessel.
        pitch: of the hand, degrees; 0 where its fingers would not be level.
        offsets: how far beside the handle the base may stand to come closer, m.

    Raises:
        SkillFailed: if the palm has no room, or it was not lifted.
    """
    thing = Thing(arm, role)
    root, way = handle(thing)
    across = np.cross((0.0, 0.0, 1.0), way)
    yaw = fold(finger_angle(arm, across), 90.0)
    flat = abs(yaw) <= MOST_YAW
    pitch = pitch if flat else 0.0
    hand = arm.hand(pitch, yaw=yaw) if flat else arm.hand(0.0, fold(yaw, 120.0))
    point = root + OFF_WALL * way - np.array((0.0, 0.0, UNDER_RIM))
    grasp = Grasp(point, hand, 1.0)
    if not palm_has_room(arm, grasp, thing):
        raise SkillFailed("the palm has no room before the handle")
    yield from fold_in(arm)
    yield from stand_before(arm, point, reach_at(pitch), offsets=offsets)
    yield from grasp_and_lift(arm, thing, grasp, rise=HANDLE_RISE)


def fold_in(arm: Arm) -> Motion:
    """Bring an arm that a door has left on one side back in front of the base."""
    if abs(arm.aside(arm.position) - arm.aside(arm.base)) > ASTRAY:
        before = arm.before(HANDLE_TUCKED, FOLDED_HEIGHT)
        yield from arm.drive(arm.base - HANDLE_TUCKED * arm.forward)
        before[:2] -= HANDLE_TUCKED * arm.forward
        yield from arm.move(before, arm.hand(HANDLE_PITCH), tolerance=0.05, turn_tolerance=0.3)


def place_inside(arm: Arm, role: str, oven_role: str) -> Motion:
    """Put a held vessel into the middle of a fixture whose door is open, and draw back.

    Raises:
        SkillFailed: if the hand or the base does not get there.
    """
    oven = Furniture(arm, oven_role)
    middle = oven.interior()[0][:2]
    yield from put_in(arm, role, oven, np.append(middle, oven.opening()[1]))


def put_in(
    arm: Arm, role: str, oven: Furniture, spot: Array, tucked: float = HANDLE_TUCKED
) -> Motion:
    """Bring a held vessel in past an open door, its handle towards the robot, and set it down.

    Args:
        arm: the arm.
        role: the vessel.
        oven: what it goes into.
        spot: where its middle goes, at the height of what is below it (3,).
        tucked: base to hand before it, m.

    Raises:
        SkillFailed: if the hand or the base does not get there.
    """
    yield from bring_in(arm, Thing(arm, role), oven, spot, tucked)
    yield from set_down(arm, role)
    yield from leave(arm, LEAVE_BACK)


def bring_in(
    arm: Arm, thing: Thing, oven: Furniture, spot: Array, tucked: float = HANDLE_TUCKED
) -> Motion:
    """Bring a held vessel in past an open door, its handle towards the robot, to just above a
    spot (3,): where its middle goes, at the height of what is below it; ``tucked`` as above.
    """
    towards = np.append(-arm.forward, 0.0)
    far = thing.extent_ahead()[1] - arm.ahead(arm.base)
    back = min(oven.door_front() - CLEAR_OF_DOOR - far, arm.ahead(arm.base))
    yield from arm.drive(arm.floor_point(back, arm.aside(arm.base)), speed=STEADY)

    def before() -> Array:
        rise = arm.position[2] + spot[2] + HANDLE_OVER - thing.bottom
        return arm.before(tucked, rise)

    hand = level(arm, thing, towards)
    yield from arm.move(before, hand, tolerance=0.02, turn_tolerance=0.1, speed=STEADY, steps=160)
    aside = arm.aside(arm.base) + arm.aside(spot) - arm.aside(thing.middle)
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), aside), speed=STEADY, tolerance=0.01)
    hand = level(arm, thing, towards)
    yield from arm.move(before, hand, tolerance=0.015, speed=STEADY, steps=60)
    into = arm.ahead(arm.base) + arm.ahead(spot) - arm.ahead(thing.middle)
    yield from arm.drive(arm.floor_point(into, arm.aside(arm.base)), speed=STEADY)
    over = held_over(arm, thing, spot, float(spot[2]) + HANDLE_OVER / 2.0)
    yield from arm.move(
        over, hand, tolerance=0.004, speed=STEADY, steps=60, required=False, exact=True
    )


def lug_length(thing: Thing) -> float:
    """How far a vessel's lug stands out, m."""
    return 2.0 * float(np.linalg.norm((thing.centre - thing.middle)[:2]))


def level(arm: Arm, thing: Thing, out: Array) -> Array:
    """The hand orientation (3, 3) at which a held vessel is upright.

    Args:
        arm: the arm.
        thing: the vessel.
        out: where its handle is to point (3,).
    """
    tilt = upright(matrix(thing.pose[3:])[:, 2])
    way = tilt @ handle(thing)[1]
    heading = math.atan2(out[1], out[0]) - math.atan2(way[1], way[0])
    found: Array = about_z(math.degrees(heading)) @ tilt @ arm.rotation
    return found


TURN_STEP = 2.0
"""Turn in a control step, degrees: on a lug 10 cm from the middle the hand moves at 7 cm/s."""
TURN_SETTLES = 15
"""Control steps until the hand has come after."""
LET_GO_RISE = 0.12
"""How far the hand rises from the handle that it has let go, m."""
LET_GO_BACK = 0.25
"""How far the base draws back then, m."""
TURN_BACK_REACH = 0.48
"""Base to hand when it turns back, m: a stretched arm would come to the end of its elbow's way."""
BOTH_SIDES_REACH = 0.64
"""Base to the middle of a vessel that the hand reaches both sides of, m."""
DRAWN_ROOM = 0.02
"""Kept free between a vessel that is drawn nearer and what stands there, m."""


def turn_handle_near(arm: Arm, role: str) -> Motion:
    """Lift a vessel by its handle from straight above, turn it about its middle until the handle
    points to the robot, draw it nearer if it is far, and set it down; nothing if it nearly does.

    Raises:
        SkillFailed: if it was not lifted.
    """
    thing = Thing(arm, role)
    if abs(_to_robot(arm, thing)) <= MOST_YAW:
        return
    yield from grasp_handle(arm, role, 0.0)
    total = _to_robot(arm, thing)
    if total < -120.0:
        # The last joint of the wrist has its room to this side.
        total += 360.0
    yield from _turn_about(arm, thing.middle, total)
    nearer = arm.position - _too_far(arm, thing) * np.append(arm.forward, 0.0)
    yield from arm.move(nearer, speed=0.3, steps=40, required=False)
    yield from set_down(arm, role)
    yield from arm.move(raised(arm.position, LET_GO_RISE), tolerance=0.03, speed=0.5, steps=60)
    yield from arm.drive(arm.base - LET_GO_BACK * arm.forward)
    drawn = arm.before(TURN_BACK_REACH, arm.position[2])
    yield from arm.move(drawn, tolerance=0.03, speed=0.5, steps=60, required=False)
    yield from _turn_about(arm, arm.position, -total)


def _turn_about(arm: Arm, middle: Array, total: float) -> Motion:
    """Turn the hand about a vertical line through a point (3,), by degrees to the left."""
    off, hand = arm.position - middle, arm.rotation
    angles = np.linspace(0.0, total, round(abs(total) / TURN_STEP)).tolist()
    for angle in (*angles, *[total] * TURN_SETTLES):
        turned = about_z(angle)
        there = middle + turned @ off
        yield from arm.move(there, turned @ hand, steps=1, until=lambda: False, required=False)


def _too_far(arm: Arm, thing: Thing) -> float:
    """How much nearer to the base a vessel should stand, m; not at all if something is there."""
    far = arm.ahead(thing.middle) - arm.ahead(arm.base) - BOTH_SIDES_REACH
    for other in other_things(arm, thing):
        beside = abs(arm.aside(other.middle) - arm.aside(thing.middle))
        between = arm.ahead(arm.base) < arm.ahead(other.middle) < arm.ahead(thing.middle)
        width = (other.sides()[1][1] + thing.sides()[1][1]) / 2.0 + DRAWN_ROOM
        if between and beside < width:
            return 0.0
    return max(0.0, far)


def _to_robot(arm: Arm, thing: Thing) -> float:
    """Turn about the vertical after which a handle points to the robot, degrees in [-180, 180)."""
    return (360.0 - arm.bearing(handle(thing)[1])) % 360.0 - 180.0
