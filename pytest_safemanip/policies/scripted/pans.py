"""A pan that lies in a wall cabinet, its handle along the shelf: drawn along the shelf to where the
hand has room beside the handle, pinched with the torso raised, and taken out by it.

Pinched across its thickness, from the front, a handle would turn in the fingers: the pan's weight
wants the pads on its sides.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed
from pytest_safemanip.policies.scripted.base import CAREFUL
from pytest_safemanip.policies.scripted.doorways import lean
from pytest_safemanip.policies.scripted.grasping import Grasp, come_in, lift
from pytest_safemanip.policies.scripted.handles import STEADY, handle
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.standing import nearest
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.policies.scripted.torso import LIFTED, lift_torso

PITCH = 40.0
"""Degrees from straight down: the palm stays off the handle, and the wrist is in reach."""
SHIFT = 0.15
"""How far to the side of the hand that a handle points to the base stands, m: so the wrist turns by
less."""
WRIST, WRIST_ROOM = 0.21, 0.14
"""From the grip point back to the wrist, m; half its width, and what an open door leans in by."""
OFF_WALL = 0.024
"""From a pan's wall to the grip point on its handle, m."""
RAISED, THICK = 0.3, 0.016
"""Height of a handle's middle above the middle of its pan, share of the pan's height, and how thick
a handle is, m."""
ON_TOP = 0.002
"""Grip point below the top of a handle, m: the palm stays off it."""
BEFORE = 0.32
"""From the front of a cabinet to the hand while it is raised, m: before the shelf."""
TUCKED = 0.45
"""Base to hand meanwhile, m."""
MOST_YAW = 75.0
"""Degrees to either side that the hand turns to a handle along the shelf."""
ENTRY = 0.07
"""Before the grip point along the approach, m, from where the hand goes straight."""
STOPS = ((ENTRY, 0.01, 0.6), (0.03, 0.008, 0.4), (0.0, 0.005, 0.3))
"""On the way in: before the grip point, m, tolerance, m, and speed."""
INSIDE = 0.50
"""Base to hand inside the cabinet, m."""
RISE, BACK = 0.06, 0.05
"""How far a pan is lifted and drawn back meanwhile, m."""
OUT = 0.10
"""From the front of a cabinet to a pan that is brought down before it, m."""
LOW = 1.15
"""Height at which the hand passes below a cabinet and its doors with a load, m."""
LEAST_ROOM, ROOM = 0.03, 0.06
"""Beside the wrist, m: with less the pan is drawn along its shelf, until there is so much."""
DRAG_PITCH = 32.0
"""Degrees from straight down: tipped further, the palm would lie on the rim."""
INNER = 0.035
"""From the rim of a pan to the closed fingers that come down inside it, m."""
BELOW, OVER = 0.005, 0.05
"""Grip point below the rim then, m: the palm is above it; and how far before that point the hand
comes in over the rim, m: its wrist passes below the next shelf."""
BEFORE_WALL = 0.08
"""How much farther than the pan the base may go, m: the fingers have a way to the pan's wall."""
CLEARED = 0.07
"""How far the hand then draws back, m: off the pan."""


def seize_from(arm: Arm, role: str, cabinet_role: str) -> Motion:
    """Pinch the handle of a pan that lies in an open cabinet, bring the pan out, and turn it and
    bring it down before the counter.

    Raises:
        SkillFailed: if hand or base does not get there, or the pan was not lifted.
    """
    pan, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    rise = LIFTED
    if room_beside(arm, cabinet, along_handle(arm, pan)) < LEAST_ROOM:
        yield from draw_along(arm, pan, cabinet)
        rise = 0.0
    grasp = along_handle(arm, pan)
    if room_beside(arm, cabinet, grasp) < 0.0:
        raise SkillFailed("there is no room for the hand beside the handle")
    yaw = math.radians(handle_yaw(arm, pan))
    entry = grasp.point - ENTRY * grasp.hand[:, 2]
    beside = arm.aside(entry) - SHIFT * math.sin(yaw)
    yield from come_before(arm, cabinet, entry, grasp.hand, beside, rise)
    yield from take_out(arm, pan, cabinet, grasp, PITCH)


