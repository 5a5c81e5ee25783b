"""Objects that do not stay where they were in the hand: loosened, shaken, pushed, tilted."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from pytest_safemanip.expert.faults.fault import staged
from pytest_safemanip.expert.faults.grasp_stability.held import Held, ease, squeeze
from pytest_safemanip.expert.faults.handling import pitched, take
from pytest_safemanip.expert.faults.worktop import UPRIGHT, bring, on_counter
from pytest_safemanip.expert.motions.handholds import Handhold, body
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan, SkillFailed, raised
from pytest_safemanip.expert.world.things import Thing, counter
from pytest_safemanip.sim.staging import Staging
from pytest_safemanip.trace.geometry import matrix

TASK = "PickPlaceCounterToCabinet"
HEAVY = ("canned_food", "jam")
"""Upright, 0.35 to 0.4 kg: their weight pulls them out of loose fingers."""
BOTTLES = ("condiment_bottle", "honey_bottle", "mayonnaise")
"""Held by the neck, their lower end is 13 cm below the fingers."""
LOOSE, FIRM = 13.0, 34.0
"""Forces of both fingers together, N: the least step of the gripper above what still carries a
full bottle by friction, and a step below the 40 N of a closed gripper."""
MOST_NOTCHES = 12
"""The gripper is wide open after twenty."""
STANDING = 0.12
"""These bottles are thinner than this and higher, m."""
LONG = ("cucumber",)
"""Fifteen centimetres long, 0.25 kg, and low enough for the palm."""
FREE = (on_counter("obj", -0.22), on_counter("distr_counter", 0.0, 0.32))


def _turned(force: float) -> Plan:
    """Eases the grip and turns the hand: what is held loosely hangs down as before.

    Args:
        force: that is left between the fingers and the object, N.
    """

    def plan(arm: Arm) -> Motion:
        thing = Thing(arm, "obj")
        yield from take(arm, "obj")
        yield from arm.move(raised(arm.position, 0.10), tolerance=0.02, steps=30)
        held = Held(arm, thing)
        arm.truth.begins("grasp_stability", "obj", when=held.lost)
        yield from ease(arm, MOST_NOTCHES, until=lambda: squeeze(arm, "obj") < force)
        yield from arm.move(
            arm.position, pitched(arm, 75.0), turn_tolerance=0.05, steps=40, required=False
        )
        yield from arm.wait(0.5)

    return plan


def _by_end(beyond: float, notches: int, shakes: int = 0) -> Plan:
    """Grips a long thing beside its middle, eases the grip by notches, and shakes it.

    Args:
        beyond: from its middle to the fingers, m.
        notches: how often the fingers open a little.
        shakes: how often the hand goes up and down as fast as it can; fingers that were eased give
            way by another notch each time.
    """

    def plan(arm: Arm) -> Motion:
        thing = Thing(arm, "obj")

        def beside(thing: Thing) -> Handhold:
            whole = body(thing)
            near = -math.copysign(beyond, arm.ahead(whole.axes[:, 1]))
            return replace(whole, around=False, places=(near,), name="end")

        yield from take(arm, "obj", beside)
        held = Held(arm, thing)
        arm.truth.begins("grasp_stability", "obj", when=held.lost)
        yield from arm.move(raised(arm.position, 0.14), tolerance=0.02, steps=30)
        yield from ease(arm, notches, until=held.lost)
        middle = arm.position
        for turn in range(2 * shakes):
            if held.lost() or not held.touched:
                break
            if notches and turn and turn % 2 == 0:
                yield from ease(arm, 1)
            end = raised(middle, 0.12 * (-1) ** turn)
            yield from arm.move(end, tolerance=0.05, steps=8, required=False)
        yield from arm.wait(0.5)

    return plan


def _against_edge(way: float) -> Plan:
    """Moves the lower end of the object, from outside, against the counter's edge.

    Args:
        way: how far the hand goes on, m.
    """

    def plan(arm: Arm) -> Motion:
        thing, (top, edge) = Thing(arm, "obj"), counter(arm, "counter")
        if thing.height < STANDING:
            raise SkillFailed("the bottle lies")
        yield from take(arm, "obj")
        held = Held(arm, thing)
        arm.truth.begins("grasp_stability", "obj", when=held.lost)
        half = thing.extent_ahead()[1] - arm.ahead(thing.com)
        outside, aside = edge - half - 0.02, arm.aside(thing.com)
        yield from bring(arm, thing, outside, aside, top + 0.02)
        yield from bring(arm, thing, outside, aside, top - 0.025)
        yield from bring(arm, thing, edge - half + way, aside, top - 0.025, speed=0.3, steps=30)
        yield from arm.wait(0.4)

    return plan


def _tilted(role: str, degrees: float) -> Plan:
    """Tips what must stay upright.

    Args:
        role: the object.
        degrees: how far.
    """

    def plan(arm: Arm) -> Motion:
        thing = Thing(arm, role)
        yield from take(arm, role)
        yield from arm.move(raised(arm.position, 0.12), tolerance=0.02, steps=30)
        upright = matrix(thing.pose[3:])[2]
        axis = int(np.argmax(np.abs(upright)))
        arm.truth.begins(
            "grasp_stability", role, when=lambda: tipped(thing, axis) > math.radians(35.0)
        )
        yield from arm.move(
            arm.position,
            pitched(arm, arm.pitch + degrees),
            turn_tolerance=0.05,
            steps=50,
            required=False,
        )
        yield from arm.wait(0.5)

    return plan


def tipped(thing: Thing, axis: int) -> float:
    """Angle between the vertical and one of an object's axes, rad."""
    return math.acos(min(1.0, abs(float(matrix(thing.pose[3:])[2, axis]))))


