"""Resting: whether what was let go stays where it was put, and would even if it were nudged."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.handholds import outline
from pytest_safemanip.expert.motions.poses import Reach
from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.contacts import borne_at, touching
from pytest_safemanip.expert.world.room import Room
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.geometry import matrix
from pytest_safemanip.trace.planar import hull_margin

BELOW_RIM = 0.01
"""How far below a vessel's rim what lies in it reaches at least, m."""
STANDS, TIPPED, LEANS = 0.06, math.radians(15.0), math.radians(60.0)
"""How far from its spot something may come to rest, m, how far from upright, and how far what is no
higher than wide may lean on what lies beside it, rad."""
STEADY = 0.006
"""How far a centre of mass is within what bears it, m."""
LEVELS = np.linspace(-0.01, 0.01, 9)
"""Heights that count as the height of the points that bear something, counted from there, m: what
reaches one of them would bear it, too, if it were nudged."""
CATCHES = 0.01
"""How far beside these what would catch something is that leans, m."""


def check_inside(arm: Arm, thing: Thing, vessel: Thing) -> None:
    """See whether something lies in a vessel, and not on its rim, nor only on what lies in it:
    RoboCasa wants the two to touch.

    Raises:
        SkillFailed: if it does not.
    """
    beside = any(
        abs(float((thing.centre - vessel.middle) @ axis)) > width / 2.0
        for axis, width in vessel.sides_about_middle()
    )
    if (
        beside
        or thing.bottom > vessel.highest - BELOW_RIM
        or vessel.entity not in touching(arm, thing)
    ):
        raise SkillFailed(f"{thing.entity} does not lie in {vessel.entity}")
    if not len(borne_at(arm, thing)):
        raise SkillFailed(f"{thing.entity} is wedged in {vessel.entity}")


def check_stays(thing: Thing, reach: Reach, up: Array) -> None:
    """See whether something stays where it was put.

    Args:
        thing: the thing.
        reach: how it was put there.
        up: its axis that pointed upwards (3,), in its own frame.

    Raises:
        SkillFailed: if it does not.
    """
    now = outline(thing)
    off = float(np.linalg.norm((now - reach.pose.load[: len(now)]).mean(axis=0)[:2]))
    if off > STANDS:
        raise SkillFailed(f"{thing.entity} came to rest {100 * off:.0f} cm off its place")
    tilt = math.acos(float(np.clip((matrix(thing.pose[3:]) @ up)[2], -1.0, 1.0)))
    reaches = [thing.reach(axis) for axis in np.asarray(matrix(thing.pose[3:])).T]
    height = reaches.pop(int(np.argmax(np.abs(up))))
    if tilt > (TIPPED if height > min(reaches) else LEANS):
        raise SkillFailed(f"{thing.entity} came to rest {math.degrees(tilt):.0f} degrees askew")


def check_steady(arm: Arm, thing: Thing) -> None:
    """See whether something would stay if it were nudged: its centre of mass is well between the
    points that bear it, or something is below it all around. What leans, and has it beside them,
    is not balanced on them, and may be caught by what is a little lower.

    Raises:
        SkillFailed: if it would not.
    """
    points, com = borne_at(arm, thing), thing.com
    if not len(points):
        raise SkillFailed(f"{thing.entity} is wedged, and rests on nothing")
    margin = hull_margin(points[:, :2], com[:2])
    if margin >= STEADY:
        return
    turns = np.arange(0.0, 2.0 * math.pi, math.pi / 4.0)
    around = com + STEADY * np.stack((np.cos(turns), np.sin(turns), 0.0 * turns), axis=1)
    around[:, 2] = points[:, 2].mean()
    room = Room.around(arm, list(around), [thing.entity])
    columns = around[:, None] + LEVELS[:, None] * (0.0, 0.0, 1.0)
    away = room.exactly((columns @ arm.frame).reshape(-1, 3)).reshape(len(around), -1)
    if (away.min(axis=1) > (CATCHES if margin < -STEADY else 0.0)).any():
        raise SkillFailed(f"{thing.entity} came to rest at an edge")
