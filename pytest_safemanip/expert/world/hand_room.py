"""Room for the hand: for its palm, its fingers and its way in, between what stands around."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.hand import FINGERTIP, GAP, HAND, PALM, Grasp, hand_corners
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.contacts import pressed_by
from pytest_safemanip.expert.world.rims import overhung
from pytest_safemanip.expert.world.standing import solids
from pytest_safemanip.expert.world.things import Thing, other_things
from pytest_safemanip.trace.geometry import corners
from pytest_safemanip.trace.planar import footprints_overlap

WRIST_LENGTH = 0.05
"""How far beyond the flange the wrist is as thick as the hand, m."""
HAND_CLEARANCE = 0.004
"""Kept free around a hand that comes in, m: it arrives within 6 mm, bottles are narrower than their
boxes."""
LEVELS = np.linspace(0.0, 1.0, 9)
"""Heights of a thing that are looked at, shares of its own."""
SPAN = np.linspace(-1.0, 1.0, 9)
"""Where along their width fingers and palm are looked at, shares of half of it."""
OPEN_FINGERS = (0.055, 0.012)
"""Half the length, along their travel, and half the thickness of two open fingers, m."""
IN_FRONT = 0.03
"""What ends so far before the grip point stands in front of the hand, m."""
DRAWN_OVER = 0.02
"""Free space below a hand that is drawn back over something, m."""
MOST_RAISED = 0.15
"""How far it is raised for that at most, m."""


def palm_has_room(arm: Arm, grasp: Grasp, own: Thing) -> bool:
    """Whether nothing stands where the palm and the wrist are at a grasp.

    Args:
        arm: the arm.
        grasp: the grasp.
        own: what is grasped; what lies in it or under it does not count either.
    """
    x, y, deep = HAND
    for other in _beside(arm, own):
        local = (_outline(other) - grasp.point) @ grasp.hand
        inside = (np.abs(local[:, 0]) < x + HAND_CLEARANCE) & (
            np.abs(local[:, 1]) < y + HAND_CLEARANCE
        )
        behind = -local[:, 2]
        if (
            inside & (behind > PALM - HAND_CLEARANCE) & (behind < PALM + deep + WRIST_LENGTH)
        ).any():
            return False
    return True


def room_on_way(arm: Arm, grasp: Grasp, own: Thing, back: float) -> float:
    """Least distance of fingers, palm and wrist that come in to a grasp along its approach from
    what stands beside it, as if that were upright pillars, m; below 0 they would go into one.

    Args:
        arm: the arm.
        grasp: the grasp.
        own: what is grasped; what lies in it or under it does not count either.
        back: length of the approach, m.
    """
    ways = np.linspace(0.0, back, len(LEVELS))[:, None, None] * -grasp.hand[:, 2]
    points = (ways + _shell(grasp.hand) + grasp.point).reshape(-1, 3)
    room = math.inf
    for other in _beside(arm, own):
        beside = np.linalg.norm((points - other.centre)[:, :2], axis=1) - other.sides()[1][1] / 2.0
        above = points[:, 2] - other.highest
        outside = np.hypot(np.maximum(beside, 0.0), np.maximum(above, 0.0))
        room = min(room, float((outside + np.minimum(np.maximum(beside, above), 0.0)).min()))
    return room


def rise_over_front(arm: Arm, back: float) -> float:
    """How far a hand is to be raised before it is drawn back, for it to pass over what stands in
    front of it, m; not below what hangs there.

    Args:
        arm: the arm.
        back: how far it is drawn back, m.
    """
    if overhung(arm, arm.position):
        return 0.0
    here, reach = arm.ahead(arm.position), max(HAND)
    rise = 0.0
    for thing in other_things(arm):
        far = thing.extent_ahead()[1]
        if far > here - IN_FRONT or far < here - back - reach:
            continue
        sides = [arm.aside(corner) for corner in thing.corners]
        for points in (hand_corners(arm.rotation), _finger_corners(arm.rotation)):
            across = [arm.aside(point + arm.position) for point in points]
            bottom = float(arm.position[2] + points[:, 2].min())
            beside = (
                min(sides) > max(across) + HAND_CLEARANCE
                or max(sides) < min(across) - HAND_CLEARANCE
            )
            if not beside and bottom - HAND_CLEARANCE < thing.highest < bottom + MOST_RAISED:
                rise = max(rise, thing.highest + DRAWN_OVER - bottom)
    return min(rise, MOST_RAISED)


def _finger_corners(hand: Array) -> Array:
    """Corners (8, 3) of two open fingers, from the grip point, m."""
    x, y = OPEN_FINGERS
    ends = (-FINGERTIP, PALM)
    return np.array([(i * x, j * y, -k) for i in (-1, 1) for j in (-1, 1) for k in ends]) @ hand.T


def _shell(hand: Array) -> Array:
    """Points (K, 3) on open fingers, palm and wrist, from the grip point, m."""
    parts = ((OPEN_FINGERS, (-FINGERTIP, PALM)), (HAND[:2], (PALM, PALM + HAND[2] + WRIST_LENGTH)))
    grids = [
        np.stack(np.meshgrid(x * SPAN, (-y, y), -np.linspace(*ends, 3), indexing="ij"), axis=-1)
        for (x, y), ends in parts
    ]
    points: Array = np.concatenate([grid.reshape(-1, 3) for grid in grids]) @ hand.T
    return points


def _beside(arm: Arm, own: Thing) -> list[Thing]:
    """What stands beside a thing."""
    radius, middle = own.sides()[0][1] / 2.0, own.middle[:2].tolist()
    return [t for t in other_things(arm) if math.dist(t.centre[:2].tolist(), middle) > radius]


def _outline(thing: Thing) -> Array:
    """Points (45, 3) of a thing, as if its box were a pillar with round edges."""
    arms = [side * sign * width / 2.0 for side, width in thing.sides() for sign in (1.0, -1.0)]
    flat = thing.centre + np.array([np.zeros(3), *arms]) * (1.0, 1.0, 0.0)
    points = np.repeat(flat, len(LEVELS), axis=0)
    points[:, 2] = np.tile(thing.bottom + LEVELS * thing.height, len(flat))
    return points


PINCH_OFFSETS = (0.0, 0.015, -0.015, 0.03, -0.03, 0.045, -0.045)
"""How far from its middle a thing may be pinched for the sake of what lies beside it, m: farther,
it would hang."""
FINGER_SIZE = (0.016, 0.022)
"""Thickness of a finger along its travel, and its width, m, with 2 mm kept free."""

FINGER_BLOCKED = 10.0
"""Force that shows that a finger stands on something and does not slide past it, N."""


def free_of_others(
    arm: Arm,
    thing: Thing,
    width: float,
    along: Iterable[float] = PINCH_OFFSETS,
    under: Collection[str] = (),
) -> Array:
    """From a lying thing's middle to where along it the open fingers meet nothing else (3,), m; its
    middle if there is no such place: boxes say more than there is of a tool.

    Args:
        arm: the arm.
        thing: what is pinched from above, across its narrow side.
        width: between the fingers, m.
        along: how far from its middle it may be pinched, m, the best first.
        under: entities that it lies on, which the fingers stay above.
    """
    (across, _), (axis, _) = thing.sides()
    others = [o for o in other_things(arm, thing) if o.entity not in under]
    beside = [o.corners for o in others if o.bottom < thing.highest and o.highest > thing.bottom]
    thick, wide = FINGER_SIZE
    for off in along:
        middle = thing.com + off * axis
        ends = [
            _rectangle(middle + side * (width + thick) / 2.0 * across, thick * across, wide * axis)
            for side in (-1.0, 1.0)
        ]
        if not any(footprints_overlap(end, other, 0.0) for end in ends for other in beside):
            return np.asarray(off * axis, np.float64)
    return np.zeros(3)


def fingers_meet(arm: Arm, thing: Thing) -> bool:
    """Whether a finger comes down on an object that it is not to take."""
    others = pressed_by(arm, "finger", FINGER_BLOCKED) - {thing.entity}
    return bool(others & set(arm.scene.object_index))


def _rectangle(middle: Array, side: Array, other: Array) -> Array:
    return np.array([middle + i * side + j * other for i in (-0.5, 0.5) for j in (-0.5, 0.5)])


BESIDE_FINGER = (0.015, 0.012)
"""Thickness of a finger, and half its width, m."""


def beside_things(arm: Arm, thing: Thing, grasp: Grasp) -> float:
    """Least distance from the fingers, and from the palm above them, to what stands around, m."""
    axis, least = grasp.hand[:2, 0] / np.linalg.norm(grasp.hand[:2, 0]), math.inf
    fingers = grasp.opening * GAP / 2.0 + BESIDE_FINGER[0], BESIDE_FINGER[1]
    for other in other_things(arm, thing):
        way = (other.centre - grasp.point)[:2]
        along, off = abs(float(way @ axis)), abs(float(axis[0] * way[1] - axis[1] * way[0]))
        tall = other.highest > grasp.point[2] + PALM
        reach, half = HAND[:2] if tall else fingers
        gap = math.hypot(max(0.0, along - reach), max(0.0, off - half))
        least = min(least, gap - other.sides()[0][1] / 2.0)
    return least


def beside_furniture(arm: Arm, point: Array, hand: Array) -> float:
    """Least distance, on the level, from a hand that points down to furniture that is as high, m.

    Args:
        arm: the arm.
        point: its grip point (3,).
        hand: its orientation (3, 3).
    """
    palm = hand_corners(hand) + point
    axes = np.array([[*arm.forward], [*arm.left], hand[:2, 0], hand[:2, 1]])
    least = math.inf
    for points in [*solids(arm), *handles_and_controls(arm)]:
        if points[:, 2].max() > palm[:, 2].min() and points[:, 2].min() < palm[:, 2].max():
            ours, theirs = palm[:, :2] @ axes.T, points[:, :2] @ axes.T
            beside = np.maximum(ours.min(0) - theirs.max(0), theirs.min(0) - ours.max(0))
            least = min(least, float(beside.max()))
    return least


def handles_and_controls(arm: Arm) -> list[Array]:
    """Corners (8, 3) of what is pulled or pressed on furniture."""
    boxes, poses = arm.scene.boxes, arm.step.box_pose
    return [
        np.asarray(corners(np.asarray(poses[k], np.float64), box.half), np.float64)
        for k, box in enumerate(boxes)
        if box.kind in ("handle", "control")
    ]