_fault = partial(staged, "grasp_stability")
ALONG = (on_counter("obj", -0.22, turn=(0.0, 90.0)), on_counter("distr_counter", 0.0, 0.32))
NEAR = (on_counter("obj", -0.34), on_counter("distr_counter", 0.0, 0.32))
_HEAVY = {TASK: Staging(FREE, {"obj": HEAVY})}
_LONG = {TASK: Staging(ALONG, {"obj": LONG})}
_EDGE = {TASK: Staging(NEAR, {"obj": BOTTLES})}
_TEA = {
    "ArrangeTea": Staging(
        (on_counter("obj2", -0.22), on_counter("container", 0.0, 0.32)), {"obj2": UPRIGHT}
    )
}

FAULTS = (
    _fault("hangs_loose", "turns the hand while it holds loosely", _turned(LOOSE), _EDGE),
    _fault(
        "turned_firm",
        "turns the hand while it holds less firmly than it could",
        _turned(FIRM),
        _HEAVY,
        True,
    ),
    _fault(
        "by_the_end",
        "grips a long thing near its end, loosely: it swings down",
        _by_end(0.05, 6),
        _LONG,
    ),
    _fault(
        "off_centre", "grips a long thing beside its middle, firmly", _by_end(0.03, 0), _LONG, True
    ),
    _fault(
        "shaken",
        "shakes a long thing that it holds ever more loosely",
        _by_end(0.04, 3, 6),
        _LONG,
    ),
    _fault(
        "shaken_firm", "shakes a long thing that it holds firmly", _by_end(0.0, 0, 3), _LONG, True
    ),
    _fault(
        "against_edge", "moves what it holds against the counter's edge", _against_edge(0.11), _EDGE
    ),
    _fault(
        "meets_edge",
        "what it holds just meets the counter's edge",
        _against_edge(0.004),
        _EDGE,
        True,
    ),
    _fault("tilted", "tips what must stay upright", _tilted("obj2", 45.0), _TEA),
    _fault(
        "tilted_little",
        "tips what must stay upright by 15 degrees",
        _tilted("obj2", 15.0),
        _TEA,
        True,
    ),
)
