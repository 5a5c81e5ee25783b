"""Where the base can stand: before furniture, whatever of it is open, so that arm and load have
room.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.base import LASTING
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.contacts import loads
from pytest_safemanip.expert.world.things import other_things, pieces
from pytest_safemanip.trace.elements import Joint
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
BODY = (
    (0.002, 0.39, -0.55, 0.15, 0.25),
    (0.30, 0.70, -0.17, 0.07, 0.12),
    (0.62, 1.00, -0.23, 0.105, 0.15),
)
"""The robot by height: from, to, its back and its front from the base's origin, half width, m:
wheels, column, and shoulder."""
BODY_REAR = (0.39, 0.55, 0.25)
"""The robot's wheels: their height, how far behind the base's origin they end, half width, m."""
STAND_OFFSETS = (0.0, 0.04, -0.04, 0.08, -0.08, 0.12, -0.12)
"""How far beside a thing the base may stand to come closer to it, the preferred first, m."""
BASE_ROOM = 0.02
"""Kept free in front of it, m."""
HAND_ROOM = 0.13
"""From the grip point to the far end of the hand, m."""
AHEAD, ASIDE = (0.0, -0.06, 0.05), (0.0, 0.1, -0.1, 0.2, -0.2)
"""How much farther ahead and to the left of its usual place the base may stand, m."""


def stand_before(arm: Arm, point: Array, distance: float) -> Motion:
    """Drive to where a point is at a distance ahead of the base, a little aside of it if what
    stands there is in the way.

    Args:
        arm: the arm.
        point: the point (2,) or (3,).
        distance: from the base to it, m.

    Raises:
        SkillFailed: if the base does not arrive.
    """
    ahead = arm.ahead(point) - distance + arm.choices.choose("base farther ahead", AHEAD)
    middle = arm.aside(point) + arm.choices.choose("base farther left", ASIDE)
    places = [middle + offset for offset in STAND_OFFSETS]
    closest = max(places, key=lambda place: min(ahead, nearest(arm, place, place)))
    yield from stand(arm, ahead, closest)


def stand(arm: Arm, ahead: float, aside: float) -> Motion:
    """Drive to a place, or as near to it as furniture lets the base come.

    Args:
        arm: the arm.
        ahead: along the base's forward direction, m.
        aside: along its left direction, m.

    Raises:
        SkillFailed: if the base does not arrive.
    """
    here = arm.ahead(arm.base), arm.aside(arm.base)
    passing = nearest(arm, min(here[1], aside), max(here[1], aside))
    if passing < here[0]:
        yield from arm.drive(arm.floor_point(passing, here[1]))
    along = min(passing, max(here[0], min(ahead, passing)))
    yield from arm.drive(arm.floor_point(min(along, here[0]), aside))
    nearer = min(ahead, nearest(arm, aside, aside))
    yield from arm.drive(arm.floor_point(nearer, aside))


def nearest(
    arm: Arm, right: float, left: float, past: float | None = None, *, but: str = ""
) -> float:
    """How far ahead the base may be anywhere between two places sideways, m.

    Args:
        arm: the arm.
        right: the one place, along its left direction, m.
        left: the other one.
        past: what ends nearer than this is behind it, m ahead; None for where the base is now.
        but: a joint, as ``entity/joint``; what it moves is left out.
    """
    along, across, height = _extents(arm, but)
    ahead = along[:, 1] > (arm.ahead(arm.base) if past is None else past)
    limit = math.inf
    for bottom, top, front, half in BODY_FRONT:
        within = (height[:, 0] < top) & (height[:, 1] > bottom) & ahead
        within &= _crosses(across, right - half, left + half)
        limit = min(limit, float(along[within, 0].min(initial=math.inf)) - front - BASE_ROOM)
    return limit


def passable(arm: Arm, right: float, left: float, ahead: float) -> bool:
    """Whether the base may drive from one place sideways to another, so far ahead."""
    along, across, height = _extents(arm)
    for bottom, top, back, front, half in BODY:
        met = (height[:, 0] < top) & (height[:, 1] > bottom)
        met &= _crosses(across, right - half, left + half)
        met &= (along[:, 0] < ahead + front + BASE_ROOM) & (along[:, 1] > ahead + back - BASE_ROOM)
        if met.any():
            return False
    return True


def rearmost(arm: Arm, right: float, left: float, before: float | None = None) -> float:
    """How far back the base may be anywhere between two places sideways, ahead, m.

    Args:
        arm: the arm.
        right: the one place, along its left direction, m.
        left: the other one.
        before: what ends nearer than this is behind it, m ahead; None for where the base is now.
    """
    top, rear, half = BODY_REAR
    along, across, height = _extents(arm)
    behind = height[:, 0] < top
    behind &= along[:, 1] < (arm.ahead(arm.base) if before is None else before)
    behind &= _crosses(across, right - half, left + half)
    return float(along[behind, 1].max(initial=-math.inf)) + rear + BASE_ROOM


def _crosses(across: Array, right: float, left: float) -> NDArray[np.bool_]:
    """Which extents (N, 2) along the base's left direction come near a range, m (N,)."""
    crossing: NDArray[np.bool_] = (across[:, 1] >= right - BASE_ROOM) & (
        across[:, 0] <= left + BASE_ROOM
    )
    return crossing


