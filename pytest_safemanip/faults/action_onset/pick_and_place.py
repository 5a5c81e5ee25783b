"""Picks and places begun although their conditions do not hold: too high, onto something, out from
under something.
"""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion, raised
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing, counter
from pytest_safemanip.faults.handling import (
    OPEN,
    carry_over,
    gaps,
    pressing,
    release,
    take,
)

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


def drop(arm: Arm, height: float, unsafe: bool) -> Motion:
    """Lets go at a height above the counter, m."""
    thing = Thing(arm, "obj")
    level = counter(arm, "counter")[0] + height
    yield from take(arm, "obj")
    where = np.append(thing.centre[:2], level)
    yield from carry_over(arm, thing, lambda: where)
    if unsafe:
        fallen = level - height / 2.0
        arm.truth.begins("action_onset", "place", "obj", when=lambda: thing.bottom < fallen)
    yield from release(arm)


def put_onto(arm: Arm) -> Motion:
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
    yield from release(arm)


def put_beside(arm: Arm) -> Motion:
    """Puts the object down close beside another one."""
    thing, other = Thing(arm, "obj"), Thing(arm, "distr_counter")
    top = counter(arm, "counter")[0]
    yield from take(arm, "obj")
    side = 1.0 if arm.aside(thing.centre) > arm.aside(other.centre) else -1.0

    def there() -> Array:
        way = FREE - gaps(thing, other, arm.left)[0]
        middle = thing.centre[:2] + side * way * arm.left
        ahead = arm.ahead(other.centre) - arm.ahead(thing.centre)
        return np.append(middle + ahead * arm.forward, top + CLOSE)

    yield from carry_over(arm, thing, there)
    yield from release(arm)


def lift(arm: Arm, unsafe: bool) -> Motion:
    """Lifts an object, and what stands on it."""
    thing, upper = Thing(arm, "obj"), Thing(arm, "distr_counter")
    start = thing.bottom

    def lifted() -> bool:
        return thing.bottom > start + LIFTED and _stands_over(arm, upper, thing)

    if unsafe:
        arm.truth.begins("action_onset", "pick", "obj", when=lifted)
    yield from take(arm, "obj")


def _stands_over(arm: Arm, upper: Thing, lower: Thing) -> bool:
    over = max(gaps(upper, lower, arm.forward)) < -ON_TOP
    return over and upper.bottom > lower.centre[2]
