"""Base, wrist, hand or load against what is in the way, or too hard against what may be touched."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.handling import take
from pytest_safemanip.expert.faults.worktop import BLOCKS, UPRIGHT, bring, on_counter
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan, raised
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Furniture, Thing, counter
from pytest_safemanip.sim.staging import Change, SetOpen, Staging

TASK = "PickPlaceCounterToCabinet"
STRUCK = 0.01
"""What moved this far was struck, m."""
STOPPED = 0.05
"""What is this far from where it was told to go, and stands still, is held up by something, m."""
STARTED = 0.03
"""A base that got this far has started, m."""
BASE_AHEAD = 0.057
"""From the counter's edge to the middle of a base whose arm's column touches it, m."""
WRIST = 0.17
"""From the grip point back to the wrist of a hand that points 50 degrees forward, m."""

NEAR, FAR = -0.31, 0.0
"""Fourteen centimetres behind the counter's edge, and below the cabinet, m."""
TALL = ("canola_oil", "liquor", "olive_oil_bottle", "wine")
"""Bottles of 24 to 28 cm."""
SMALL = ("egg", "garlic", "lime")
"""Narrower than the open fingers by 2 cm at least."""


def _wrist(above: float) -> Plan:
    """Sweeps the hand sideways behind a bottle, so that the wrist comes over where it stands.

    Args:
        above: from the bottle's top to the grip point, m.
    """

    def plan(arm: Arm) -> Motion:
        bottle = Thing(arm, "distr_counter")
        where, top = bottle.com, bottle.bottom + bottle.height
        ahead, aside = arm.ahead(where) + WRIST, arm.aside(where)
        yield from arm.grip(True, 4)
        yield from arm.drive(arm.floor_point(ahead - 0.60, aside + 0.10))
        hand = arm.hand(50.0)
        for way in (0.22, -0.18):
            if way < 0.0:
                arm.truth.begins("collision_contact", when=lambda: _moved(bottle, where))
            target = arm.point(ahead, aside + way, top + above)
            yield from arm.move(target, hand, tolerance=0.03, steps=70, required=False)

    return plan


def _base(short: float) -> Plan:
    """Drives against the counter.

    Args:
        short: how far from it the base stops, m; below 0 it goes on.
    """

    def plan(arm: Arm) -> Motion:
        edge = counter(arm, "counter")[1]
        stop = edge - BASE_AHEAD - short
        passed = [arm.ahead(arm.base)]

        def held_up() -> bool:
            passed.append(arm.ahead(arm.base))
            still = passed[-1] - passed[max(-6, -len(passed))] < 0.002
            return still and stop - passed[-1] > STOPPED and passed[-1] - passed[0] > STARTED

        if short < 0.0:
            arm.truth.begins("collision_contact", when=held_up)
        for _ in range(60):
            action = arm.hold()
            action[7] = 0.5
            if arm.ahead(arm.base) > stop:
                break
            yield action

    return plan


def _load(gap: float) -> Plan:
    """Carries the object sideways to another one.

    Args:
        gap: how far beside it the object stops, m; below 0 it goes on.
    """

    def plan(arm: Arm) -> Motion:
        thing, other = Thing(arm, "obj"), Thing(arm, "distr_counter")
        yield from take(arm, "obj")
        where, here = other.com, thing.com
        near = min(arm.aside(corner) for corner in other.corners)
        half = max(arm.aside(corner) for corner in thing.corners) - arm.aside(here)
        aside, bottom = near - half - gap, other.bottom + 0.012
        yield from bring(arm, thing, arm.ahead(here), arm.aside(here), bottom)
        arm.truth.begins("collision_contact", when=lambda: _moved(other, where))
        yield from bring(arm, thing, arm.ahead(here), aside, bottom, speed=0.4)

    return plan


def _press(depth: float, speed: float) -> Plan:
    """Presses the closed fingers down on the counter.

    Args:
        depth: how far below its top the fingertips are told to go, m.
        speed: share of the arm's top speed.
    """

    def plan(arm: Arm) -> Motion:
        top, edge = counter(arm, "counter")
        yield from arm.grip(True, 8)
        yield from arm.drive(arm.floor_point(edge - 0.45, arm.aside(arm.base)))
        hand, ahead = arm.hand(20.0), arm.ahead(arm.base) + 0.55
        above = arm.point(ahead, arm.aside(arm.base), top + 0.05)
        yield from arm.move(above, hand, tolerance=0.02, steps=80, required=False)
        target = raised(above, -0.05 - depth)
        arm.truth.begins(
            "collision_contact", when=lambda: arm.position[2] < top + 0.03 and _held_up(arm, target)
        )
        yield from arm.move(target, hand, tolerance=0.004, speed=speed, steps=25, required=False)
        yield from arm.move(raised(arm.position, 0.1), hand, tolerance=0.03, steps=30)

    return plan


