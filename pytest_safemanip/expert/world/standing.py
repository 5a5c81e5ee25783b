"""Where the base can stand: before furniture, whatever of it is open, so that arm and load have
room.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.hand import reach_at
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing, other_things
from pytest_safemanip.trace.geometry import corners
from pytest_safemanip.trace.kinematics import carried
from pytest_safemanip.trace.scene import Scene

BODY_FRONT = (
    (0.002, 0.39, 0.15, 0.25),
    (0.30, 0.70, 0.07, 0.12),
    (0.62, 0.89, 0.105, 0.10),
    (0.80, 1.00, 0.09, 0.15),
)
"""The robot's front by height: from, to, how far before the base's origin, half width, m: wheels,
column, foot and shoulder of the arm. Above, the arm goes where its hand goes."""
BODY_REAR = (0.39, 0.55, 0.25)
"""The robot's wheels: their height, how far behind the base's origin they end, half width, m."""
STAND_OFFSETS = (0.0, 0.04, -0.04, 0.08, -0.08, 0.12, -0.12)
"""How far beside a thing the base may stand to come closer to it, m."""
BASE_ROOM = 0.02
"""Kept free in front of it, m."""
ARM_ROOM = 0.20
"""Half width of arm and hand, and how far either swings out sideways, m."""
HAND_ROOM = 0.13
"""From the grip point to the far end of the hand, m."""
STANDS_OUT = 0.1
"""Openness from which a door stands out from its cabinet by more than a handle."""
DUCKED = (0.42, 1.12)
"""Base to hand, m, and height of the hand, m, with which the forearm passes below the doors of a
wall cabinet (1.45 m)."""


AHEAD, ASIDE = (0.0, -0.06, 0.05), (0.0, 0.1, -0.1, 0.2, -0.2)
"""How much farther ahead and to the left of its usual place the base may stand, m."""


def stand_before(
    arm: Arm,
    point: Array,
    distance: float,
    shift: float = 0.0,
    speed: float = 0.7,
    offsets: Sequence[float] = STAND_OFFSETS,
) -> Motion:
    """Drive to where a point is at a distance ahead of the base, a little aside of it if what
    stands there is in the way.

    Args:
        arm: the arm.
        point: the point (2,) or (3,).
        distance: from the base to it, m.
        shift: how far to the left of it the base is to stand, m.
        speed: largest command to the base.
        offsets: how far beside that it may stand to come closer, the preferred first, m.

    Raises:
        SkillFailed: if the base does not arrive.
    """
    ahead = arm.ahead(point) - distance + arm.choices.choose("base farther ahead", AHEAD)
    middle = arm.aside(point) + shift + arm.choices.choose("base farther left", ASIDE)
    yield from stand(arm, ahead, middle + closest(arm, ahead, middle, offsets), speed)


def closest(arm: Arm, ahead: float, aside: float, offsets: Sequence[float]) -> float:
    """How far beside a place the base can come closest to being so far ahead, m.

    Args:
        arm: the arm.
        ahead: where the base is to stand along its forward direction, m.
        aside: the place along its left direction, m.
        offsets: how far beside it the base may stand, the preferred first, m.
    """
    places = ((offset, aside + offset) for offset in offsets)
    return max(places, key=lambda place: min(ahead, nearest(arm, place[1], place[1])))[0]


def stand(arm: Arm, ahead: float, aside: float, speed: float = 0.7) -> Motion:
    """Drive to a place, or as near to it as furniture lets the base come.

    Args:
        arm: the arm.
        ahead: along the base's forward direction, m.
        aside: along its left direction, m.
        speed: largest command to the base.

    Raises:
        SkillFailed: if the base does not arrive.
    """
    steps = round(105 / speed)
    here = arm.ahead(arm.base), arm.aside(arm.base)
    passing = nearest(arm, min(here[1], aside), max(here[1], aside))
    if passing < here[0]:
        yield from arm.drive(arm.floor_point(passing, here[1]), speed=speed, steps=steps)
    along = min(passing, max(here[0], min(ahead, passing)))
    yield from arm.drive(arm.floor_point(min(along, here[0]), aside), speed=speed, steps=steps)
    nearer = min(ahead, nearest(arm, aside, aside))
    yield from arm.drive(arm.floor_point(nearer, aside), speed=speed, steps=steps)


def duck(arm: Arm, aside: float) -> Motion:
    """Lower the hand before what hangs over the way to a place: the open doors of a wall cabinet.

    Args:
        arm: the arm.
        aside: the place along the base's left direction, m.

    Raises:
        SkillFailed: if base or hand do not arrive.
    """
    before = before_open(arm, aside)
    if before < arm.ahead(arm.position):
        back = arm.ahead(arm.position) - before
        yield from arm.drive(arm.base - back * arm.forward)
        yield from ducked(arm)


def before_open(arm: Arm, aside: float) -> float:
    """How far ahead the hand may be, m, for the arm to be before every open door that hangs over
    its way to a place along the base's left direction, m.
    """
    ends = sorted((arm.aside(arm.base), aside))
    over = [
        float((points[:, :2] @ arm.forward).min())
        for points in solids(arm, opened=True)
        if points[:, 2].min() > arm.position[2]
        and (points[:, :2] @ arm.left).min() < ends[1] + ARM_ROOM
        and (points[:, :2] @ arm.left).max() > ends[0] - ARM_ROOM
    ]
    return min(over, default=math.inf) - HAND_ROOM


def ducked(arm: Arm) -> Motion:
    """Lower the hand before the base, for the forearm to pass below the doors of a wall cabinet."""
    low = arm.before(DUCKED[0], DUCKED[1])
    yield from arm.move(low, tolerance=0.03, turn_tolerance=0.2, steps=80)


def nearest(arm: Arm, right: float, left: float) -> float:
    """How far ahead the base may be anywhere between two places sideways, m."""
    along, across, height = _extents(arm)
    ahead = along[:, 1] > arm.ahead(arm.base)
    limit = math.inf
    for bottom, top, front, half in BODY_FRONT:
        within = (height[:, 0] < top) & (height[:, 1] > bottom) & ahead
        within &= _crosses(across, right - half, left + half)
        limit = min(limit, float(along[within, 0].min(initial=math.inf)) - front - BASE_ROOM)
    return limit


def rearmost(arm: Arm, right: float, left: float) -> float:
    """How far back the base may be anywhere between two places sideways, ahead, m."""
    top, rear, half = BODY_REAR
    along, across, height = _extents(arm)
    behind = (height[:, 0] < top) & (along[:, 1] < arm.ahead(arm.base))
    behind &= _crosses(across, right - half, left + half)
    return float(along[behind, 1].max(initial=-math.inf)) + rear + BASE_ROOM


def _crosses(across: Array, right: float, left: float) -> NDArray[np.bool_]:
    """Which extents (N, 2) along the base's left direction come near a range, m (N,)."""
    crossing: NDArray[np.bool_] = (across[:, 1] >= right - BASE_ROOM) & (
        across[:, 0] <= left + BASE_ROOM
    )
    return crossing


