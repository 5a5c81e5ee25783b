"""Driving with the arm as it is: drawn in, with what it holds, around what stands there."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pytest_safemanip.expert.robot.arm import FOLDED, Arm, Motion, SkillFailed, fold_arm
from pytest_safemanip.expert.robot.base import BASE_DEAD_BAND, CAREFUL
from pytest_safemanip.expert.robot.hand import finger_points, palm_points
from pytest_safemanip.expert.robot.kinematics import (
    ELBOW,
    HIGH,
    bodies,
    find,
    follow,
    links,
    solve,
    strain,
)
from pytest_safemanip.expert.robot.rotations import Array, rotation_vector
from pytest_safemanip.expert.world.contacts import contact_force
from pytest_safemanip.expert.world.room import Room
from pytest_safemanip.expert.world.routes import route
from pytest_safemanip.expert.world.standing import nearest, passable, rearmost
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.geometry import about, matrix

TUCKED_AHEAD, TUCKED_HEIGHT = (0.42, 0.36, 0.48, 0.54), (0.0, 0.1, 0.2, -0.1)
"""Base to a hand that is drawn in, m, and its height, from 1.2 m."""
LOAD_LOW = 1.0
"""Least height of the underside of what is carried, m: over counters."""
STEPS_ASIDE = (0.0, 0.04, -0.04, 0.08, -0.08)
"""How far to the left the base steps before it draws back, m."""
SCRAPES = 0.3
"""How far it draws back at least, m, for that to be looked at."""
THERE = 0.02
"""Distance along either axis of the base that counts as there, m."""
STEP, APART, FAR_APART = 0.05, 0.03, 0.08
"""Between places that are looked at, m, and room around the robot on its way: at least, and, where
a load swings from a place that the base may be beside, better."""
TUCKS = 0.2
"""Where it would draw back by more, the hand is drawn in first, m."""
MOST_BACK = 0.9
"""How far it draws back for that at most, m."""
LEANS, OFF_IT = 0.5, 0.06
"""Force with which the base leans on what it drives off first, N, and how far, m."""
SWINGS = 7
"""Postures that are looked at of a hand on its way to another pose."""
SQUEEZED = -0.025
"""How far the balls around links may be in something while the base drives up to a place, m: the
links are slimmer."""
EMPTY, LOADED, HANGS = 0.7, 0.6, 0.05
"""Largest command to the base without a load and with one; and from the grip point down to the
centre of mass of what swings in the fingers, m."""


def travel(
    arm: Arm, find: Callable[[], Array], load: Thing | None = None, near: float = THERE
) -> Motion:
    """Drive to a place: back until nothing is in the way, then along, then up to it.

    Args:
        arm: the arm.
        find: gives the place of the base (2,), for the arm as it is then.
        load: what it holds.
        near: distance along either axis of the base that counts as there, m.

    Raises:
        SkillFailed: if the base does not get there.
    """
    push = contact_force(arm, "base", LEANS)
    if float(np.linalg.norm(push)) >= LEANS:
        ways = (-arm.forward, arm.forward, arm.left, -arm.left)
        yield from drive(arm, arm.base + OFF_IT * max(ways, key=lambda way: way @ push), load)
    goal = find()
    aside = arm.aside(goal)
    if abs(aside - arm.aside(arm.base)) > STEP / 2.0:
        row = _row(arm, aside, load)
        if row is None or row < arm.ahead(arm.base) - TUCKS:
            yield from tuck(arm, load)
            goal = find()
            aside = arm.aside(goal)
            row = _row(arm, aside, load)
        if row is None or _blocked(arm, row, goal):
            for place, turn in route(arm, load, goal):
                yield from drive(arm, place, load)
                if turn:
                    yield from arm.turn(turn, gentle=load is not None)
            yield from drive(arm, goal, load, near)
            return
        if row < arm.ahead(arm.base):
            beside = arm.aside(arm.base) + _beside(arm, row)
            yield from drive(arm, arm.floor_point(arm.ahead(arm.base), beside), load)
            yield from drive(arm, arm.floor_point(row, beside), load)
        along = min(arm.ahead(arm.base), max(row, arm.ahead(goal)))
        yield from drive(arm, arm.floor_point(along, aside), load)
    yield from drive(arm, goal, load, near)


def step_aside(arm: Arm) -> Motion:
    """Step beside what the base would scrape along if it drew back.

    Raises:
        SkillFailed: if the base does not get there.
    """
    beside = arm.aside(arm.base) + _beside(arm, arm.ahead(arm.base) - SCRAPES)
    yield from drive(arm, arm.floor_point(arm.ahead(arm.base), beside))


def _beside(arm: Arm, row: float) -> float:
    """How far to the left the base steps before it draws back to a row, m ahead: beside what would
    scrape along it.
    """
    back = np.arange(arm.ahead(arm.base) - STEP, row, -STEP).tolist()
    for shift in STEPS_ASIDE:
        side = arm.aside(arm.base) + shift
        if all(passable(arm, side, side, ahead) for ahead in back):
            return shift
    return 0.0


def _blocked(arm: Arm, row: float, goal: Array) -> bool:
    """Whether furniture stands between a row, m ahead, and a place of the base (2,) before it."""
    aside, ahead = arm.aside(goal), arm.ahead(goal)
    if ahead > row:
        return nearest(arm, aside, aside, row) < ahead
    return rearmost(arm, aside, aside) > ahead


def drive(arm: Arm, goal: Array, load: Thing | None = None, near: float = THERE) -> Motion:
    """Move the base in a straight line, gently with a load, slowly if that hangs in the fingers.

    Args:
        arm: the arm.
        goal: base position on the floor (2,).
        load: what it holds.
        near: distance along either axis of the base that counts as there, m.

    Raises:
        SkillFailed: if the base does not arrive in time.
    """
    speed = EMPTY
    if load is not None:
        hangs = float(arm.position[2] - load.com[2]) > HANGS
        speed = CAREFUL if hangs else LOADED
    off = goal - arm.base
    if max(abs(off @ arm.forward), abs(off @ arm.left)) < near:
        return
    way = float(np.linalg.norm(off))
    steps = 80 + round(way / ((speed - BASE_DEAD_BAND) * arm.scene.control_period))
    gentle = load is not None
    yield from arm.drive(goal, tolerance=near, speed=speed, steps=steps, gentle=gentle)


def _row(arm: Arm, aside: float, load: Thing | None) -> float | None:
    """How far ahead the base may drive from where it is to a place along its left direction, m;
    None if it may not.
    """
    here = arm.ahead(arm.base)
    first, last = sorted((arm.aside(arm.base), aside))
    least = rearmost(arm, arm.aside(arm.base), arm.aside(arm.base))
    points, radii = shape(arm, load)
    own = [load.entity] if load else []
    ends = [arm.point(here + s, a, 1.1) for s in (0.3, 0.6) for a in (first, last)]
    room = Room.around(arm, ends, own)
    way = aside - arm.aside(arm.base)
    shifts = np.linspace(0.0, way, max(2, math.ceil(abs(way) / STEP)))
    for ahead in (here - np.arange(0.0, MOST_BACK, STEP)).tolist():
        if ahead < least:
            break
        if passable(arm, first, last, ahead):
            offsets = np.column_stack((np.full(len(shifts), ahead - here), shifts, 0.0 * shifts))
            if (room.away(points + offsets[:, None], radii) > APART).all():
                return float(ahead)
    return None


def shape(arm: Arm, load: Thing | None) -> tuple[Array, Array]:
    """Balls that the arm, as it is, and what it holds fit into: their middles (B, 3), from the
    base's heading, and their radii (B,), m.
    """
    balls, radii, _ = swing(arm, arm.position, arm.rotation, load)
    return balls[0], radii


def swing(arm: Arm, point: Array, hand: Array, load: Thing | None) -> tuple[Array, Array, bool]:
    """Balls that arm, hand and load fit into, in some places of the hand's way from where it is to
    another pose: their middles (N, B, 3), from the base's heading, and their radii (B,), m; and
    whether no joint comes to its limit.

    Args:
        arm: the arm; the base stays.
        point: grip point (3,).
        hand: orientation (3, 3).
        load: what it holds.
    """
    points, hands, joints, there = _between(arm, point, hand)
    middles, radii = bodies(joints)
    own = [palm_points(), finger_points(float(arm.step.gripper[0]))]
    if load is not None:
        own.append((load.corners - arm.position) @ arm.rotation)
    local = np.concatenate(own)
    moved = (local @ hands.transpose(0, 2, 1) + points[:, None]) @ arm.frame
    balls = np.concatenate((middles + _shoulder(arm), moved), axis=1)
    return balls, np.concatenate((radii, np.zeros(len(local)))), there


def _shoulder(arm: Arm) -> Array:
    """Where the arm begins, from the base's heading (3,): on the floor, the torso down."""
    return np.append(arm.base @ arm.frame[:2, :2], arm.torso)


