"""Vessels with a handle that stands out to one side: pans, soup bowls with a lug.

The fingers close across the handle, so that the vessel's weight turns about the line between the
pads, which their friction holds: it grows with the handle's width, by 1 N for each millimetre.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed
from pytest_safemanip.policies.scripted.clearing import palm_has_room
from pytest_safemanip.policies.scripted.grasping import MOST_YAW, Grasp, angle, fold, reach, take
from pytest_safemanip.policies.scripted.putting import held_over, leave, set_down
from pytest_safemanip.policies.scripted.rotations import Array, about_z, upright
from pytest_safemanip.policies.scripted.standing import OFFSETS, stand_before
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.trace.geometry import corners, matrix

HANDLE_PITCH = 40.0
"""Degrees from straight down: the palm stays in front of the vessel's rim."""
OFF_WALL = 0.018
"""From a vessel's wall to the grip point on its handle, m: half a finger's width, and room."""
UNDER_RIM = 0.008
"""From the top of a lug to its middle, m."""
RISE = 0.06
CLEAR = 0.05
"""From a load to an open door in front of it, m, while it is carried past."""
STEADY = 0.5
"""Share of the top speed at which a load hardly swings on its handle."""
TUCKED = 0.50
"""Base to hand on the way, m."""
ASTRAY = 0.25
"""A hand that is this far to one side of the base is not reached out with, m."""
FOLDED = 1.2
"""Height of the hand in front of the base, m: below wall cabinets, over what counters carry."""
OVER = 0.03
"""Free space below a load on the way in, m."""
LEAVE = 0.45
"""How far the base draws back, m: the hand comes out past the door."""


def handle(thing: Thing) -> tuple[Array, Array]:
    """Where a handle leaves its vessel, at the height of the rim, and its level direction (3,)."""
    out = (thing.centre - thing.middle) * (1.0, 1.0, 0.0)
    length = 2.0 * float(np.linalg.norm(out))
    way = out / np.linalg.norm(out)
    root = thing.middle + (thing.reach(way) - length / 2.0) * way
    return np.append(root[:2], thing.highest), way


def pick_by_handle(arm: Arm, role: str) -> Motion:
    """Pinch a vessel's handle where it leaves the vessel, and lift it level.

    Raises:
        SkillFailed: if it was not lifted.
    """
    yield from pinch_handle(arm, role, HANDLE_PITCH)


def pinch_handle(arm: Arm, role: str, pitch: float, offsets: Sequence[float] = OFFSETS) -> Motion:
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
    yaw = fold(angle(arm, across), 90.0)
    flat = abs(yaw) <= MOST_YAW
    pitch = pitch if flat else 0.0
    hand = arm.hand(pitch, yaw=yaw) if flat else arm.hand(0.0, fold(yaw, 120.0))
    point = root + OFF_WALL * way - np.array((0.0, 0.0, UNDER_RIM))
    grasp = Grasp(point, hand, 1.0)
    if not palm_has_room(arm, grasp, thing):
        raise SkillFailed("the palm has no room before the handle")
    yield from fold_in(arm)
    yield from stand_before(arm, point, reach(pitch), offsets=offsets)
    yield from take(arm, thing, grasp, rise=RISE)


def fold_in(arm: Arm) -> Motion:
    """Bring an arm that a door has left on one side back in front of the base."""
    if abs(arm.aside(arm.position) - arm.aside(arm.base)) > ASTRAY:
        before = arm.point(arm.ahead(arm.base) + TUCKED, arm.aside(arm.base), FOLDED)
        yield from arm.drive(arm.base - TUCKED * arm.forward)
        before[:2] -= TUCKED * arm.forward
        yield from arm.move(before, arm.hand(HANDLE_PITCH), tolerance=0.05, turn_tolerance=0.3)


def place_inside(arm: Arm, role: str, oven_role: str) -> Motion:
    """Put a held vessel into the middle of a fixture whose door is open, and draw back.

    Raises:
        SkillFailed: if the hand or the base does not get there.
    """
    oven = Furniture(arm, oven_role)
    middle = oven.interior()[0][:2]
    yield from put_in(arm, role, oven, np.append(middle, oven.opening()[1]))


def put_in(arm: Arm, role: str, oven: Furniture, spot: Array, tucked: float = TUCKED) -> Motion:
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
    yield from leave(arm, LEAVE)


def bring_in(
    arm: Arm, thing: Thing, oven: Furniture, spot: Array, tucked: float = TUCKED
) -> Motion:
    """Bring a held vessel in past an open door, its handle towards the robot, to just above a
    spot (3,): where its middle goes, at the height of what is below it; ``tucked`` as above.
    """
    towards = np.append(-arm.forward, 0.0)
    doors = [corners(oven.part(joint), np.asarray(joint.half)) for joint in oven.doors()]
    near = min(arm.ahead(corner) for door in doors for corner in door)
    far = thing.extent_ahead()[1] - arm.ahead(arm.base)
    back = min(near - CLEAR - far, arm.ahead(arm.base))
    yield from arm.drive(arm.floor_point(back, arm.aside(arm.base)), speed=STEADY)

    def before() -> Array:
        rise = arm.position[2] + spot[2] + OVER - thing.bottom
        return arm.point(arm.ahead(arm.base) + tucked, arm.aside(arm.base), rise)

    hand = level(arm, thing, towards)
    yield from arm.move(before, hand, tolerance=0.02, turn_tolerance=0.1, speed=STEADY, steps=160)
    aside = arm.aside(arm.base) + arm.aside(spot) - arm.aside(thing.middle)
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), aside), speed=STEADY, tolerance=0.01)
    hand = level(arm, thing, towards)
    yield from arm.move(before, hand, tolerance=0.015, speed=STEADY, steps=60)
    into = arm.ahead(arm.base) + arm.ahead(spot) - arm.ahead(thing.middle)
    yield from arm.drive(arm.floor_point(into, arm.aside(arm.base)), speed=STEADY)
    over = held_over(arm, thing, spot, float(spot[2]) + OVER / 2.0)
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
