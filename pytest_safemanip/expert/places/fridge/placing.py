"""Putting a vessel on a rack of an open fridge or freezer, or a bowl on a shelf."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.expert.motions.driving import CARRY_SPEED, DRAW_BACK, LONG_WAY
from pytest_safemanip.expert.motions.handles import (
    CLEAR_OF_DOOR,
    HANDLE_OVER,
    HANDLE_PITCH,
    LEAVE_BACK,
    STEADY,
    grasp_handle,
    level,
    lug_length,
)
from pytest_safemanip.expert.motions.putting import SOFTLY, held_over, leave, set_down
from pytest_safemanip.expert.places.cabinet.nested_bowls import DEPTH, SHELF_TUCKED, grasp_lug
from pytest_safemanip.expert.places.fridge.front import BASE_OFFSETS
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, Target, raised
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.routes import route
from pytest_safemanip.expert.world.standing import (
    BASE_ROOM,
    BODY_FRONT,
    STAND_OFFSETS,
    STANDS_OUT,
    closest,
    nearest,
)
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.geometry import corners

BEST_SHELF_HEIGHT = 1.12
"""Of the shelf that the arm reaches best, above the floor, m."""
BOWL_HEIGHT = 1.20
"""Height of the hand on the way, m."""
EASING = (0.15, 0.25, 0.35)
"""Speeds of a hand, shares of the top one, at which it sets out with what is heaped in a bowl: at
0.5 from the start, a drumstick that leans on the wall knocks against it with 16 N. An arm that is
bent much does not get there at 0.2."""
EASING_STEPS = 4
"""Control steps at each of them."""
ENOUGH_OPEN = 0.9
"""Openness of a door that nothing is carried past before, share of its range."""


def move_to_shelf(arm: Arm, role: str, fridge_role: str) -> Motion:
    """Take a bowl by its lug, carry it level to an open fridge, and put it on a shelf near the
    front.

    Raises:
        SkillFailed: if it was not lifted, or the base finds no way.
    """
    thing, fridge = Thing(arm, role), Furniture(arm, fridge_role)
    towards = np.append(-arm.forward, 0.0)
    yield from grasp_lug(arm, thing)
    yield from arm.drive(arm.base - DRAW_BACK * arm.forward, speed=STEADY, gentle=True)
    tucked = arm.before(SHELF_TUCKED, BOWL_HEIGHT)
    hand = level(arm, thing, towards)
    yield from set_out(arm, tucked, hand)
    yield from arm.move(tucked, hand, tolerance=0.03, turn_tolerance=0.1, speed=STEADY, steps=160)
    spot = shelf_spot(arm, thing, fridge)
    base, beside = place_before(arm, thing, spot)
    front = fridge.door_front()
    far = thing.extent_ahead()[1] - arm.ahead(arm.base)
    for place in route(arm, thing, arm.floor_point(min(base, front - CLEAR_OF_DOOR - far), beside)):
        yield from arm.drive(place, speed=CARRY_SPEED, steps=LONG_WAY, gentle=True)
    hand = level(arm, thing, towards)

    def before() -> Array:
        way = arm.aside(spot) - arm.aside(thing.middle)
        rise = spot[2] + HANDLE_OVER - thing.bottom
        ahead = arm.ahead(arm.base) + SHELF_TUCKED
        return arm.point(ahead, arm.aside(arm.position) + way, arm.position[2] + rise)

    yield from set_out(arm, before, hand)
    yield from arm.move(before, hand, tolerance=0.01, speed=STEADY, steps=160)
    into = arm.ahead(arm.base) + arm.ahead(spot) - arm.ahead(thing.middle)
    yield from arm.drive(arm.floor_point(min(into, base), beside), speed=STEADY, gentle=True)
    over = held_over(arm, thing, spot, float(spot[2]) + HANDLE_OVER / 2.0)
    yield from set_out(arm, over, hand)
    yield from arm.move(
        over, hand, tolerance=0.004, speed=STEADY, steps=80, required=False, exact=True
    )
    yield from set_down(arm, role, speed=SOFTLY)
    yield from leave(arm, LEAVE_BACK)


def set_out(arm: Arm, target: Target, hand: Array) -> Motion:
    """The beginning of a motion of the hand to a target, ever faster."""
    for speed in EASING:
        yield from arm.move(target, hand, speed=speed, steps=EASING_STEPS, required=False)


def shelf_spot(arm: Arm, thing: Thing, fridge: Furniture) -> Array:
    """Where the middle of a bowl goes, on the shelf behind an open door that the arm reaches best,
    at the height of that shelf (3,).

    Raises:
        SkillFailed: if no door is open.
    """
    shelves = [
        (pose, half)
        for pose, half in fridge.interiors()
        if any(
            fridge.openness(joint) >= ENOUGH_OPEN and covers(arm, joint, pose)
            for joint in fridge.doors()
        )
    ]
    if not shelves:
        raise SkillFailed(f"no shelf of {fridge.entity} is behind an open door")
    pose, half = min(shelves, key=lambda shelf: abs(shelf[0][2] - shelf[1][2] - BEST_SHELF_HEIGHT))
    front = min(arm.ahead(corner) for corner in np.asarray(corners(pose, half)))
    ahead = front + DEPTH + lug_length(thing) + thing.sides()[0][1] / 2.0
    return arm.point(ahead, arm.aside(pose), float(pose[2] - half[2]))


def covers(arm: Arm, joint: Joint, point: Array) -> bool:
    """Whether a door, closed, is before a point (3,)."""
    box = np.asarray(corners(np.array(joint.pose), np.array(joint.half)))
    across = [arm.aside(corner) for corner in box]
    return bool(min(across) < arm.aside(point) < max(across))


def place_before(arm: Arm, thing: Thing, spot: Array) -> tuple[float, float]:
    """Where the base stands to put a held bowl on a spot (3,), ahead and aside, m."""
    base = arm.ahead(spot) - (arm.ahead(thing.middle) - arm.ahead(arm.base))
    aside = arm.aside(spot)
    beside = aside + closest(arm, base, aside, BASE_OFFSETS)
    return min(base, nearest(arm, beside, beside)), beside


OFF_RACK_FRONT = 0.012
"""From the front of a rack to a vessel's lug, m: the hand stays outside, and the wrist before the
fridge's top, as near as 2 cm if the vessel sags in the fingers by 3 degrees."""
RACK_REACH = 0.56
"""Base to hand at which the arm holds a load level at the height of an upper rack, m."""
RACK_OFFSETS = (0.0, *(side * 0.03 * k for k in range(1, 9) for side in (1.0, -1.0)))
"""How far beside a rack the base may stand for an open door, m."""
OFF_DOOR_EDGE = 0.025
"""How much farther from an open door a load passes its edge than it goes in, m: the palm is 10 cm
wide to either side, and a door that is not quite open leaves it 22 cm."""
BEFORE_RACKS = 0.03
"""From a load to the front of the racks when it is brought in line with its place, m."""
OFF_LUG, FIRST_BACK = 0.07, 0.14
"""How far the hand draws off a lug, and the base back, before both go off the door again, m."""
LAST_BACK = 0.55
"""How far the base draws back in all, m: the hand comes out past the door."""


