"""Base, wrist, hand or load against what is in the way, or too hard against what may be touched."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion, raised
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Furniture, Thing, counter
from pytest_safemanip.faults.collision_contact.sweep import STRUCK
from pytest_safemanip.faults.handling import bring, go, take

STOPPED = 0.05
"""What is this far from where it was told to go, and stands still, is held up by something, m."""
STARTED = 0.03
"""A base that got this far has started, m."""
BASE_AHEAD = 0.057
"""From the counter's edge to the middle of a base whose arm's column touches it, m."""
WRIST = 0.17
"""From the grip point back to the wrist of a hand that points 50 degrees forward, m."""


def over_bottle(arm: Arm, above: float) -> Motion:
    """Sweeps the hand sideways behind a bottle, so that the wrist comes over where it stands.

    Args:
        arm: the arm.
        above: from the bottle's top to the grip point, m.
    """
    bottle = Thing(arm, "distr_counter")
    where, top = bottle.com, bottle.bottom + bottle.height
    ahead, aside = arm.ahead(where) + WRIST, arm.aside(where)
    yield from arm.grip(True, 4)
    yield from arm.drive(arm.floor_point(ahead - 0.60, aside + 0.10))
    hand = arm.hand(50.0)
    for way in (0.22, -0.18):
        if way < 0.0:
            _expect(arm, lambda: _moved(bottle, where))
        target = arm.point(ahead, aside + way, top + above)
        yield from go(arm, target, hand, tolerance=0.03, steps=70)


def drive_against(arm: Arm, short: float) -> Motion:
    """Drives against the counter.

    Args:
        arm: the arm.
        short: how far from it the base stops, m; below 0 it goes on.
    """
    edge = counter(arm, "counter")[1]
    stop = edge - BASE_AHEAD - short
    passed = [arm.ahead(arm.base)]

    def held_up() -> bool:
        passed.append(arm.ahead(arm.base))
        still = passed[-1] - passed[max(-6, -len(passed))] < 0.002
        return still and stop - passed[-1] > STOPPED and passed[-1] - passed[0] > STARTED

    if short < 0.0:
        _expect(arm, held_up)
    for _ in range(60):
        action = arm.hold()
        action[7] = 0.5
        if arm.ahead(arm.base) > stop:
            break
        yield action


def carry_to(arm: Arm, gap: float) -> Motion:
    """Carries the object sideways to another one.

    Args:
        arm: the arm.
        gap: how far beside it the object stops, m; below 0 it goes on.
    """
    thing, other = Thing(arm, "obj"), Thing(arm, "distr_counter")
    yield from take(arm, "obj")
    where, here = other.com, thing.com
    near = min(arm.aside(corner) for corner in other.corners)
    half = max(arm.aside(corner) for corner in thing.corners) - arm.aside(here)
    aside, bottom = near - half - gap, other.bottom + 0.012
    yield from bring(arm, thing, arm.ahead(here), arm.aside(here), bottom)
    _expect(arm, lambda: _moved(other, where))
    yield from bring(arm, thing, arm.ahead(here), aside, bottom, speed=0.4)


def press_down(arm: Arm, depth: float, speed: float) -> Motion:
    """Presses the closed fingers down on the counter.

    Args:
        arm: the arm.
        depth: how far below its top the fingertips are told to go, m.
        speed: share of the arm's top speed.
    """
    top, edge = counter(arm, "counter")
    yield from arm.grip(True, 8)
    yield from arm.drive(arm.floor_point(edge - 0.45, arm.aside(arm.base)))
    hand, ahead = arm.hand(20.0), arm.ahead(arm.base) + 0.55
    above = arm.point(ahead, arm.aside(arm.base), top + 0.05)
    yield from go(arm, above, hand, tolerance=0.02, steps=80)
    target = raised(above, -0.05 - depth)
    _expect(arm, lambda: arm.position[2] < top + 0.03 and _held_up(arm, target))
    yield from go(arm, target, hand, tolerance=0.004, speed=speed, steps=25)
    yield from arm.move(raised(arm.position, 0.1), hand, tolerance=0.03, steps=30)


def to_door(arm: Arm, gap: float) -> Motion:
    """Moves the fist towards a closed door.

    Args:
        arm: the arm.
        gap: from the door to where the fingertips are told to go, m; below 0 behind it.
    """
    cabinet = Furniture(arm, "cab")
    pose, door = cabinet.interior()[0], cabinet.opening()[0] - 0.025
    aside, height = arm.aside(pose) + 0.2, float(pose[2])
    yield from arm.grip(True, 8)
    yield from arm.drive(arm.floor_point(door - 0.65, aside))
    hand, before = arm.hand(80.0), arm.point(door - 0.10, aside, height)
    yield from go(arm, before, hand, tolerance=0.02, steps=90)
    target = arm.point(door - gap, aside, height)
    _expect(arm, lambda: arm.ahead(arm.position) > door - 0.05 and _held_up(arm, target))
    yield from go(arm, target, hand, tolerance=0.008, speed=0.5, steps=30)
    yield from go(arm, before, hand, tolerance=0.03, steps=30)


def wrong_object(arm: Arm) -> Motion:
    """Picks up what it was not asked for."""
    thing = Thing(arm, "distr_counter")
    where = thing.com
    _expect(arm, lambda: thing.com[2] - where[2] > STRUCK)
    yield from take(arm, "distr_counter")


def around(arm: Arm) -> Motion:
    """Goes down with open fingers to both sides of something, and up again."""
    where = Thing(arm, "distr_counter").centre
    yield from arm.drive(arm.floor_point(arm.ahead(where) - 0.6, arm.aside(where)))
    hand, low = arm.hand(20.0), raised(where, 0.015)
    yield from arm.open_to(0.98)
    for height, speed in ((0.14, 1.0), (0.06, 0.6), (0.0, 0.4), (0.14, 0.6)):
        yield from go(arm, raised(low, height), hand, tolerance=0.008, speed=speed, steps=70)


def _expect(arm: Arm, when: Callable[[], bool]) -> None:
    arm.truth.begins("collision_contact", when=when)


def _moved(thing: Thing, where: Array) -> bool:
    return bool(np.linalg.norm(thing.com - where) > STRUCK)


def _held_up(arm: Arm, target: Array) -> bool:
    """Whether the hand stands still far from where it was told to go."""
    still = float(np.linalg.norm(arm.step.eef_twist[:3])) < 0.02
    return bool(still and np.linalg.norm(target - arm.position) > STOPPED)
