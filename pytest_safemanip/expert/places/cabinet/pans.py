"""A pan that lies in a wall cabinet, its handle along the shelf: drawn along the shelf to where the
hand has room beside the handle, pinched with the torso raised, and taken out by it.

Pinched across its thickness, from the front, a handle would turn in the fingers: the pan's weight
wants the pads on its sides.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.grasping import come_in, lift
from pytest_safemanip.expert.motions.handles import STEADY, handle
from pytest_safemanip.expert.places.cabinet.doorway import lean
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed
from pytest_safemanip.expert.robot.base import CAREFUL
from pytest_safemanip.expert.robot.hand import WRIST, Grasp
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.robot.torso import TORSO_LIFTED, lift_torso
from pytest_safemanip.expert.world.standing import nearest
from pytest_safemanip.expert.world.things import Furniture, Thing

PITCH = 40.0
"""Degrees from straight down: the palm stays off the handle, and the wrist is in reach."""
SHIFT = 0.15
"""How far to the side of the hand that a handle points to the base stands, m: so the wrist turns by
less."""
WRIST_HALF = 0.14
"""Half the wrist's width, and what an open door leans in by, m."""
OFF_WALL = 0.024
"""From a pan's wall to the grip point on its handle, m."""
HANDLE_RAISED, HANDLE_THICK = 0.3, 0.016
"""Height of a handle's middle above the middle of its pan, share of the pan's height, and how thick
a handle is, m."""
ON_TOP = 0.002
"""Grip point below the top of a handle, m: the palm stays off it."""
BEFORE_CABINET = 0.32
"""From the front of a cabinet to the hand while it is raised, m: before the shelf."""
PAN_TUCKED = 0.45
"""Base to hand meanwhile, m."""
HANDLE_MOST_YAW = 75.0
"""Degrees to either side that the hand turns to a handle along the shelf."""
ENTRY = 0.07
"""Before the grip point along the approach, m, from where the hand goes straight."""
STOPS = ((ENTRY, 0.01, 0.6), (0.03, 0.008, 0.4), (0.0, 0.005, 0.3))
"""On the way in: before the grip point, m, tolerance, m, and speed."""
INSIDE = 0.50
"""Base to hand inside the cabinet, m."""
PAN_RISE, PAN_BACK = 0.06, 0.05
"""How far a pan is lifted and drawn back meanwhile, m."""
OUT_OF_CABINET = 0.10
"""From the front of a cabinet to a pan that is brought down before it, m."""
PAN_LOW = 1.15
"""Height at which the hand passes below a cabinet and its doors with a load, m."""
LEAST_ROOM, WRIST_FREE = 0.03, 0.06
"""Beside the wrist, m: with less the pan is drawn along its shelf, until there is so much."""
DRAG_PITCH = 32.0
"""Degrees from straight down: tipped further, the palm would lie on the rim."""
INNER = 0.035
"""From the rim of a pan to the closed fingers that come down inside it, m."""
BELOW_RIM, OVER_RIM = 0.005, 0.05
"""Grip point below the rim then, m: the palm is above it; and how far before that point the hand
comes in over the rim, m: its wrist passes below the next shelf."""
BEFORE_WALL = 0.08
"""How much farther than the pan the base may go, m: the fingers have a way to the pan's wall."""
CLEARED = 0.07
"""How far the hand then draws back, m: off the pan."""