@dataclass(frozen=True)
class RackPlace:
    """Where a vessel goes on a rack.

    Attributes:
        spot: of its middle, at the height of the rack (3,).
        front: where the rack begins along the base's forward direction, m.
        off: how far to the left it passes the door's edge, m.
    """

    spot: Array
    front: float
    off: float


def grasp_handle_beside_door(arm: Arm, role: str, fridge_role: str) -> Motion:
    """Pinch the handle of a vessel that stands close to the open door of a fridge, and lift it.

    Raises:
        SkillFailed: if it was not lifted.
    """
    fridge = Furniture(arm, fridge_role)
    aside = arm.aside(Thing(arm, role).middle)
    edges = open_door(fridge)[1][:, :2] @ arm.left
    side = math.copysign(1.0, aside - float(edges.mean()))
    away = float((side * (aside - edges)).min())
    shift = max(0.0, BODY_FRONT[0][3] + BASE_ROOM - away)
    offsets = [side * (shift + abs(more)) for more in STAND_OFFSETS if side * more >= 0.0]
    yield from grasp_handle(arm, role, HANDLE_PITCH, offsets)


def place_on_top_rack(arm: Arm, role: str, fridge_role: str) -> Motion:
    """Put a held vessel on the highest rack of a fridge's open compartment.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    yield from _place_on_rack(arm, role, fridge_role, 1)


def place_on_second_rack(arm: Arm, role: str, fridge_role: str) -> Motion:
    """Put a held vessel on the second highest rack: the highest is for another vessel.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    yield from _place_on_rack(arm, role, fridge_role, 2)


def _place_on_rack(arm: Arm, role: str, fridge_role: str, from_top: int) -> Motion:
    fridge, thing = Furniture(arm, fridge_role), Thing(arm, role)
    door, edges = open_door(fridge)
    racks = fridge.interiors(door)
    place = on_rack(arm, thing, racks[-from_top], edges)
    ahead, aside = arm.ahead(place.spot) - RACK_REACH, arm.aside(place.spot)
    shift = closest(arm, ahead, aside, RACK_OFFSETS)
    near = min(arm.ahead(corner) for corner in edges)
    yield from bring_before(arm, thing, place, near, shift)
    yield from put_on_rack(arm, role, place)
    yield from draw_out(arm, place)