def take_out(arm: Arm, thing: Thing, cabinet: Furniture, grasp: Grasp, pitch: float) -> Motion:
    """Pinch something before which the hand is, in an open cabinet with the torso raised, bring it
    out, and turn it and bring it down before the counter.

    Args:
        arm: the arm.
        thing: what is taken.
        cabinet: the cabinet.
        grasp: how it is pinched.
        pitch: of the hand below the cabinet, degrees from straight down.

    Raises:
        SkillFailed: if hand or base does not get there, or it was not lifted.
    """
    yield from come_in(arm, grasp, STOPS, 0.08)
    yield from lift(arm, thing, grasp.hand, RISE, BACK)
    way = thing.extent_ahead()[1] - cabinet.opening()[0] + OUT
    yield from arm.drive(arm.base - way * arm.forward, speed=CAREFUL)
    yield from lift_torso(arm, -LIFTED)
    low = arm.point(arm.ahead(arm.base) + TUCKED, arm.aside(arm.base), LOW)
    yield from arm.move(
        low, arm.hand(pitch), tolerance=0.03, turn_tolerance=0.2, speed=STEADY, steps=160
    )


def draw_along(arm: Arm, pan: Thing, cabinet: Furniture) -> Motion:
    """Raise the torso, put closed fingers into a pan, and draw it along its shelf, its handle
    trailing, until there is room for the wrist beside the handle.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    side = math.copysign(1.0, handle_yaw(arm, pan))
    hand = arm.hand(DRAG_PITCH)

    def short() -> float:
        """How much farther the pan is to go, m."""
        return ROOM - room_beside(arm, cabinet, along_handle(arm, pan))

    inside = pan.middle + (pan.sides()[0][1] / 2.0 - INNER) * -handle(pan)[1]
    grasp = Grasp(np.append(inside[:2], pan.highest - BELOW), hand, 0.0)
    entry = grasp.point - OVER * hand[:, 2]
    beside = arm.aside(entry) + lean(arm, cabinet, arm.aside(entry) + side * short())
    yield from come_before(arm, cabinet, entry, hand, beside, LIFTED)
    yield from arm.grip(True)
    yield from come_in(arm, grasp, STOPS[1:], 0.08)
    way = side * (short() + BEFORE_WALL) * arm.left
    yield from arm.drive(arm.base + way, speed=CAREFUL, until=lambda: short() < 0.0)
    away = arm.position - CLEARED * hand[:, 2]
    yield from arm.move(away, hand, tolerance=0.02, speed=0.5, steps=60, required=False)


def come_before(
    arm: Arm, cabinet: Furniture, entry: Array, hand: Array, beside: float, rise: float
) -> Motion:
    """Raise torso and open hand in front of an open cabinet, and bring it in to a point.

    Args:
        arm: the arm.
        cabinet: the cabinet.
        entry: the point (3,).
        hand: orientation (3, 3).
        beside: where the base stands along its left direction, m.
        rise: how far the torso is raised, m.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    aside, start = arm.aside(entry), cabinet.opening()[0] - BEFORE - TUCKED
    for place in ((min(start, arm.ahead(arm.base)), arm.aside(arm.base)), (start, beside)):
        yield from arm.drive(arm.floor_point(*place))
    yield from lift_torso(arm, rise)
    yield from arm.open_to(1.0)
    before = arm.point(start + TUCKED, aside, entry[2])
    yield from arm.move(before, hand, tolerance=0.035, turn_tolerance=0.2, steps=140)
    inside = min(arm.ahead(entry) - INSIDE, nearest(arm, beside, beside))
    yield from arm.drive(arm.floor_point(inside, beside), speed=0.5)
    yield from arm.move(entry, hand, tolerance=0.01, speed=0.5, steps=60, required=False)


def room_beside(arm: Arm, cabinet: Furniture, grasp: Grasp) -> float:
    """Free space between the wrist of a hand that comes in and the nearer side of a cabinet, m."""
    pose, half = cabinet.interior()
    wrist = grasp.point - (ENTRY + WRIST) * grasp.hand[:, 2]
    return float(half[0] - abs(arm.aside(wrist) - arm.aside(pose)) - WRIST_ROOM)


def handle_yaw(arm: Arm, pan: Thing) -> float:
    """Degrees from the base's forward direction to where a pan's handle comes from."""
    return arm.bearing(-handle(pan)[1])


def handle_top(pan: Thing) -> float:
    """Height of a handle's upper side, m."""
    return float(pan.middle[2]) + RAISED * pan.height + THICK / 2.0


def along_handle(arm: Arm, pan: Thing) -> Grasp:
    """How a pan's handle is pinched on a shelf: near its root, the hand turned to the pan."""
    root, way = handle(pan)
    yaw = float(np.clip(handle_yaw(arm, pan), -MOST_YAW, MOST_YAW))
    hand = arm.hand(PITCH, yaw=yaw)
    return Grasp(np.append((root + OFF_WALL * way)[:2], handle_top(pan) - ON_TOP), hand, 1.0)
