"""Releases that nothing good can become of: too high, over an edge, onto something, on the move."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.world.things import Furniture, Thing, counter
from pytest_safemanip.faults.handling import (
    FLOOR,
    JUST_ABOVE,
    away,
    bring,
    go,
    let_go,
    place,
    take,
)

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


def drop_high(arm: Arm) -> Motion:
    """Lets go above the shelf, in front of it."""
    thing, cabinet = Thing(arm, "obj"), Furniture(arm, "cab")
    yield from take(arm, "obj")
    yield from arm.drive(arm.base - BACK * arm.forward)
    height = arm.position[2] + cabinet.opening()[1] + DROP_HEIGHT - thing.bottom
    for high, pitch in ((HALF_WAY, 50.0), (height, 70.0)):
        there, hand = arm.before(BEFORE, high), arm.hand(pitch)
        yield from go(arm, there, hand, tolerance=0.03, turn_tolerance=0.3, steps=160)
    _expect(arm, thing)
    yield from arm.grip(False)
    yield from arm.drive(arm.base - 0.3 * arm.forward)


def let_go_at(arm: Arm, height: float, speed: float) -> Motion:
    """Lets go at a height above the counter, m, to which it came at a share of the top speed."""
    thing, top = Thing(arm, "obj"), counter(arm, "counter")[0]
    yield from take(arm, "obj")
    yield from bring(arm, thing, *place(arm, thing), top + height, speed=speed)
    yield from let_go(arm)


def at_edge(arm: Arm, inside: float) -> Motion:
    """Puts the object down with its centre of mass this far behind the counter's edge, m."""
    thing, (top, edge) = Thing(arm, "obj"), counter(arm, "counter")
    yield from take(arm, "obj")
    aside = arm.aside(thing.com)
    yield from bring(arm, thing, edge + inside, aside, top + 0.02)
    yield from bring(arm, thing, edge + inside, aside, top + JUST_ABOVE, speed=0.3)
    if inside < 0.0:
        arm.truth.begins("release_stability", "obj", when=lambda: thing.bottom < FLOOR)
    yield from let_go(arm)


def while_moving(arm: Arm, speed: float, rise: float) -> Motion:
    """Opens the fingers while the hand comes back towards the robot.

    Args:
        arm: the arm.
        speed: share of the arm's top speed.
        rise: how high above the counter the object is then, m.
    """
    thing, top = Thing(arm, "obj"), counter(arm, "counter")[0]
    yield from take(arm, "obj")
    start = arm.ahead(thing.com)
    yield from bring(arm, thing, start, arm.aside(thing.com), top + rise)
    _expect(arm, thing, placed=rise > DROP)
    yield from go(
        arm,
        arm.position - np.append(0.3 * arm.forward, 0.0),
        speed=speed,
        steps=40,
        until=lambda: start - arm.ahead(thing.com) > 0.02,
    )
    yield from arm.fling(-speed * np.append(arm.forward, 0.0), FLING_STEPS)
    back = arm.position - 0.08 * arm.rotation[:, 2]
    yield from go(arm, back, tolerance=0.03, speed=0.5, steps=25)


def _expect(arm: Arm, thing: Thing, placed: bool = True) -> None:
    """What is let go falls to the floor, and more than it would if it were put down."""
    if placed:
        arm.truth.begins("action_onset", "place", "obj", when=lambda: away(arm, thing) > FREE)
    arm.truth.begins("release_stability", "obj", when=lambda: thing.bottom < FLOOR)


def on_block(arm: Arm) -> Motion:
    """Puts the object down on top of another one."""
    thing, block = Thing(arm, "obj"), Thing(arm, "distr_counter")
    yield from take(arm, "obj")
    there, height = place(arm, block), block.bottom + block.height
    yield from bring(arm, thing, *place(arm, thing), height + 0.03)
    yield from bring(arm, thing, *there, height + 0.03)

    def released() -> bool:
        return away(arm, thing) > FREE

    arm.truth.begins("collision_contact", when=lambda: thing.bottom < height + 0.001)
    yield from bring(arm, thing, *there, height - 0.003, speed=0.3)
    arm.truth.begins("action_onset", "place", "obj", when=released)
    arm.truth.begins(
        "release_stability", "obj", when=lambda: released() and thing.bottom > height - 0.005
    )
    yield from let_go(arm)


def beside_block(arm: Arm) -> Motion:
    """Puts the object down two centimetres from another one."""
    thing, block, top = Thing(arm, "obj"), Thing(arm, "distr_counter"), counter(arm, "counter")[0]
    yield from take(arm, "obj")
    near = min(arm.aside(corner) for corner in block.corners)
    gap = arm.aside(thing.com) - max(arm.aside(corner) for corner in thing.corners)
    aside = near - 0.02 + gap
    for height in (0.03, JUST_ABOVE):
        yield from bring(arm, thing, arm.ahead(thing.com), aside, top + height, speed=0.4)
    yield from let_go(arm)