def _extents(arm: Arm) -> tuple[Array, Array, Array]:
    """Of every piece of furniture, from where to where it is along the base's forward and left
    directions and in height, m (N, 2) each.
    """
    points = solids(arm)
    seen = points[..., :2] @ arm.forward, points[..., :2] @ arm.left, points[..., 2]
    along, across, height = (np.stack((x.min(axis=1), x.max(axis=1)), axis=1) for x in seen)
    return along, across, height


def solids(arm: Arm, opened: bool = False, but: str = "") -> Array:
    """Corners of every piece of furniture as it is now (N, 8, 3).

    Args:
        arm: the arm.
        opened: only doors and drawers that are open.
        but: a joint; what it moves is left out.
    """
    state = arm.step.joint[:, 0].tobytes(), but
    return arm.latest(f"furniture, open: {opened}", state, lambda: _solids(arm, opened, but))


def _solids(arm: Arm, opened: bool, but: str) -> Array:
    fixed, moving = arm.memory("furniture", lambda: _furniture(arm.scene))
    found = [] if opened else [fixed]
    for pose, half, index in moving:
        if but and arm.scene.joints[index].key == but:
            continue
        openness = np.asarray(arm.step.joint[index, 0], np.float64)
        if not opened or openness >= STANDS_OUT:
            found.append(corners(carried(arm.scene.joints[index], pose, openness), half)[None])
    return np.concatenate(found) if found else np.zeros((0, 8, 3))


_Moving = tuple[Array, Array, int]


def _furniture(scene: Scene) -> tuple[Array, list[_Moving]]:
    """Corners of what stands fixed (N, 8, 3); pose at openness 0, half extents and joint of what
    moves.
    """
    fixed, moving = [np.zeros((0, 8, 3))], list[_Moving]()
    for surface in scene.surfaces:
        if scene.entity[surface.entity].kind != "fixture":
            continue
        pose, half = np.asarray(surface.pose, np.float64), np.asarray(surface.half)
        if surface.joint:
            moving.append((pose, half, scene.joint_index[surface.joint]))
        else:
            fixed.append(corners(pose, half)[None])
    return np.concatenate(fixed), moving


