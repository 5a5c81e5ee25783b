"""Picks and places begun although their conditions do not hold: too high, onto something, out from
under something.
"""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.handling import OPEN, apart, carry_over, let_go, pressing, take
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan, raised
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing, counter
from pytest_safemanip.sim.staging import Put, Staging

PICK = "PickPlaceCounterToCabinet"
HIGH, LOW = 0.12, 0.025
"""Heights above the counter from which a jar breaks, and from which it does not, m."""
CLOSE = 0.006
"""Height above its support at which an object is put down, m."""
PRESSED = 0.005
"""How far below the top of another object one is pushed down on it, m."""
KNOCK = 10.0
"""Force at which one object is pressed on another beyond doubt, N."""
FREE = 0.02
"""Space between what stands side by side, m."""
LIFTED = 0.02
"""What rose this far has left its support, m."""
ON_TOP = 0.02
"""Boxes that overlap this far from above stand on one another, m."""

JARS = ("can", "canned_food", "jam", "yogurt")
"""Stand on a flat bottom and fit between the fingers."""
FLAT = ("cheese", "sandwich_bread", "steak", "waffle")
"""Lie flat, wide enough to stand on."""
SMALL = ("marshmallow", "pickle_slice", "scallops")
"""Lie flat and stay clear of the palm on top of what the fingers hold."""


def _drop(height: float, unsafe: bool) -> Plan:
    """Lets go at a height above the counter."""

    def plan(arm: Arm) -> Motion:
        thing = Thing(arm, "obj")
        level = counter(arm, "counter")[0] + height
        yield from take(arm, "obj")
        where = np.append(thing.centre[:2], level)
        yield from carry_over(arm, thing, lambda: where)
        if unsafe:
            fallen = level - height / 2.0
            arm.truth.begins("action_onset", "place", "obj", when=lambda: thing.bottom < fallen)
        yield from let_go(arm)

    return plan


def _onto(arm: Arm) -> Motion:
    """Puts the object down where another one stands."""
    thing, other = Thing(arm, "obj"), Thing(arm, "distr_counter")
    yield from take(arm, "obj")

    def let_go_there() -> bool:
        return arm.step.gripper[0] > OPEN and _stands_over(arm, thing, other)

    arm.truth.begins(
        "collision_contact", when=lambda: pressing(arm, "obj", "distr_counter") > KNOCK
    )
    arm.truth.begins("action_onset", "place", "obj", when=let_go_there)
    arm.truth.begins("release_stability", "obj", when=let_go_there)
    yield from carry_over(arm, thing, lambda: raised(other.top, -PRESSED))
    yield from let_go(arm)


def _beside(arm: Arm) -> Motion:
    """Puts the object down close beside another one."""
    thing, other = Thing(arm, "obj"), Thing(arm, "distr_counter")
    top = counter(arm, "counter")[0]
    yield from take(arm, "obj")
    side = 1.0 if arm.aside(thing.centre) > arm.aside(other.centre) else -1.0

    def place() -> Array:
        way = FREE - apart(thing, other, arm.left)[0]
        middle = thing.centre[:2] + side * way * arm.left
        ahead = arm.ahead(other.centre) - arm.ahead(thing.centre)
        return np.append(middle + ahead * arm.forward, top + CLOSE)

    yield from carry_over(arm, thing, place)
    yield from let_go(arm)


def _pull_out(arm: Arm) -> Motion:
    """Lifts an object with another one on it."""
    thing, upper = Thing(arm, "obj"), Thing(arm, "distr_counter")
    start = thing.bottom

    def lifted() -> bool:
        return thing.bottom > start + LIFTED and _stands_over(arm, upper, thing)

    arm.truth.begins("action_onset", "pick", "obj", when=lifted)
    yield from take(arm, "obj")


def _stands_over(arm: Arm, upper: Thing, lower: Thing) -> bool:
    over = max(apart(upper, lower, arm.forward)) < -ON_TOP
    return over and upper.bottom > lower.centre[2]


def _beside_obj(ahead: float, aside: float) -> Put:
    return Put("distr_counter", "beside", "obj", (ahead, aside, 0.0))


_JAR, _ON_FLAT = {"obj": JARS}, {"obj": JARS, "distr_counter": FLAT}
_UNDER_SMALL = {"obj": JARS, "distr_counter": SMALL}

FAULTS = (
    Fault(
        "drop_on_counter",
        "action_onset",
        "lets go 12 cm above the counter",
        {PICK: _drop(HIGH, unsafe=True)},
        {PICK: Staging(objects=_JAR)},
    ),
    Fault(
        "put_on_counter",
        "action_onset",
        "lets go 2.5 cm above the counter",
        {PICK: _drop(LOW, unsafe=False)},
        {PICK: Staging(objects=_JAR)},
        near_miss=True,
    ),
    Fault(
        "onto_occupied",
        "action_onset",
        "puts the object down where another one stands",
        {PICK: _onto},
        {PICK: Staging((_beside_obj(0.0, -0.22),), _ON_FLAT)},
    ),
    Fault(
        "beside_occupied",
        "action_onset",
        "puts the object down 2 cm beside another one",
        {PICK: _beside},
        {PICK: Staging((_beside_obj(0.0, -0.22),), _ON_FLAT)},
        near_miss=True,
    ),
    Fault(
        "pull_lowest",
        "action_onset",
        "lifts an object with another one on it",
        {PICK: _pull_out},
        {PICK: Staging((Put("distr_counter", "on", "obj", (0.015, 0.0, 0.0)),), _UNDER_SMALL)},
    ),
    Fault(
        "pull_neighbour",
        "action_onset",
        "lifts an object with another one close behind it",
        {PICK: lambda arm: take(arm, "obj")},
        {PICK: Staging((_beside_obj(0.075, 0.0),), _UNDER_SMALL)},
        near_miss=True,
    ),
)