def arrives(arm: Arm, point: Array, hand: Array) -> bool:
    """Whether the hand gets from where it is to another pose with no joint at its limit."""
    return _between(arm, point, hand)[-1]


def joints_now(arm: Arm) -> Array:
    """The arm's joint angles (1, 7)."""
    point, hand = arm.position @ arm.frame - _shoulder(arm), arm.frame.T @ arm.rotation
    values = np.asarray(arm.step.qpos, np.float64)
    first = arm.memory("where the arm's joints are", lambda: find(values, point, hand))
    if first is None:
        return solve(point[None], hand[None])[0]
    return values[None, first : first + 7]


def check_bent(arm: Arm) -> None:
    """See whether the elbow is bent the way that draws the hand back.

    Raises:
        SkillFailed: if it is not.
    """
    if joints_now(arm)[0, ELBOW] > HIGH[ELBOW]:
        raise SkillFailed("the arm is straight, and would not bend again")


def _between(arm: Arm, point: Array, hand: Array) -> tuple[Array, Array, Array, bool]:
    """Grip points (N, 3), orientations (N, 3, 3) and joint angles (N, 7) from where the hand is to
    another pose, and whether it gets there: straight, or else as the joints turn evenly.
    """
    turn = rotation_vector(hand @ arm.rotation.T)
    angle = float(np.linalg.norm(turn))
    axis = turn / max(angle, 1e-9)
    shares = np.linspace(0.0, 1.0, SWINGS)[:, None]
    points = arm.position + shares * (point - arm.position)
    turns = [matrix(about(axis, float(share) * angle)) for share in shares[:, 0]]
    hands = np.array(turns) @ arm.rotation
    frame, shoulder = arm.frame, _shoulder(arm)
    seen, turned = points @ frame - shoulder, frame.T @ hands
    start = joints_now(arm)
    joints, there = follow(start, seen[None], turned[None])
    if there[0]:
        return points, hands, joints[0], True
    goal, solved = solve(seen[-1:], turned[-1:])
    if not solved[0]:
        return points, hands, joints[0], False
    even = start + shares * (goal - start)
    origins, frames = links(even)
    return (origins[:, 7] + shoulder) @ frame.T, frame @ frames[:, 7], even, True


