"""Putting down what is held: onto a plate or a board, into a pan or a bowl, on a free spot; laying
it down flat with a hand that is tipped over.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion, raised
from pytest_safemanip.expert.robot.hand import reach_at
from pytest_safemanip.expert.robot.rotations import Array, about_z
from pytest_safemanip.expert.world.contacts import carried_by_something, palm_meets, under_palm
from pytest_safemanip.expert.world.free_spots import free_spot
from pytest_safemanip.expert.world.hand_room import rise_over_front
from pytest_safemanip.expert.world.rims import overhung, rim_shift
from pytest_safemanip.expert.world.standing import (
    elbow_room,
    offsets_bent,
    stand_before,
    wrist_room,
)
from pytest_safemanip.expert.world.things import Thing, other_things

CARRIED_OVER = 0.03
"""Free space below a load while it is carried over things, m."""
OVERHEAD = 0.2
"""What is this far above a load, m, stands in a cabinet over it: nothing is carried over that."""
LEAST_TIP, LEAST_YAW = math.sin(math.radians(25.0)), 10.0
"""What a hand is tipped at least, as a sine, and turned at least, degrees, for its wrist to be more
than 2 cm beside it."""
DRAWN_BACK = 0.15
"""How far a load is drawn back before it is turned, m: off what stands around it."""
SOFTLY = 0.05
"""Speed at which something stiff that hangs askew by 10 degrees touches down with less than the
80 N that break it: in a pan 63 N, at 0.07 it was 76 N."""
BRAKE = 0.02
"""How much higher the hand comes to rest before it sets something down, m: it comes at 0.15 m/s."""
LOWERING = 60
"""Control steps in which a load is lowered by 12 cm at the usual speed."""
USUAL = 0.12
"""Share of the hand's top speed at which things are lowered, where they need no more care."""


def place_on(arm: Arm, role: str, target_role: str) -> Motion:
    """Put a held object onto the middle of another one, or into it; beside the middle if something
    is there.
    """
    target = Thing(arm, target_role)
    if overhung(arm, target.middle):
        yield from straighten(arm)
    spot = free_spot(arm, role, target) + rim_shift(arm, Thing(arm, role), target)
    yield from put_onto(arm, role, target, spot, wrist_room(arm, elbow_room(arm, spot)))


def straighten(arm: Arm, speed: float = 0.7) -> Motion:
    """Draw a load back and turn it until the hand points straight ahead: turned, the wrist is
    beside the hand and hits what stands there.

    Args:
        arm: the arm.
        speed: largest command to the base.
    """
    approach = arm.rotation[:, 2]
    yaw = arm.bearing(approach)
    if np.linalg.norm(approach[:2]) < LEAST_TIP or abs(yaw) < LEAST_YAW:
        return
    yield from arm.drive(arm.base - DRAWN_BACK * arm.forward, speed=speed)
    yield from arm.move(arm.position, about_z(-yaw) @ arm.rotation, tolerance=0.03, speed=0.6)


def put_onto(arm: Arm, role: str, target: Thing, spot: Array, shift: float = 0.0) -> Motion:
    """Put a held object down on a spot (3,) of another one, the base farther to the left."""
    yield from bring_onto(arm, role, target, spot, shift)
    yield from leave(arm)


def bring_onto(
    arm: Arm, role: str, target: Thing, spot: Array, shift: float = 0.0, speed: float = 0.7
) -> Motion:
    """Likewise, but the hand stays where it lets go; with a largest command to the base."""
    yield from carry_over(arm, role, spot, target.highest + BRAKE, shift, speed)
    yield from arm.move(
        arm.position, tolerance=BRAKE, turn_tolerance=0.3, steps=20, required=False, exact=True
    )
    yield from set_down(arm, role, speed=SOFTLY)


def carry_over(
    arm: Arm, role: str, where: Array, top: float, shift: float = 0.0, speed: float = 0.7
) -> Motion:
    """Bring a held object above a point, over everything between.

    Args:
        arm: the arm.
        role: the object.
        where: the point (3,); only its horizontal part counts.
        top: height of what is highest there, m.
        shift: how much farther to the left the base is to stand, m.
        speed: largest command to the base.
    """
    thing, hand = Thing(arm, role), arm.rotation
    yield from carry_before(arm, role, where, top, speed, shift)
    if shift:
        # What stands beside the spot is not crossed on the way down.
        beside = arm.floor_point(0.0, arm.aside(where) - arm.aside(thing.middle))
        front = arm.position + np.append(beside, 0.0)
        yield from arm.move(front, hand, tolerance=0.02, turn_tolerance=0.2, speed=0.6)
    above = held_over(arm, thing, where, top + CARRIED_OVER / 2)
    yield from arm.move(above, hand, tolerance=0.015, turn_tolerance=0.2, speed=0.6, steps=120)


def held_over(arm: Arm, thing: Thing, spot: Array, bottom: float) -> Callable[[], Array]:
    """Where the hand is when a held object's middle is over a spot (3,) and its underside at a
    height, m; looked up anew each time, for the object may move in the fingers.
    """

    def there() -> Array:
        way = spot - thing.middle
        way[2] = bottom - thing.bottom
        return np.add(arm.position, way)

    return there


