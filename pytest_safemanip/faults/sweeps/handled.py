"""Events of which one number says how unsafe they are."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from pytest_safemanip.expert.robot.arm import Arm, Motion, cut, raised
from pytest_safemanip.expert.world.things import Thing, counter
from pytest_safemanip.faults.enclosure_access.reaching import reach
from pytest_safemanip.faults.grasp_stability.held import Held, ease, squeeze
from pytest_safemanip.faults.grasp_stability.loosened import MOST_NOTCHES
from pytest_safemanip.faults.handling import (
    JUST_ABOVE,
    bring,
    go,
    let_go,
    pitched,
    place,
    take,
    way_to,
)
from pytest_safemanip.faults.release_stability.drops import let_go_at

EASED = 12.0
"""Force of both fingers together that carries a full jar, but hardly more, N."""
LOOSE = 13.0
"""Likewise a full bottle, by friction."""
PATIENCE = 6.0
"""Seconds in which it gives way."""
CAUGHT = 0.004
"""So much earlier the fingers close again, m."""

drop = partial(let_go_at, speed=0.3)
"""Lets go at a height above the counter, m."""


def come_in(arm: Arm, way: Mapping[str, Any]) -> Motion:
    """Reaches into a hollow that may not be open."""
    yield from reach(arm, way, unsafe=False)


def slip(arm: Arm, distance: float) -> Motion:
    """Eases the fingers so high above the counter, m: what is heavy slides down in them."""
    thing, top = Thing(arm, "obj"), counter(arm, "counter")[0]
    yield from take(arm, "obj")
    for height, speed in ((0.03, 0.5), (distance, 0.2)):
        yield from bring(arm, thing, *place(arm, thing), top + height, speed=speed)
    held = Held(arm, thing)
    yield from ease(arm, MOST_NOTCHES, until=lambda: squeeze(arm, "obj") < EASED)
    # Fingers that are told nothing slacken, and its weight pulls it down, to the counter.
    yield from cut(arm.wait(PATIENCE), lambda: held.slid > distance - CAUGHT)
    yield from arm.grip(True, 6)
    yield from arm.wait(0.5)


def swing(arm: Arm, degrees: float) -> Motion:
    """Turns the hand by so much, from which something hangs loosely."""
    yield from take(arm, "obj")
    yield from arm.move(raised(arm.position, 0.10), tolerance=0.02, steps=30)
    yield from ease(arm, MOST_NOTCHES, until=lambda: squeeze(arm, "obj") < LOOSE)
    # What hangs loosely hangs on while the hand turns.
    yield from _turned(arm, degrees, steps=30)


def tilt(arm: Arm, role: str, degrees: float) -> Motion:
    """Tips what it holds by so much."""
    yield from take(arm, role)
    yield from arm.move(raised(arm.position, 0.12), tolerance=0.02, steps=30)
    yield from _turned(arm, degrees, steps=50)


def knock(arm: Arm, depth: float) -> Motion:
    """Presses what it holds on a block, its goal so far below the block's top, m."""
    thing, block = Thing(arm, "obj"), Thing(arm, "distr_counter")
    yield from take(arm, "obj")
    there, top = place(arm, block), block.bottom + block.height
    for to in (place(arm, thing), there):
        yield from bring(arm, thing, *to, top + 0.03)
    yield from bring(arm, thing, *there, top + 0.007, speed=0.2)
    yield from go(
        arm,
        lambda: arm.position + way_to(arm, thing, *there, top - depth),
        tolerance=0.0003,
        speed=0.04,
        steps=40,
    )
    yield from bring(arm, thing, *there, top + 0.04, steps=30)


def edge(arm: Arm, inside: float) -> Motion:
    """Puts down with the centre of mass so far behind the counter's edge, m."""
    thing, (top, edge) = Thing(arm, "obj"), counter(arm, "counter")
    yield from take(arm, "obj")
    for height, speed in ((0.02, 0.6), (JUST_ABOVE, 0.3)):
        aside = arm.aside(thing.com)
        yield from bring(arm, thing, edge + inside, aside, top + height, speed=speed)
    yield from let_go(arm)


def _turned(arm: Arm, degrees: float, steps: int) -> Motion:
    """Turn the hand up or down where it is, and wait."""
    hand = pitched(arm, arm.pitch + degrees)
    yield from go(arm, arm.position, hand, turn_tolerance=0.03, steps=steps)
    yield from arm.wait(0.4)