FOREARM = (0.15, 0.30)
"""Above what a hand sets something down on, m: from where to where the forearm is."""
ELBOW_SWING, ELBOW_LEAN = 0.27, 0.10
"""How far forearm and elbow swing out sideways at most, and how far beside a spot the base can
stand, m."""
STRAIGHT_PITCH = 45.0
"""Pitch from which a hand comes into line with the forearm at the height of a counter, degrees:
there the last joints turn about one line, swap their turns, and end at their limits."""
WRIST_BEND = 20.0
"""Degrees about the vertical, between hand and forearm, with which they do not come into line."""
LEAST_TURNED = 10.0
"""Degrees about the vertical from which a hand is bent to the side that it is turned to."""


def elbow_room(arm: Arm, spot: Array) -> float:
    """How far to the left of a spot (3,) the base is to stand for forearm and elbow, which swing
    out, to stay off a tall machine beside it, m.
    """
    low, high = spot[2] + FOREARM[0], spot[2] + FOREARM[1]
    sides = set()
    for points in solids(arm):
        aside = points[:, :2] @ arm.left - arm.aside(spot)
        beside = abs(aside).min() < ELBOW_SWING and aside.min() * aside.max() > 0.0
        near = beside and (points[:, :2] @ arm.forward).min() < arm.ahead(spot)
        if near and points[:, 2].max() > low and points[:, 2].min() < high and np.ptp(aside) < 1.0:
            sides.add(math.copysign(1.0, aside.mean()))
    return -ELBOW_LEAN * sides.pop() if len(sides) == 1 else 0.0


def wrist_room(arm: Arm, shift: float) -> float:
    """How far to the left of a spot the base is to stand for the wrist to come down to a counter
    bent sideways, m.

    Args:
        arm: the arm, holding something as it will put it down.
        shift: how far for other reasons, m.
    """
    if arm.pitch < STRAIGHT_PITCH:
        return shift
    side = arm.aside(arm.rotation[:, 2])
    turned = math.degrees(math.atan2(side, arm.ahead(arm.rotation[:, 2])))
    way = shift or (turned if abs(turned) > LEAST_TURNED else 1.0)
    bend = WRIST_BEND - turned * math.copysign(1.0, way)
    return math.copysign(max(abs(shift), reach_at(arm.pitch) * math.tan(math.radians(bend))), way)


def offsets_bent(arm: Arm, shift: float) -> tuple[float, ...]:
    """How far beside a place the base may stand to come closer, the preferred first, m: not so that
    a wrist that was to be bent sideways comes into line again.

    Args:
        arm: the arm.
        shift: how far to the left of a spot that place is, m.
    """
    bent = arm.pitch >= STRAIGHT_PITCH
    return tuple(off for off in STAND_OFFSETS if not bent or off * shift >= 0.0)


LOAD_ROOM = 0.03
"""Kept free before a load, m: what swings in the fingers swings by 2 cm."""
LOAD_UNDER = 0.02
"""Kept free below it, m."""


def before_others(arm: Arm, load: Thing, aside: float) -> float:
    """How far ahead the base may be for a held load to pass before everything that stands there, m.

    Args:
        arm: the arm.
        load: what it holds.
        aside: where the base drives to, along its left direction, m.
    """
    far = load.extent_ahead()[1] - arm.ahead(arm.base)
    way = aside - arm.aside(arm.base)
    sides = [arm.aside(corner) for corner in load.corners]
    right, left = min(sides) + min(0.0, way) - LOAD_ROOM, max(sides) + max(0.0, way) + LOAD_ROOM
    limit = math.inf
    for other in other_things(arm):
        near, across = other.extent_ahead()[0], [arm.aside(corner) for corner in other.corners]
        beside = max(across) < right or min(across) > left
        over_or_under = other.highest < load.bottom - LOAD_UNDER or other.bottom > load.highest
        # What lies in a load comes along, what is behind the base stays behind it.
        lies_in = math.dist(other.centre[:2], load.middle[:2]) < load.sides()[0][1] / 2.0
        if not (beside or over_or_under or lies_in or near < arm.ahead(arm.base)):
            limit = min(limit, near - LOAD_ROOM - far)
    return limit