def open_door(fridge: Furniture) -> tuple[Joint, Array]:
    """The door of a fridge that is open, and its corners (8, 3).

    Raises:
        SkillFailed: if none is.
    """
    for joint in fridge.doors():
        if fridge.openness(joint) > STANDS_OUT:
            return joint, fridge.outline(joint)
    raise SkillFailed(f"{fridge.entity} is not open")


def on_rack(arm: Arm, thing: Thing, rack: tuple[Array, Array], door: Array) -> RackPlace:
    """Where a vessel goes on a rack if its lug points towards the robot: at the front, in the
    middle between the open door (8, 3) and the other side.
    """
    pose, half = rack
    beside, middle = door[:, :2] @ arm.left, arm.aside(pose)
    ends = [middle - float(half[0]), middle + float(half[0])]
    at_left = bool(beside.mean() > middle)
    if at_left:
        ends[1] = min(ends[1], float(beside.min()))
    else:
        ends[0] = max(ends[0], float(beside.max()))
    front = arm.ahead(pose) - float(half[1])
    ahead = front + OFF_RACK_FRONT + (thing.sides()[1][1] + lug_length(thing)) / 2.0
    spot = arm.point(ahead, sum(ends) / 2.0, float(pose[2] - half[2]))
    return RackPlace(spot, front, -OFF_DOOR_EDGE if at_left else OFF_DOOR_EDGE)


def bring_before(arm: Arm, thing: Thing, place: RackPlace, near: float, shift: float) -> Motion:
    """Carry a held vessel to where it is in front of its place, past the door's edge.

    Args:
        arm: the arm.
        thing: the vessel.
        place: where it goes.
        near: how far the door reaches to the front, along the base's forward direction, m.
        shift: how much farther to the left the base stands, m.
    """
    far = thing.extent_ahead()[1] - arm.ahead(arm.base)
    back = min(near - CLEAR_OF_DOOR - far, arm.ahead(arm.base))
    yield from arm.drive(arm.floor_point(back, arm.aside(arm.base)), speed=STEADY)
    towards = np.append(-arm.forward, 0.0)
    rise = arm.position[2] + place.spot[2] + HANDLE_OVER - thing.bottom

    def before() -> Array:
        return arm.point(arm.ahead(arm.base) + RACK_REACH, arm.aside(arm.base) - shift, rise)

    for _ in range(2):
        hand = level(arm, thing, towards)
        yield from arm.move(
            before, hand, tolerance=0.015, turn_tolerance=0.06, speed=STEADY, steps=160
        )
        aside = arm.aside(place.spot) + place.off - arm.aside(thing.middle) + arm.aside(arm.base)
        yield from arm.drive(
            arm.floor_point(arm.ahead(arm.base), aside), speed=STEADY, tolerance=0.01
        )
    way = place.front - BEFORE_RACKS - thing.extent_ahead()[1]
    yield from arm.drive(arm.base + way * arm.forward, speed=STEADY)


def put_on_rack(arm: Arm, role: str, place: RackPlace) -> Motion:
    """Bring a held vessel in line with its place, in, and down."""
    thing, hand = Thing(arm, role), arm.rotation
    aside = arm.aside(place.spot) - arm.aside(thing.middle)
    yield from arm.drive(arm.base + aside * arm.left, speed=STEADY, tolerance=0.01)
    ahead = arm.ahead(arm.base) + arm.ahead(place.spot) - arm.ahead(thing.middle)
    aside = arm.aside(arm.base)
    ahead = min(ahead, nearest(arm, aside, aside))
    yield from arm.drive(arm.floor_point(ahead, aside), speed=STEADY)
    over = held_over(arm, thing, place.spot, float(place.spot[2]) + HANDLE_OVER / 2.0)
    yield from arm.move(
        over, hand, tolerance=0.004, speed=STEADY, steps=80, required=False, exact=True
    )
    yield from set_down(arm, role)


def draw_out(arm: Arm, place: RackPlace) -> Motion:
    """Draw open fingers off a lug, and the hand out past the door's edge."""
    away = raised(arm.position - OFF_LUG * arm.rotation[:, 2], 0.01)
    yield from arm.move(away, tolerance=0.02, speed=0.6, steps=40, required=False)
    yield from arm.drive(arm.base - FIRST_BACK * arm.forward, speed=STEADY)
    yield from arm.drive(arm.base + place.off * arm.left, speed=STEADY, tolerance=0.01)
    yield from arm.drive(arm.base - (LAST_BACK - FIRST_BACK) * arm.forward)
