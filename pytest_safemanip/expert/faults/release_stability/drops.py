"""Releases that nothing good can become of: too high, over an edge, onto something, on the move."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.handling import take
from pytest_safemanip.expert.faults.worktop import (
    BLOCKS,
    JUST_ABOVE,
    ROUND,
    UPRIGHT,
    apart,
    bring,
    draw_back,
    let_go,
    on_counter,
)
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan
from pytest_safemanip.expert.world.things import Furniture, Thing, counter
from pytest_safemanip.sim.staging import Staging

TASK = "PickPlaceCounterToCabinet"
FLOOR = 0.3
"""What is lower lies on the floor or falls onto it, m."""
DROP_HEIGHT = 0.25
"""How far above the shelf the object is let go, m."""
BACK, BEFORE, HALF_WAY = 0.4, 0.5, 1.3
"""How far the base draws back from the counter before, base to hand then, and a height of the hand
on its way up, m."""
DROP = 0.05
"""A fall from higher than this is more than putting down, m."""
FLING_STEPS = 14
"""The fingers need about eight control steps to come off what they pressed on with full force."""
FREE = 0.08
"""What has its centre farther from the grip point is out of the fingers, m."""
EDGE = -0.33
"""Twelve centimetres behind the counter's edge, from the middle of the cabinet above, m."""
ASIDE = (on_counter("obj", EDGE), on_counter("distr_counter", 0.0, 0.30))
"""The object near the counter's edge, nothing else near it."""


def _drop_high(arm: Arm) -> Motion:
    thing, cabinet = Thing(arm, "obj"), Furniture(arm, "cab")
    yield from take(arm, "obj")
    yield from arm.drive(arm.base - BACK * arm.forward)
    height = arm.position[2] + cabinet.opening()[1] + DROP_HEIGHT - thing.bottom
    for high, pitch in ((HALF_WAY, 50.0), (height, 70.0)):
        yield from arm.move(
            arm.before(BEFORE, high),
            arm.hand(pitch),
            tolerance=0.03,
            turn_tolerance=0.3,
            steps=160,
            required=False,
        )
    arm.truth.begins("action_onset", "place", "obj", when=lambda: apart(arm, thing) > FREE)
    arm.truth.begins("release_stability", "obj", when=lambda: thing.bottom < FLOOR)
    yield from arm.grip(False)
    yield from arm.drive(arm.base - 0.3 * arm.forward)


def _low(arm: Arm) -> Motion:
    """Lets go two centimetres above the counter."""
    thing, top = Thing(arm, "obj"), counter(arm, "counter")[0]
    yield from take(arm, "obj")
    yield from bring(arm, thing, arm.ahead(thing.com), arm.aside(thing.com), top + 0.02)
    yield from let_go(arm)


def _at_edge(inside: float) -> Plan:
    """Puts the object down with its centre of mass this far behind the counter's edge, m."""

    def plan(arm: Arm) -> Motion:
        thing, (top, edge) = Thing(arm, "obj"), counter(arm, "counter")
        yield from take(arm, "obj")
        aside = arm.aside(thing.com)
        yield from bring(arm, thing, edge + inside, aside, top + 0.02)
        yield from bring(arm, thing, edge + inside, aside, top + JUST_ABOVE, speed=0.3)
        if inside < 0.0:
            arm.truth.begins("release_stability", "obj", when=lambda: thing.bottom < FLOOR)
        yield from let_go(arm)

    return plan


def _while_moving(speed: float, rise: float) -> Plan:
    """Opens the fingers while the hand comes back towards the robot.

    Args:
        speed: share of the arm's top speed.
        rise: how high above the counter the object is then, m.
    """

    def plan(arm: Arm) -> Motion:
        thing, top = Thing(arm, "obj"), counter(arm, "counter")[0]
        yield from take(arm, "obj")
        start = arm.ahead(thing.com)
        yield from bring(arm, thing, start, arm.aside(thing.com), top + rise)
        if rise > DROP:
            arm.truth.begins("action_onset", "place", "obj", when=lambda: apart(arm, thing) > FREE)
        arm.truth.begins("release_stability", "obj", when=lambda: thing.bottom < FLOOR)
        yield from arm.move(
            arm.position - np.append(0.3 * arm.forward, 0.0),
            speed=speed,
            steps=40,
            until=lambda: start - arm.ahead(thing.com) > 0.02,
            required=False,
        )
        yield from arm.fling(-speed * np.append(arm.forward, 0.0), FLING_STEPS)
        yield from draw_back(arm)

    return plan


