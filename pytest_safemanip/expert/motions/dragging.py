"""Dragging: what the hand has no room to grasp is drawn off the wall, from behind."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from pytest_safemanip.expert.motions.approaching import draw_back, go_before
from pytest_safemanip.expert.motions.hand_ways import HandWays
from pytest_safemanip.expert.motions.handholds import LOW, SHARES, hands, outline
from pytest_safemanip.expert.motions.poses import Pose, Reach, Ways
from pytest_safemanip.expert.motions.reaching import SQUEEZED, Reaching
from pytest_safemanip.expert.robot.arm import Arm, Motion, NoWay
from pytest_safemanip.expert.robot.hand import (
    FINGER_SIDE,
    FINGERTIP,
    finger_points,
    palm_points,
)
from pytest_safemanip.expert.robot.kinematics import bodies, solve
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.room import Room
from pytest_safemanip.expert.world.things import Thing

FARS = (0.14, 0.1, 0.07, 0.04)
"""How far something is dragged, m; as far as the arm has room."""
BEHIND, OFF, DEEP = 0.003, 0.004, (0.012, 0.02, 0.03)
"""From a thing to the closed fingers behind it, from them down to what it lies on, and how far they
reach below its top, m."""
SLOWLY = 0.2
"""Share of the hand's top speed at which it drags."""


def drag(arm: Arm, thing: Thing) -> Motion:
    """Drag something towards the robot, with closed fingers behind it.

    Args:
        arm: the arm.
        thing: the thing.

    Raises:
        SkillFailed: if the hand has no room behind it.
    """
    back = -np.append(arm.forward, 0.0)
    room = Room.around(arm, [thing.centre, thing.centre + FARS[0] * back], [thing.entity])
    reaching = Reaching(arm, HandWays(arm, room, Ways(), squeezed=True), SQUEEZED)
    found = [
        (reach, far * back)
        for reach in reaching.find(list(_behind(arm, thing)))
        for far in [f for f in FARS if _has_room(arm, room, reach, f * back)][:1]
    ]
    if not found:
        raise NoWay(f"the hand has no room at {thing.entity}")
    reach, offset = arm.choices.choose("dragged", found)
    yield from go_before(arm, reach)
    goal, hand = reach.pose.point, reach.pose.hand
    yield from arm.move(goal, hand, tolerance=0.006, speed=0.5, steps=60, exact=True)
    yield from arm.move(goal + offset, hand, speed=SLOWLY, required=False)
    yield from arm.move(arm.position + reach.leave, hand, tolerance=0.02, steps=50, required=False)
    yield from draw_back(arm, reach)


def _behind(arm: Arm, thing: Thing) -> Iterator[Pose]:
    """How the hand may be with closed fingers behind a thing that would not tip over, as the robot
    sees it.
    """
    if thing.height > LOW * thing.sides()[0][1]:
        return
    ahead, left = np.append(arm.forward, 0.0), np.append(arm.left, 0.0)
    (narrow, width), (long, length) = thing.sides()
    if abs(long @ ahead) > abs(narrow @ ahead):
        narrow, width, long, length = long, length, narrow, width
    depth = width / 2.0 / abs(float(narrow @ ahead)) + FINGER_SIDE + BEHIND
    lows = [max(thing.bottom + OFF, thing.highest - deep) for deep in DEEP]
    for place, low in product(SHARES, dict.fromkeys(lows)):
        tip = thing.centre + place * length * long + depth * ahead
        for tilt, _, hand in hands(arm, left):
            points = finger_points(0.0) @ hand.T
            point = tip - FINGERTIP * hand[:, 2]
            point[2] = low - points[:, 2].min()
            if thing.around(np.concatenate((points, palm_points() @ hand.T)) + point).any():
                continue
            family, load = ("behind", tilt, low), outline(thing)
            cost = abs(tilt) / 100.0 - abs(place)
            yield Pose(point, hand, 0.0, cost, load, family, place, (family, place))


def _has_room(arm: Arm, room: Room, reach: Reach, offset: Array) -> bool:
    """Whether the arm's links have room when the hand has dragged something."""
    seen = np.append(reach.base, reach.torso) @ arm.frame
    point = (reach.pose.point + offset) @ arm.frame - seen
    joints, there = solve(point[None], (arm.frame.T @ reach.pose.hand)[None])
    middles, radii = bodies(joints)
    return bool(there[0]) and float(room.away(middles[0] + seen, radii).min()) > SQUEEZED
