"""Putting a vessel with a lug on a rack of an open fridge or freezer, beside its door."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.policies.scripted.handles import (
    CLEAR,
    HANDLE_PITCH,
    OVER,
    STEADY,
    level,
    lug_length,
    pinch_handle,
)
from pytest_safemanip.policies.scripted.putting import held_over, set_down
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.standing import (
    OFFSETS,
    OPEN,
    PROFILE,
    ROOM,
    closest,
    nearest,
)
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.geometry import corners

FRONT = 0.012
"""From the front of a rack to a vessel's lug, m: the hand stays outside, and the wrist before the
fridge's top, as near as 2 cm if the vessel sags in the fingers by 3 degrees."""
REACH = 0.56
"""Base to hand at which the arm holds a load level at the height of an upper rack, m."""
BESIDE = (0.0, *(side * 0.03 * k for k in range(1, 9) for side in (1.0, -1.0)))
"""How far beside a rack the base may stand for an open door, m."""
OFF_DOOR = 0.025
"""How much farther from an open door a load passes its edge than it goes in, m: the palm is 10 cm
wide to either side, and a door that is not quite open leaves it 22 cm."""
BEFORE = 0.03
"""From a load to the front of the racks when it is brought in line with its place, m."""
DRAWN, OUT = 0.07, 0.14
"""How far the hand draws off a lug, and the base back, before both go off the door again, m."""
AWAY = 0.55
"""How far the base draws back in all, m: the hand comes out past the door."""


@dataclass(frozen=True)
class Place:
    """Where a vessel goes on a rack.

    Attributes:
        spot: of its middle, at the height of the rack (3,).
        front: where the rack begins along the base's forward direction, m.
        off: how far to the left it passes the door's edge, m.
    """

    spot: Array
    front: float
    off: float


def pick_beside_door(arm: Arm, role: str, fridge_role: str) -> Motion:
    """Pinch the handle of a vessel that stands close to the open door of a fridge, and lift it.

    Raises:
        SkillFailed: if it was not lifted.
    """
    fridge = Furniture(arm, fridge_role)
    aside = arm.aside(Thing(arm, role).middle)
    edges = open_door(fridge)[1][:, :2] @ arm.left
    side = math.copysign(1.0, aside - float(edges.mean()))
    away = float((side * (aside - edges)).min())
    shift = max(0.0, PROFILE[0][3] + ROOM - away)
    offsets = [side * (shift + abs(more)) for more in OFFSETS if side * more >= 0.0]
    yield from pinch_handle(arm, role, HANDLE_PITCH, offsets)


def shelve_in(arm: Arm, role: str, fridge_role: str) -> Motion:
    """Put a held vessel on the highest rack of a fridge's open compartment.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    yield from _shelve(arm, role, fridge_role, 1)


def shelve_in_under(arm: Arm, role: str, fridge_role: str, other_role: str) -> Motion:
    """Put a held vessel on the second highest rack: the highest is for another vessel.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    del other_role
    yield from _shelve(arm, role, fridge_role, 2)


def _shelve(arm: Arm, role: str, fridge_role: str, from_top: int) -> Motion:
    fridge, thing = Furniture(arm, fridge_role), Thing(arm, role)
    door, edges = open_door(fridge)
    racks = fridge.interiors(f"{door.name.split('_')[0]}_shelf")
    place = on_rack(arm, thing, racks[-from_top], edges)
    ahead, aside = arm.ahead(place.spot) - REACH, arm.aside(place.spot)
    shift = closest(arm, ahead, aside, BESIDE)
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
        if fridge.openness(joint) > OPEN:
            points = corners(fridge.part(joint), np.asarray(joint.half))
            return joint, np.asarray(points, np.float64)
    raise SkillFailed(f"{fridge.entity} is not open")


def on_rack(arm: Arm, thing: Thing, rack: tuple[Array, Array], door: Array) -> Place:
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
    ahead = front + FRONT + (thing.sides()[1][1] + lug_length(thing)) / 2.0
    spot = arm.point(ahead, sum(ends) / 2.0, float(pose[2] - half[2]))
    return Place(spot, front, -OFF_DOOR if at_left else OFF_DOOR)


def bring_before(arm: Arm, thing: Thing, place: Place, near: float, shift: float) -> Motion:
    """Carry a held vessel to where it is in front of its place, past the door's edge.

    Args:
        arm: the arm.
        thing: the vessel.
        place: where it goes.
        near: how far the door reaches to the front, along the base's forward direction, m.
        shift: how much farther to the left the base stands, m.
    """
    far = thing.extent_ahead()[1] - arm.ahead(arm.base)
    back = min(near - CLEAR - far, arm.ahead(arm.base))
    yield from arm.drive(arm.floor_point(back, arm.aside(arm.base)), speed=STEADY)
    towards = np.append(-arm.forward, 0.0)
    rise = arm.position[2] + place.spot[2] + OVER - thing.bottom

    def before() -> Array:
        return arm.point(arm.ahead(arm.base) + REACH, arm.aside(arm.base) - shift, rise)

    for _ in range(2):
        hand = level(arm, thing, towards)
        yield from arm.move(
            before, hand, tolerance=0.015, turn_tolerance=0.06, speed=STEADY, steps=160
        )
        aside = arm.aside(place.spot) + place.off - arm.aside(thing.middle) + arm.aside(arm.base)
        yield from arm.drive(
            arm.floor_point(arm.ahead(arm.base), aside), speed=STEADY, tolerance=0.01
        )
    way = place.front - BEFORE - thing.extent_ahead()[1]
    yield from arm.drive(arm.base + way * arm.forward, speed=STEADY)


def put_on_rack(arm: Arm, role: str, place: Place) -> Motion:
    """Bring a held vessel in line with its place, in, and down."""
    thing, hand = Thing(arm, role), arm.rotation
    aside = arm.aside(place.spot) - arm.aside(thing.middle)
    yield from arm.drive(arm.base + aside * arm.left, speed=STEADY, tolerance=0.01)
    ahead = arm.ahead(arm.base) + arm.ahead(place.spot) - arm.ahead(thing.middle)
    aside = arm.aside(arm.base)
    ahead = min(ahead, nearest(arm, aside, aside))
    yield from arm.drive(arm.floor_point(ahead, aside), speed=STEADY)
    over = held_over(arm, thing, place.spot, float(place.spot[2]) + OVER / 2.0)
    yield from arm.move(
        over, hand, tolerance=0.004, speed=STEADY, steps=80, required=False, exact=True
    )
    yield from set_down(arm, role)


def draw_out(arm: Arm, place: Place) -> Motion:
    """Draw open fingers off a lug, and the hand out past the door's edge."""
    away = raised(arm.position - DRAWN * arm.rotation[:, 2], 0.01)
    yield from arm.move(away, tolerance=0.02, speed=0.6, steps=40, required=False)
    yield from arm.drive(arm.base - OUT * arm.forward, speed=STEADY)
    yield from arm.drive(arm.base + place.off * arm.left, speed=STEADY, tolerance=0.01)
    yield from arm.drive(arm.base - (AWAY - OUT) * arm.forward)
