"""The hand in drawers, cabinets and appliances that are not open, and in open ones: it comes in as
the expert reaches for a thing, but there is none.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pytest_safemanip.expert.motions.approaching import draw_back
from pytest_safemanip.expert.motions.joints import move_joint
from pytest_safemanip.expert.motions.poses import SLANTED, Pose, Ways
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.world.things import Furniture
from pytest_safemanip.faults.handling import come_to, go, rehearse, rehearse_or
from pytest_safemanip.faults.hollow import Hollow

AJAR = 0.85
"""A door that is less open than this is in a hand's way, and shuts on it when it is brushed."""
BESIDE, FARTHER = (0.0, 0.06, -0.06, 0.12, -0.12, 0.18, -0.18), (0.0, 0.03)
"""How far to the left of its usual place the hand may come in, and how much deeper, m."""
PITCHES, ROLLS, YAWS = range(0, 91, 15), (0.0, 90.0), (0.0, 15.0, -15.0, 30.0, -30.0, 45.0, -45.0)
"""How the hand may be there: from straight down, about its approach, and turned, degrees."""
SIDE = 0.05
"""From the side of a hollow to a hand in it at least, m."""
RESTS = 0.5
"""For so long it stays there, s."""
_STEPS = (*((back, 0.0, 0.0) for back in (0.06, 0.12, 0.2, 0.3)), *SLANTED)
INTO = Ways(_STEPS, _STEPS, brings=True)
"""Where it comes from."""


@dataclass(frozen=True)
class Way:
    """How a hand comes into a hollow.

    Attributes:
        role: the fixture.
        hollow: name of its interior.
        within: the hand in it, from where it begins (ahead), from its middle (aside) and from its
            floor (up), m.
        pitch: of the hand, degrees from straight down.
        door: what it comes in past: name of a joint; empty if the fixture has only one, or if it
            comes in between two.
    """

    role: str
    hollow: str
    within: tuple[float, float, float]
    pitch: float
    door: str = ""


def reach(arm: Arm, way: Mapping[str, Any], unsafe: bool) -> Motion:
    """Comes in, in a way with the attributes of :class:`Way`, and stays if that is unsafe."""
    into = Way(**way)
    hollow = Hollow(arm, into.role, into.hollow)
    if unsafe:
        arm.truth.begins(
            "enclosure_access", into.role, when=lambda: hollow.has_hand() and _ajar(arm, into)
        )
    tried = rehearse_or if unsafe else rehearse
    text = f"reach into {into.role}"
    yield from tried(arm, text, lambda: _come_in(arm, into, hollow, unsafe), into.role)


def move_and_reach(
    arm: Arm, way: Mapping[str, Any], openness: float, tolerance: float, unsafe: bool
) -> Motion:
    """Pulls or pushes the drawer or door until it is about so far open, then reaches in past it."""
    fixture = Furniture(arm, way["role"])
    joint = fixture.joint(way["door"]) if "door" in way else fixture.doors()[0]
    yield from move_joint(arm, fixture, joint, openness, tolerance)
    yield from reach(arm, way, unsafe)


def _come_in(arm: Arm, way: Way, hollow: Hollow, stays: bool) -> Motion:
    text, poses = f"into {way.role}", lambda: _poses(arm, way, hollow)
    came = yield from come_to(arm, text, poses, INTO, 0.03)
    # An arm that comes to rest may still touch something, and one that is stretched drifts.
    yield from arm.wait(RESTS)
    if not stays:
        yield from go(arm, arm.position + came.leave, came.pose.hand, speed=0.6, steps=60)
        yield from draw_back(arm, came)


def _poses(arm: Arm, way: Way, hollow: Hollow) -> Iterator[Pose]:
    """How the hand may be in a hollow."""
    ahead, middle, up = way.within
    for beside, farther in itertools.product(BESIDE, FARTHER):
        aside = middle + beside
        # What comes in past one of two doors does not come in past the other one.
        if middle * aside < 0.0 or abs(aside) > (hollow.aside[1] - hollow.aside[0]) / 2.0 - SIDE:
            continue
        point = hollow.point(ahead + farther, aside, up)
        for turns in itertools.product(PITCHES, ROLLS, YAWS):
            pitch, _, yaw = turns
            cost = abs(beside) + abs(pitch - way.pitch) / 60.0 + abs(yaw) / 100.0
            kind = beside, farther, turns
            yield Pose(point, arm.pointing(*turns), 1.0, cost, point[None], turns, beside, kind)


def _ajar(arm: Arm, way: Way) -> bool:
    """Whether what the hand comes in past still stands in the way."""
    fixture = Furniture(arm, way.role)
    doors = [door for door in fixture.doors() if way.door in ("", door.name)]
    return all(fixture.openness(door) < AJAR for door in doors)