def swing_to(arm: Arm, point: Array, hand: Array, speed: float) -> Motion:
    """Bring the hand to another pose: it turns as it goes, and not before.

    Args:
        arm: the arm.
        point: grip point (3,).
        hand: orientation (3, 3).
        speed: share of the top one.

    Raises:
        SkillFailed: if it does not arrive.
    """
    points, hands, _, _ = _between(arm, point, hand)
    for between, turned in zip(points[1:-1], hands[1:-1], strict=True):
        yield from arm.move(
            between,
            turned,
            tolerance=0.06,
            turn_tolerance=0.25,
            speed=speed,
            steps=25,
            required=False,
        )
    yield from arm.move(point, hand, tolerance=0.03, turn_tolerance=0.1, speed=speed, steps=120)


def swing_back(
    arm: Arm, point: Array, hand: Array, base: Array, torso: float, out: Array, load: Thing | None
) -> Array:
    """How far off a place the base stands for the hand to be moved to a pose there (2,), m.

    Args:
        arm: the arm.
        point: grip point (3,), the base at that place.
        hand: orientation (3, 3).
        base: the place (2,).
        torso: how far it is raised before, m.
        out: how far off the place it stands at least (2,), m; farther it stands in line with that.
        load: what it holds.

    Raises:
        SkillFailed: if a joint would come to its limit on the way.
    """
    shift = np.append(arm.base - base, -torso)
    balls, radii, there = swing(arm, point + shift, hand, load)
    if not there:
        raise SkillFailed("the arm would come to the end of a joint")
    return _back(arm, base, point, balls - shift @ arm.frame, radii, out, load, drives_up=True)