def grasp_handle_on_shelf(arm: Arm, role: str, cabinet_role: str) -> Motion:
    """Pinch the handle of a pan that lies in an open cabinet, bring the pan out, and turn it and
    bring it down before the counter.

    Raises:
        SkillFailed: if hand or base does not get there, or the pan was not lifted.
    """
    pan, cabinet = Thing(arm, role), Furniture(arm, cabinet_role)
    rise = TORSO_LIFTED
    if wrist_room_beside(arm, cabinet, along_handle(arm, pan)) < LEAST_ROOM:
        yield from draw_along(arm, pan, cabinet)
        rise = 0.0
    grasp = along_handle(arm, pan)
    if wrist_room_beside(arm, cabinet, grasp) < 0.0:
        raise SkillFailed("there is no room for the hand beside the handle")
    yaw = math.radians(handle_yaw(arm, pan))
    entry = grasp.point - ENTRY * grasp.hand[:, 2]
    beside = arm.aside(entry) - SHIFT * math.sin(yaw)
    yield from come_before(arm, cabinet, entry, grasp.hand, beside, rise)
    yield from grasp_and_bring_out(arm, pan, cabinet, grasp, PITCH)


def grasp_and_bring_out(
    arm: Arm, thing: Thing, cabinet: Furniture, grasp: Grasp, pitch: float
) -> Motion:
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
    yield from lift(arm, thing, grasp.hand, PAN_RISE, PAN_BACK)
    way = thing.extent_ahead()[1] - cabinet.opening()[0] + OUT_OF_CABINET
    yield from arm.drive(arm.base - way * arm.forward, speed=CAREFUL)
    yield from lift_torso(arm, -TORSO_LIFTED)
    low = arm.before(PAN_TUCKED, PAN_LOW)
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
        return WRIST_FREE - wrist_room_beside(arm, cabinet, along_handle(arm, pan))

    inside = pan.middle + (pan.sides()[0][1] / 2.0 - INNER) * -handle(pan)[1]
    grasp = Grasp(np.append(inside[:2], pan.highest - BELOW_RIM), hand, 0.0)
    entry = grasp.point - OVER_RIM * hand[:, 2]
    beside = arm.aside(entry) + lean(arm, cabinet, arm.aside(entry) + side * short())
    yield from come_before(arm, cabinet, entry, hand, beside, TORSO_LIFTED)
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
    aside, start = arm.aside(entry), cabinet.opening()[0] - BEFORE_CABINET - PAN_TUCKED
    for place in ((min(start, arm.ahead(arm.base)), arm.aside(arm.base)), (start, beside)):
        yield from arm.drive(arm.floor_point(*place))
    yield from lift_torso(arm, rise)
    yield from arm.open_to(1.0)
    before = arm.point(start + PAN_TUCKED, aside, entry[2])
    yield from arm.move(before, hand, tolerance=0.035, turn_tolerance=0.2, steps=140)
    inside = min(arm.ahead(entry) - INSIDE, nearest(arm, beside, beside))
    yield from arm.drive(arm.floor_point(inside, beside), speed=0.5)
    yield from arm.move(entry, hand, tolerance=0.01, speed=0.5, steps=60, required=False)


def wrist_room_beside(arm: Arm, cabinet: Furniture, grasp: Grasp) -> float:
    """Free space between the wrist of a hand that comes in and the nearer side of a cabinet, m."""
    pose, half = cabinet.interior()
    wrist = grasp.point - (ENTRY + WRIST) * grasp.hand[:, 2]
    return float(half[0] - abs(arm.aside(wrist) - arm.aside(pose)) - WRIST_HALF)


def handle_yaw(arm: Arm, pan: Thing) -> float:
    """Degrees from the base's forward direction to where a pan's handle comes from."""
    return arm.bearing(-handle(pan)[1])


def handle_top(pan: Thing) -> float:
    """Height of a handle's upper side, m."""
    return float(pan.middle[2]) + HANDLE_RAISED * pan.height + HANDLE_THICK / 2.0


def along_handle(arm: Arm, pan: Thing) -> Grasp:
    """How a pan's handle is pinched on a shelf: near its root, the hand turned to the pan."""
    root, way = handle(pan)
    yaw = float(np.clip(handle_yaw(arm, pan), -HANDLE_MOST_YAW, HANDLE_MOST_YAW))
    hand = arm.hand(PITCH, yaw=yaw)
    return Grasp(np.append((root + OFF_WALL * way)[:2], handle_top(pan) - ON_TOP), hand, 1.0)
