"""Objects that do not stay where they were in the hand: loosened, shaken, pushed, tilted."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pytest_safemanip.expert.motions.handholds import Handhold, body
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.world.things import Thing, counter
from pytest_safemanip.faults.grasp_stability.held import Held, ease, squeeze
from pytest_safemanip.faults.handling import bring, go, pitched, take
from pytest_safemanip.trace.geometry import matrix

MOST_NOTCHES = 12
"""The gripper is wide open after twenty."""
LOOSE = 10.0
"""What is held with less falls out at the next notch: each takes 4 N from either finger, N."""
SHAKEN = 0.12
"""How far up and down the hand is shaken from where it was, m."""
STANDING = 0.12
"""These bottles are thinner than this and higher, m."""
TIPPED = math.radians(35.0)
"""What must stay upright no longer is, rad."""


def turned(arm: Arm, force: float) -> Motion:
    """Eases the grip and turns the hand: what is held loosely hangs down as before.

    Args:
        arm: the arm.
        force: that is left between the fingers and the object, N.
    """
    thing = Thing(arm, "obj")
    yield from take(arm, "obj")
    yield from arm.move(raised(arm.position, 0.10), tolerance=0.02, steps=30)
    _watched(arm, thing)
    yield from ease(arm, MOST_NOTCHES, until=lambda: squeeze(arm, "obj") < force)
    yield from go(arm, arm.position, pitched(arm, 75.0), turn_tolerance=0.05, steps=40)
    yield from arm.wait(0.5)


def by_end(arm: Arm, beyond: float, notches: int, shakes: int = 0) -> Motion:
    """Grips a long thing beside its middle, eases the grip by notches, and shakes it.

    Args:
        arm: the arm.
        beyond: from its middle to the fingers, m.
        notches: how often the fingers open a little.
        shakes: how often the hand goes up and down as fast as it can; fingers that were eased give
            way by another notch each time, as long as they still hold it.
    """
    thing = Thing(arm, "obj")

    def beside(thing: Thing) -> Handhold:
        whole = body(thing)
        near = -math.copysign(beyond, arm.ahead(whole.axes[:, 1]))
        return replace(whole, around=False, places=(near,), name="end")

    yield from take(arm, "obj", beside)
    held = _watched(arm, thing)
    yield from arm.move(raised(arm.position, 0.14), tolerance=0.02, steps=30)
    yield from ease(arm, notches, until=lambda: held.lost() or squeeze(arm, "obj") < LOOSE)
    yield from _shake(arm, held, shakes, bool(notches))
    yield from arm.wait(0.5)


def _shake(arm: Arm, held: Held, times: int, eases: bool = False) -> Motion:
    """Moves the hand up and down as fast as it can, until what it holds is lost.

    Args:
        arm: the arm.
        held: how it is held.
        times: how often at most.
        eases: whether the fingers open by a notch each time, as long as they still hold it.
    """
    middle = arm.position
    for turn in range(2 * times):
        if held.lost() or not held.carried:
            return
        if eases and turn and turn % 2 == 0 and squeeze(arm, "obj") > LOOSE:
            yield from ease(arm, 1)
        yield from go(arm, raised(middle, SHAKEN * (-1) ** turn), tolerance=0.05, steps=8)


def against_edge(arm: Arm, way: float) -> Motion:
    """Moves the lower end of the object, from outside, against the counter's edge.

    Args:
        arm: the arm.
        way: how far the hand goes on, m.
    """
    thing, (top, edge) = Thing(arm, "obj"), counter(arm, "counter")
    if thing.height < STANDING:
        raise SkillFailed("the bottle lies")
    yield from take(arm, "obj")
    _watched(arm, thing)
    half = thing.extent_ahead()[1] - arm.ahead(thing.com)
    outside, aside = edge - half - 0.02, arm.aside(thing.com)
    yield from bring(arm, thing, outside, aside, top + 0.02)
    yield from bring(arm, thing, outside, aside, top - 0.025)
    yield from bring(arm, thing, edge - half + way, aside, top - 0.025, speed=0.3, steps=30)
    yield from arm.wait(0.4)


def _watched(arm: Arm, thing: Thing) -> Held:
    """How an object is held now: from here on it should stay so."""
    held = Held(arm, thing)
    arm.truth.begins("grasp_stability", "obj", when=held.lost)
    return held


def tilted(arm: Arm, role: str, degrees: float) -> Motion:
    """Tips what must stay upright so far."""
    thing = Thing(arm, role)
    yield from take(arm, role)
    yield from arm.move(raised(arm.position, 0.12), tolerance=0.02, steps=30)
    axis = int(np.argmax(np.abs(matrix(thing.pose[3:])[2])))
    arm.truth.begins("grasp_stability", role, when=lambda: _tipped(thing, axis) > TIPPED)
    hand = pitched(arm, arm.pitch + degrees)
    yield from go(arm, arm.position, hand, turn_tolerance=0.05, steps=50)
    yield from arm.wait(0.5)


def _tipped(thing: Thing, axis: int) -> float:
    """Angle between the vertical and one of an object's axes, rad."""
    return math.acos(min(1.0, abs(float(matrix(thing.pose[3:])[2, axis]))))