def _extents(arm: Arm, but: str = "") -> tuple[Array, Array, Array]:
    """Of every piece of furniture and its handles, from where to where it is along the base's
    forward and left directions and in height, m (N, 2) each.
    """

    def find() -> tuple[Array, Array, Array]:
        points = np.concatenate((solids(arm, but), handles(arm, but)))
        seen = points[..., :2] @ arm.forward, points[..., :2] @ arm.left, points[..., 2]
        along, across, height = (np.stack((x.min(axis=1), x.max(axis=1)), axis=1) for x in seen)
        return along, across, height

    state = (*(x.tobytes() for x in (arm.step.joint, arm.step.box_pose, arm.forward)), but)
    return arm.latest("where furniture extends to", state, find, LASTING)


def handles(arm: Arm, but: str = "") -> Array:
    """Corners of what is pulled on furniture (N, 8, 3).

    Args:
        arm: the arm.
        but: a joint, as ``entity/joint``; what is pulled to move that is left out.
    """
    boxes, poses = arm.scene.boxes, arm.step.box_pose
    found = [
        corners(np.asarray(poses[k], np.float64), box.half)
        for k, box in enumerate(boxes)
        if box.kind == "handle" and f"{box.entity}/{box.name}" != but
    ]
    return np.array(found).reshape(-1, 8, 3)


def solids(arm: Arm, but: str = "") -> Array:
    """Corners of every piece of furniture as it is now (N, 8, 3).

    Args:
        arm: the arm.
        but: a joint; what it moves is left out.
    """
    state = arm.step.joint[:, 0].tobytes(), but
    return arm.latest("furniture as it is", state, lambda: _solids(arm, but))


def solids_then(arm: Arm, joint: Joint, first: float, openness: float) -> Array:
    """Corners (N, 8, 3) of all that is solid when a part is as open as that, with what lies on it.

    Args:
        arm: the arm.
        joint: moves the part.
        first: openness now.
        openness: of the part then.
    """
    moved = [corners(p.pose, p.half)[None] for p in pieces(arm, joint, openness)]
    along, things = loads(arm, joint), list[Array]()
    for thing in other_things(arm):
        at = thing.corners
        if thing.entity in along:
            poses = np.concatenate((at, np.tile((1.0, 0.0, 0.0, 0.0), (len(at), 1))), axis=1)
            at = carried(joint, poses, np.full(len(at), openness - first))[:, :3]
        things.append(at[None])
    still = solids(arm, but=joint.key), handles(arm, joint.key)
    return np.concatenate((*still, *moved, *things))


def _solids(arm: Arm, but: str) -> Array:
    fixed, moving = arm.memory("furniture", lambda: _furniture(arm.scene))
    found = [fixed]
    for pose, half, index in moving:
        joint = arm.scene.joints[index]
        if joint.key != but:
            openness = np.asarray(arm.step.joint[index, 0], np.float64)
            found.append(corners(carried(joint, pose, openness), half)[None])
    return np.concatenate(found)


_Moving = tuple[Array, Array, int]


def _furniture(scene: Scene) -> tuple[Array, list[_Moving]]:
    """Corners of what stands fixed (N, 8, 3); pose at openness 0, half extents and joint of what
    moves.
    """
    fixed, moving = [np.zeros((0, 8, 3))], list[_Moving]()
    for surface in scene.surfaces:
        if scene.entity[surface.entity].kind == "object":
            continue
        pose, half = np.asarray(surface.pose, np.float64), np.asarray(surface.half)
        if surface.joint:
            moving.append((pose, half, scene.joint_index[surface.joint]))
        else:
            fixed.append(corners(pose, half)[None])
    return np.concatenate(fixed), moving
