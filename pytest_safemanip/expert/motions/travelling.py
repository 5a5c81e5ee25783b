"""Driving with the arm as it is: drawn in, with what it holds, around what stands there."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.base import BASE_DEAD_BAND, CAREFUL
from pytest_safemanip.expert.robot.hand import finger_points, palm_points
from pytest_safemanip.expert.robot.kinematics import bodies, solve, strain
from pytest_safemanip.expert.robot.rotations import Array, rotation_vector
from pytest_safemanip.expert.world.room import Room, heading
from pytest_safemanip.expert.world.standing import nearest, rearmost
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.geometry import about, matrix

TUCKED_AHEAD, TUCKED_HEIGHT = (0.42, 0.36, 0.48, 0.54), (0.0, 0.1, 0.2, -0.1)
"""Base to a hand that is drawn in, m, and its height, from 1.2 m."""
LOAD_LOW = 1.0
"""Least height of the underside of what is carried, m: over counters."""
THERE = 0.02
"""Distance along either axis of the base that counts as there, m."""
STEP, APART = 0.05, 0.03
"""Between places that are looked at, m, and room around the robot on its way, m."""
TUCKS = 0.2
"""Where it would draw back by more, the hand is drawn in first, m."""
MOST_BACK = 0.9
"""How far it draws back for that at most, m."""
SWINGS = 5
"""Postures that are looked at of a hand on its way to another pose."""
EMPTY, LOADED, HANGS = 0.7, 0.6, 0.05
"""Largest command to the base without a load and with one; and from the grip point down to the
centre of mass of what swings in the fingers, m."""


def travel(arm: Arm, goal: Array, load: Thing | None = None) -> Motion:
    """Drive to a place: back until nothing is in the way, then along, then up to it.

    Args:
        arm: the arm.
        goal: place of the base (2,).
        load: what it holds.

    Raises:
        SkillFailed: if the base does not get there.
    """
    aside = arm.aside(goal)
    if abs(aside - arm.aside(arm.base)) > STEP / 2.0:
        row = _row(arm, aside, load)
        if row < arm.ahead(arm.base) - TUCKS:
            yield from tuck(arm, load)
            row = _row(arm, aside, load)
        if row < arm.ahead(arm.base):
            yield from drive(arm, arm.floor_point(row, arm.aside(arm.base)), load)
        along = min(arm.ahead(arm.base), max(row, arm.ahead(goal)))
        yield from drive(arm, arm.floor_point(along, aside), load)
    yield from drive(arm, goal, load)


def drive(arm: Arm, goal: Array, load: Thing | None = None) -> Motion:
    """Move the base in a straight line, gently with a load, slowly if that hangs in the fingers.

    Args:
        arm: the arm.
        goal: base position on the floor (2,).
        load: what it holds.

    Raises:
        SkillFailed: if the base does not arrive in time.
    """
    speed = EMPTY
    if load is not None:
        hangs = float(arm.position[2] - load.com[2]) > HANGS
        speed = CAREFUL if hangs else LOADED
    off = goal - arm.base
    if max(abs(off @ arm.forward), abs(off @ arm.left)) < THERE:
        return
    way = float(np.linalg.norm(off))
    steps = 80 + round(way / ((speed - BASE_DEAD_BAND) * arm.scene.control_period))
    yield from arm.drive(goal, speed=speed, steps=steps, gentle=load is not None)


def _row(arm: Arm, aside: float, load: Thing | None) -> float:
    """How far ahead the base may drive from where it is to a place along its left direction, m."""
    here = arm.ahead(arm.base)
    first, last = sorted((arm.aside(arm.base), aside))
    most = min(here, nearest(arm, first, last))
    points, radii = shape(arm, load)
    own = [load.entity] if load else []
    ends = [arm.point(here + s, a, 1.1) for s in (0.3, 0.6) for a in (first, last)]
    room = Room.around(arm, ends, own)
    way = aside - arm.aside(arm.base)
    shifts = np.linspace(0.0, way, max(2, math.ceil(abs(way) / STEP)))
    backs = most - np.arange(0.0, MOST_BACK, STEP)
    for ahead in backs.tolist():
        offsets = np.column_stack((np.full(len(shifts), ahead - here), shifts, 0.0 * shifts))
        if (room.away(points + offsets[:, None], radii) > APART).all():
            return float(ahead)
    return float(max(backs[-1], rearmost(arm, first, last)))


def shape(arm: Arm, load: Thing | None) -> tuple[Array, Array]:
    """Balls that the arm, as it is, and what it holds fit into: their middles (B, 3), from the
    base's heading, and their radii (B,), m.
    """
    middles, radii = postures(arm, arm.position[None], arm.rotation[None], load)
    return middles[0], radii


def postures(arm: Arm, points: Array, hands: Array, load: Thing | None) -> tuple[Array, Array]:
    """Likewise for other poses of the hand, the base where it is: middles (K, B, 3).

    Args:
        arm: the arm.
        points: grip points (K, 3).
        hands: orientations (K, 3, 3).
        load: what it holds.
    """
    frame = heading(arm)
    base = np.append(arm.base @ frame[:2, :2], arm.torso)
    joints, _ = solve(points @ frame - base, frame.T @ hands)
    middles, radii = bodies(joints)
    own = [palm_points(), finger_points(float(arm.step.gripper[0]))]
    if load is not None:
        own.append((load.corners - arm.position) @ arm.rotation)
    local = np.concatenate(own)
    held = (local @ hands.transpose(0, 2, 1) + points[:, None]) @ frame
    found = np.concatenate((middles + base, held), axis=1)
    return found, np.concatenate((radii, np.zeros(len(local))))


def swing_back(
    arm: Arm,
    point: Array,
    hand: Array,
    base: Array,
    torso: float,
    least: float,
    load: Thing | None,
) -> float:
    """How far before a place the base stands for the hand to be moved to a pose there, m.

    Args:
        arm: the arm.
        point: grip point (3,), the base at that place.
        hand: orientation (3, 3).
        base: the place (2,).
        torso: how far it is raised before, m.
        least: how far back it stands at least, m.
        load: what it holds.
    """
    frame, shift = heading(arm), np.append(arm.base - base, -torso)
    turn = rotation_vector(hand @ arm.rotation.T)
    angle = float(np.linalg.norm(turn))
    axis = turn / max(angle, 1e-9)
    shares = np.linspace(0.0, 1.0, SWINGS)
    points = np.array([arm.position + k * (point + shift - arm.position) for k in shares])
    hands = np.array([matrix(about(axis, k * angle)) @ arm.rotation for k in shares])
    balls, radii = postures(arm, points, hands, load)
    room = Room.around(arm, [point], [load.entity] if load else [])
    there = np.append(base - arm.base, torso) @ frame
    best = least, -math.inf
    for back in np.arange(least, MOST_BACK, STEP).tolist():
        away = float(room.away(balls + there - (back, 0.0, 0.0), radii).min())
        if away > APART:
            return float(back)
        best = max(best, (back, away), key=lambda found: found[1])
    return best[0]


def tucked(arm: Arm, load: Thing | None) -> Array:
    """Where the hand is drawn in to before the base, turned as it is (3,)."""
    frame = heading(arm)
    low = LOAD_LOW + float(arm.position[2]) - load.bottom if load else 0.0
    spots = np.array(
        [(ahead, 0.0, max(1.2 + z, low)) for z in TUCKED_HEIGHT for ahead in TUCKED_AHEAD]
    )
    hands = np.tile(frame.T @ arm.rotation, (len(spots), 1, 1))
    joints, there = solve(spots - (0.0, 0.0, arm.torso), hands)
    tired = strain(joints) + 2.0 * ~there + 0.01 * np.arange(len(spots))
    best = int(np.argmin(tired))
    return arm.before(float(spots[best, 0]), float(spots[best, 2]))


def tuck(arm: Arm, load: Thing | None = None) -> Motion:
    """Draw the hand in before the base, turned as it is.

    Args:
        arm: the arm.
        load: what it holds.

    Raises:
        SkillFailed: if the base does not get to where there is room for that.
    """
    spot = tucked(arm, load)
    back = swing_back(arm, spot, arm.rotation, arm.base, 0.0, 0.0, load)
    if back:
        yield from drive(arm, arm.base - back * arm.forward, load)
    yield from arm.move(
        tucked(arm, load),
        tolerance=0.04,
        turn_tolerance=0.2,
        speed=LOADED if load else 1.0,
        steps=100,
        required=False,
    )