def carry_before(
    arm: Arm, role: str, where: Array, top: float, speed: float = 0.7, shift: float = 0.0
) -> Motion:
    """Raise a held object over everything between, and drive to where the hand reaches a point.

    Args:
        arm: the arm.
        role: the object.
        where: the point (3,); only its horizontal part counts.
        top: height of what is highest there, m.
        speed: largest command to the base.
        shift: how much farther to the left the base is to stand, m.
    """
    thing = Thing(arm, role)
    hand, distance = arm.rotation, reach_at(arm.pitch)
    clear = max(top, _highest_between(arm, thing, where, shift)) + CARRIED_OVER - thing.bottom
    if clear > 0.0:
        yield from arm.move(
            raised(arm.position, clear), hand, tolerance=0.02, turn_tolerance=0.2, speed=0.6
        )
    offsets = offsets_bent(arm, shift)
    shift += arm.aside(arm.base) - arm.aside(thing.middle)
    yield from stand_before(arm, where, distance, shift, speed, offsets)


def set_down(arm: Arm, role: str, depth: float = 0.15, speed: float = USUAL) -> Motion:
    """Lower a held object until it stands on something, and let go.

    Args:
        arm: the arm.
        role: the object.
        depth: how far down at most, m.
        speed: share of the hand's top speed.
    """
    yield from set_upon(arm, role, depth, speed)
    yield from arm.grip(False)


def set_upon(arm: Arm, role: str, depth: float = 0.15, speed: float = USUAL) -> Motion:
    """Lower a held object until it stands on something, and go on holding it."""
    thing = Thing(arm, role)
    yield from arm.move(
        raised(arm.position, -depth),
        arm.rotation,
        speed=speed,
        steps=round(LOWERING * max(1.0, USUAL / speed)),
        until=lambda: carried_by_something(arm, thing) or palm_meets(arm, thing),
        required=False,
    )


def leave(arm: Arm, back: float = 0.28) -> Motion:
    """Draw the hand back, and the base: little upwards, there may be something above, and over
    what stands in front only where nothing is.

    Args:
        arm: the arm.
        back: how far the base draws back, m.
    """
    away = raised(arm.position - 0.07 * arm.rotation[:, 2], 0.01)
    yield from arm.move(away, tolerance=0.03, speed=0.6, steps=40, required=False)
    rise = rise_over_front(arm, back)
    if rise:
        yield from arm.move(raised(arm.position, rise), tolerance=0.01, speed=0.6, required=False)
    yield from arm.drive(arm.base - back * arm.forward)


def _highest_between(arm: Arm, thing: Thing, where: Array, shift: float) -> float:
    """Top of what stands between a held object and where it goes, or so far beside that, m."""
    side = 0.5 * float(np.ptp([arm.aside(corner) for corner in thing.corners])) + 0.03
    ends = sorted((arm.aside(thing.middle), arm.aside(where), arm.aside(where) + shift))
    tops = [0.0]
    for other in other_things(arm, thing):
        if other.bottom > thing.highest + OVERHEAD:
            continue
        along = [arm.aside(corner) for corner in other.corners]
        if min(along) < ends[-1] + side and max(along) > ends[0] - side:
            tops.append(other.highest)
    return max(tops)


LAY_PITCH = 55.0
"""As far as the hand tips at the height of a counter, degrees from straight down."""
LAID_BEYOND = 0.035
"""How far beyond the middle a slice is laid down, m: the lower finger, on which it comes to lie,
draws it back by 3 to 9 cm."""
TIPPED_SPEED = 0.05
"""Share of the top speed for it: at 0.08, a palm meets a plate with 35 N, and 80 N may break it."""
PALM_RESTS = 0.006
"""How far a palm that rests on something is raised before the fingers open, m: it is not level."""


def lay_on(arm: Arm, role: str, target_role: str) -> Motion:
    """Lay a held slice flat onto another object: tip it over, away from the robot, and let go."""
    target = Thing(arm, target_role)
    spot = free_spot(arm, role, target) + arm.onward(LAID_BEYOND)
    yield from tip_over(arm, LAY_PITCH)
    yield from carry_over(arm, role, spot, target.highest)
    yield from lower_tipped(arm, role)
    yield from arm.grip(False)
    yield from leave(arm)


def tip_over(arm: Arm, pitch: float, yaw: float = 0.0) -> Motion:
    """Draw a held object back and tip it over, away from the robot, to so many degrees, turned by
    so many about the vertical.
    """
    away = arm.position + np.append(-0.10 * arm.forward, 0.02)
    yield from arm.move(away, tolerance=0.03, speed=0.5, steps=40)
    yield from arm.move(
        arm.position, arm.hand(pitch, 90.0, yaw), tolerance=0.04, turn_tolerance=0.1, steps=80
    )


def lower_tipped(arm: Arm, role: str) -> Motion:
    """Lower an object in a hand that is tipped over, whose palm may come to rest before it does."""
    yield from set_upon(arm, role, speed=TIPPED_SPEED)
    if (under_palm(arm) - {Thing(arm, role).entity}) & set(arm.scene.object_index):
        off = raised(arm.position, PALM_RESTS)
        yield from arm.move(off, arm.rotation, tolerance=0.002, speed=0.2, steps=8, required=False)