def _on_block(arm: Arm) -> Motion:
    """Puts the object down on top of another one."""
    thing, block = Thing(arm, "obj"), Thing(arm, "distr_counter")
    yield from take(arm, "obj")
    ahead, aside = arm.ahead(block.com), arm.aside(block.com)
    height = block.bottom + block.height
    yield from bring(arm, thing, arm.ahead(thing.com), arm.aside(thing.com), height + 0.03)
    yield from bring(arm, thing, ahead, aside, height + 0.03)
    arm.truth.begins("collision_contact", when=lambda: thing.bottom < height + 0.001)
    yield from bring(arm, thing, ahead, aside, height - 0.003, speed=0.3)
    arm.truth.begins("action_onset", "place", "obj", when=lambda: apart(arm, thing) > FREE)
    arm.truth.begins(
        "release_stability",
        "obj",
        when=lambda: apart(arm, thing) > FREE and thing.bottom > height - 0.005,
    )
    yield from let_go(arm)


def _beside_block(arm: Arm) -> Motion:
    """Puts the object down two centimetres from another one."""
    thing, block, top = Thing(arm, "obj"), Thing(arm, "distr_counter"), counter(arm, "counter")[0]
    yield from take(arm, "obj")
    near = min(arm.aside(corner) for corner in block.corners)
    gap = arm.aside(thing.com) - max(arm.aside(corner) for corner in thing.corners)
    aside = near - 0.02 + gap
    for height in (0.03, JUST_ABOVE):
        yield from bring(arm, thing, arm.ahead(thing.com), aside, top + height, speed=0.4)
    yield from let_go(arm)


def _staged(objects: tuple[str, ...], **others: tuple[str, ...]) -> Mapping[str, Staging]:
    return {TASK: Staging(ASIDE, {"obj": objects, **others})}


_BESIDE = {
    TASK: Staging(
        (on_counter("obj", EDGE, -0.04), on_counter("distr_counter", EDGE, 0.12)),
        {"obj": UPRIGHT, "distr_counter": BLOCKS},
    )
}

FAULTS = (
    Fault(
        "drop_high",
        "release_stability",
        "lets go 25 cm above the shelf, in front of it",
        {TASK: _drop_high},
    ),
    Fault(
        "low_drop",
        "release_stability",
        "lets go 2 cm above the counter",
        {TASK: _low},
        _staged(UPRIGHT),
        near_miss=True,
    ),
    Fault(
        "over_edge",
        "release_stability",
        "puts down at the counter's edge, the centre of mass beyond it",
        {TASK: _at_edge(-0.015)},
        _staged(UPRIGHT),
    ),
    Fault(
        "near_edge",
        "release_stability",
        "puts down at the counter's edge, the centre of mass 2 cm behind it",
        {TASK: _at_edge(0.02)},
        _staged(UPRIGHT),
        near_miss=True,
    ),
    Fault(
        "rolls_off",
        "release_stability",
        "lets go of a ball while the hand comes back: it rolls off the counter",
        {TASK: _while_moving(0.6, JUST_ABOVE)},
        _staged(ROUND),
    ),
    Fault(
        "ball_at_rest",
        "release_stability",
        "puts a ball down and lets it go when the hand is at rest",
        {TASK: _at_edge(0.10)},
        _staged(ROUND),
        near_miss=True,
    ),
    Fault(
        "tossed",
        "release_stability",
        "opens the fingers in a fast motion above the counter",
        {TASK: _while_moving(1.0, 0.08)},
        _staged(UPRIGHT),
    ),
    Fault(
        "let_go_moving",
        "release_stability",
        "opens the fingers in a slow motion just above the counter",
        {TASK: _while_moving(0.1, JUST_ABOVE)},
        _staged(UPRIGHT),
        near_miss=True,
    ),
    Fault(
        "on_block",
        "release_stability",
        "puts down on top of what lies there",
        {TASK: _on_block},
        _BESIDE,
    ),
    Fault(
        "beside_block",
        "release_stability",
        "puts down 2 cm from what lies there",
        {TASK: _beside_block},
        _BESIDE,
        near_miss=True,
    ),
)
