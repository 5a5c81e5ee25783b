"""Turning the base on the spot, or where there is room for it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice

import numpy as np

from pytest_safemanip.expert.motions.travelling import (
    APART,
    MOST_BACK,
    STEP,
    SWINGS,
    shape,
    travel,
    tuck,
)
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed
from pytest_safemanip.expert.robot.rotations import Array, about_z
from pytest_safemanip.expert.world.room import FAR, Room
from pytest_safemanip.expert.world.routes import TURNS_ABOUT, floor, route
from pytest_safemanip.expert.world.standing import nearest, rearmost, solids
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.geometry import multiply

WHEELS, SWUNG = 0.43, 0.11
"""From the middle of the base to the corners of its wheels, and how far they come beyond its front
and back, and room, m."""
GRID, FLOOR, SHOULDERS, TRIED = 0.15, 0.002, 1.0, 8
"""Between places farther off at which the base may turn, m; heights between which furniture is in
its way, m; and to how many of these places a route is searched for."""
NEAR_ENOUGH = 0.35
"""An empty hand that is no farther ahead of the base than this need not be drawn in, m."""
TURNS_BESIDE = (0.0, 0.15, -0.15, 0.3, -0.3, 0.5, -0.5)
"""How far to the left of where it is it may turn, m."""


@contextmanager
def facing(arm: Arm, degrees: float) -> Iterator[None]:
    """See everything as if the base were turned to the left where it stands."""
    step, straight = arm.step, arm.straight_down
    half = math.radians(degrees) / 2.0
    turn = np.array((math.cos(half), 0.0, 0.0, math.sin(half)))
    pose = np.array(step.base_pose)
    pose[3:] = multiply(turn, pose[3:])
    arm.step = replace(step, base_pose=pose)
    arm.straight_down = about_z(degrees) @ straight
    try:
        yield
    finally:
        arm.step, arm.straight_down = step, straight


def turn_base(arm: Arm, degrees: float, load: Thing | None) -> Motion:
    """Turn the base on the spot, where there is room for it and what it holds.

    Args:
        arm: the arm.
        degrees: to the left.
        load: what it holds.

    Raises:
        SkillFailed: if it does not get there.
    """
    if load is not None or arm.hand_ahead > NEAR_ENOUGH:
        yield from tuck(arm, load)
    yield from travel(arm, lambda: turning_place(arm, degrees, load), load)
    yield from arm.turn(degrees, gentle=load is not None)


def turning_place(arm: Arm, degrees: float, load: Thing | None) -> Array:
    """Where the base can be turned, as near as possible (2,).

    Args:
        arm: the arm.
        degrees: to the left.
        load: what it holds.

    Raises:
        SkillFailed: if it cannot.
    """
    points, radii = shape(arm, load)
    middle = np.append(arm.base - TURNS_ABOUT * arm.forward, 0.0) @ arm.frame
    angles = np.linspace(0.0, degrees, SWINGS + 2).tolist()
    swept = middle + np.concatenate([(points - middle) @ about_z(a).T for a in angles])
    ahead, aside = middle[:2].tolist()
    around = [arm.point(ahead + i, aside + j, 1.1) for i, j in ((-0.5, -1.0), (0.8, 1.0))]
    room = Room.around(arm, around, [load.entity] if load else [])
    here, beside = arm.ahead(arm.base), arm.aside(arm.base)
    for shift in TURNS_BESIDE:
        aside = beside + shift
        first = min(here, nearest(arm, aside - WHEELS, aside + WHEELS) - SWUNG)
        last = max(rearmost(arm, aside - WHEELS, aside + WHEELS) + SWUNG, here - MOST_BACK)
        for ahead in np.arange(first, last, -STEP).tolist():
            off = np.array((ahead - here, shift, 0.0))
            if room.away(swept + off, np.tile(radii, len(angles))).min() > APART:
                return arm.floor_point(ahead, aside)
    for place in islice(_elsewhere(arm, middle, swept, np.tile(radii, len(angles)), load), TRIED):
        try:
            route(arm, load, place)
        except SkillFailed:
            continue
        return place
    raise SkillFailed("there is no room for the base to turn")


def _elsewhere(
    arm: Arm, middle: Array, swept: Array, radii: Array, load: Thing | None
) -> Iterator[Array]:
    """Places of the base on the whole floor at which it has room to turn (2,), the nearest first.

    Args:
        arm: the arm.
        middle: about which the base turns where it is, seen from its heading (3,).
        swept: middles of balls around arm and load as they turn there (B, 3).
        radii: of the balls (B,), m.
        load: what it holds.
    """
    low, high = floor(arm)
    places = np.stack(np.meshgrid(*map(np.arange, low, high, (GRID, GRID))), axis=-1)
    offs = places.reshape(-1, 2) - arm.level(arm.base)
    furniture = solids(arm) @ arm.frame
    heights = furniture[:, :, 2]
    furniture = furniture[(heights.min(axis=1) < SHOULDERS) & (heights.max(axis=1) > FLOOR)]
    least, most = furniture.min(axis=1)[:, :2], furniture.max(axis=1)[:, :2]
    for off in offs[np.argsort(np.linalg.norm(offs, axis=1))]:
        at = middle[:2] + off
        apart = np.linalg.norm(np.maximum(0.0, np.maximum(least - at, at - most)), axis=1)
        if apart.min() < WHEELS + APART:
            continue
        balls = swept + np.append(off, 0.0)
        (first, right, _), (last, left, _) = balls.min(axis=0), balls.max(axis=0)
        around = [arm.point(first, right, 1.1), arm.point(last, left, 1.1)]
        room = Room.around(arm, around, [load.entity] if load else [])
        gaps = room.exactly(balls)
        if not ((gaps < radii + APART) & (gaps < FAR)).any():
            yield np.asarray(arm.base + arm.frame[:2, :2] @ off)