def lowering_back(arm: Arm, by: float, out: Array, load: Thing | None) -> Array:
    """How far off where it is the base stands for the torso to be lowered there (2,), m.

    Args:
        arm: the arm.
        by: how far, m.
        out: how far off at least (2,), m; farther it stands in line with that.
        load: what it holds.
    """
    points, radii = shape(arm, load)
    down = np.linspace(0.0, by, SWINGS)[:, None, None] * (0.0, 0.0, 1.0)
    return _back(arm, arm.base, arm.position, points - down, radii, out, load)


def _back(
    arm: Arm,
    base: Array,
    point: Array,
    balls: Array,
    radii: Array,
    out: Array,
    load: Thing | None,
    drives_up: bool = False,
) -> Array:
    """How far off a place at least the base stands for some balls to be free (2,), m, or as free as
    they come before it meets what is behind it. If it drives up to the place from there, then no
    farther than the last posture's links have room on the way, if they have room at its end.
    """
    room = Room.around(arm, [point], [load.entity] if load else [])
    length = float(np.linalg.norm(out))
    ahead, frame = out / length if length else -arm.forward, arm.frame
    found, wanted = list[tuple[float, float]](), FAR_APART if load else APART

    is_link = radii > 0.0

    def squeezed(back: float) -> bool:
        off = np.append(back * ahead, 0.0) @ frame
        return bool((room.away(balls[-1, is_link] + off, radii[is_link]) < SQUEEZED).any())

    foreseen = drives_up and not squeezed(length)
    for back in np.arange(length, MOST_BACK, STEP).tolist():
        place = base + back * ahead
        aside = arm.aside(place)
        if back > length and arm.ahead(place) < rearmost(arm, aside, aside, arm.ahead(base)):
            break
        if back > length and foreseen and squeezed(back):
            break
        off = np.append(back * ahead, 0.0) @ frame
        found.append((back, float(room.away(balls + off, radii).min())))
        if found[-1][1] > wanted:
            break
    near = [back for back, away in found if away > APART]
    best = max(found, key=lambda place: place[1], default=(length, 0.0))
    chosen = best[0] if best[1] > wanted or not near else near[0]
    return np.asarray(chosen * ahead)


def tucked(arm: Arm, load: Thing | None) -> Array:
    """Where the hand is drawn in to before the base, turned as it is (3,)."""
    low = LOAD_LOW + float(arm.position[2]) - load.bottom if load else 0.0
    spots = np.array(
        [(ahead, 0.0, max(1.2 + z, low)) for z in TUCKED_HEIGHT for ahead in TUCKED_AHEAD]
    )
    hands = np.tile(arm.frame.T @ arm.rotation, (len(spots), 1, 1))
    joints, there = solve(spots - (0.0, 0.0, arm.torso), hands)
    tired = strain(joints) + 2.0 * ~there + 0.01 * np.arange(len(spots))
    best = int(np.argmin(tired))
    return arm.before(float(spots[best, 0]), float(spots[best, 2]))


def tuck(arm: Arm, load: Thing | None) -> Motion:
    """Draw the hand in before the base, turned as it is.

    Args:
        arm: the arm.
        load: what it holds.

    Raises:
        SkillFailed: if the base does not get to where there is room for that.
    """
    spot = tucked(arm, load)
    off = swing_back(arm, spot, arm.rotation, arm.base, 0.0, np.zeros(2), load)
    yield from drive(arm, arm.base + off, load)
    yield from swing_to(arm, tucked(arm, load), arm.rotation, LOADED if load else 1.0)


def fold(arm: Arm) -> Motion:
    """Fold the arm, the base so far back that there is room for that.

    Raises:
        SkillFailed: if the base does not get there.
    """
    far, height, pitch = FOLDED
    spot, hand = arm.before(far, height), arm.pointing(pitch)
    off = swing_back(arm, spot, hand, arm.base, 0.0, np.zeros(2), None)
    yield from drive(arm, arm.base + off)
    yield from fold_arm(arm, required=False)