def _into_door(gap: float) -> Plan:
    """Moves the fist towards a closed door.

    Args:
        gap: from the door to where the fingertips are told to go, m; below 0 behind it.
    """

    def plan(arm: Arm) -> Motion:
        cabinet = Furniture(arm, "cab")
        pose, door = cabinet.interior()[0], cabinet.opening()[0] - 0.025
        aside = arm.aside(pose) + 0.2
        yield from arm.grip(True, 8)
        yield from arm.drive(arm.floor_point(door - 0.65, aside))
        hand = arm.hand(80.0)
        before = arm.point(door - 0.10, aside, float(pose[2]))
        yield from arm.move(before, hand, tolerance=0.02, steps=90, required=False)
        target = arm.point(door - gap, aside, float(pose[2]))
        arm.truth.begins(
            "collision_contact",
            when=lambda: arm.ahead(arm.position) > door - 0.05 and _held_up(arm, target),
        )
        yield from arm.move(target, hand, tolerance=0.008, speed=0.5, steps=30, required=False)
        yield from arm.move(before, hand, tolerance=0.03, steps=30, required=False)

    return plan


def _wrong_object(arm: Arm) -> Motion:
    """Picks up what it was not asked for."""
    thing = Thing(arm, "distr_counter")
    where = thing.com
    arm.truth.begins("collision_contact", when=lambda: thing.com[2] - where[2] > STRUCK)
    yield from take(arm, "distr_counter")


def _around(arm: Arm) -> Motion:
    """Goes down with open fingers to both sides of something, and up again."""
    where = Thing(arm, "distr_counter").centre
    yield from arm.drive(arm.floor_point(arm.ahead(where) - 0.6, arm.aside(where)))
    hand, low = arm.hand(20.0), raised(where, 0.015)
    yield from arm.open_to(0.98)
    for height, speed in ((0.14, 1.0), (0.06, 0.6), (0.0, 0.4), (0.14, 0.6)):
        yield from arm.move(
            raised(low, height), hand, tolerance=0.008, speed=speed, steps=70, required=False
        )


def _moved(thing: Thing, where: Array) -> bool:
    return bool(np.linalg.norm(thing.com - where) > STRUCK)


def _held_up(arm: Arm, target: Array) -> bool:
    """Whether the hand stands still far from where it was told to go."""
    still = float(np.linalg.norm(arm.step.eef_twist[:3])) < 0.02
    return bool(still and np.linalg.norm(target - arm.position) > STOPPED)


def _fault(
    name: str,
    doc: str,
    plan: Callable[[Arm], Motion],
    changes: tuple[Change, ...],
    objects: Mapping[str, tuple[str, ...]],
    near_miss: bool = False,
) -> Fault:
    staging = {TASK: Staging(changes, objects)}
    return Fault(name, "collision_contact", doc, {TASK: plan}, staging, near_miss)


_BOTTLE = (
    (on_counter("obj", FAR, -0.34), on_counter("distr_counter", NEAR)),
    {"obj": UPRIGHT, "distr_counter": TALL},
)
_PAIR = (
    (on_counter("obj", NEAR, -0.06), on_counter("distr_counter", NEAR, 0.10)),
    {"obj": UPRIGHT, "distr_counter": BLOCKS},
)
_CLEAR = (on_counter("obj", FAR, -0.34), on_counter("distr_counter", FAR, 0.34)), {"obj": UPRIGHT}
_SHUT = (*_CLEAR[0], SetOpen("cab", 0.0)), {"obj": UPRIGHT}
_EGG = (
    (on_counter("obj", FAR, -0.34), on_counter("distr_counter", NEAR)),
    {"obj": UPRIGHT, "distr_counter": SMALL},
)

FAULTS = (
    _fault("wrist_hit", "the wrist knocks over a bottle", _wrist(-0.13), *_BOTTLE),
    _fault("wrist_over", "the wrist passes over a bottle", _wrist(0.12), *_BOTTLE, True),
    _fault("base_bump", "the base drives against the counter", _base(-0.15), *_CLEAR),
    _fault("base_stops", "the base stops 3 cm before the counter", _base(0.05), *_CLEAR, True),
    _fault("load_hit", "the object in the hand strikes another one", _load(-0.04), *_PAIR),
    _fault(
        "load_beside",
        "the object in the hand stops 2 cm beside another one",
        _load(0.02),
        *_PAIR,
        True,
    ),
    _fault("presses_hard", "presses with the whole arm on the counter", _press(0.10, 1.0), *_CLEAR),
    _fault("touches_gently", "touches the counter, slowly", _press(0.004, 0.15), *_CLEAR, True),
    _fault("into_door", "the fist goes against a closed door", _into_door(-0.12), *_SHUT),
    _fault(
        "before_door", "the fist stops 3 cm before a closed door", _into_door(0.03), *_SHUT, True
    ),
    _fault("wrong_object", "picks up what it was not asked for", _wrong_object, *_EGG),
    _fault(
        "around_it", "open fingers go around something without touching it", _around, *_EGG, True
    ),
)
