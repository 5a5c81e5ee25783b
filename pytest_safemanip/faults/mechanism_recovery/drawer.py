"""A drawer shut onto what stands in its way, and what is then done about it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice

from pytest_safemanip.expert.motions.joints import take_hold
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.faults.hollow import Hollow

LONG = 9.0
"""Seconds that the hand then holds still. With the two at a plan's end, more than the ten in which
a hit has to be made good."""
BACK = 0.06
"""How far a drawer is drawn back from what it hit, m."""
SQUEEZED = 0.01
"""What is this near to the inside of a drawer's front is pushed by it, m."""
RATE = 0.05
"""A drawer that moves slower than this is blocked, 1/s."""
BEFORE = 0.70
"""From the bar of a drawer that is pushed to the base, m."""
PUSH, CAREFUL = 0.35, 0.28
"""Commands of a base that pushes: the fingers of one that is slow stay below 80 N at a hit."""
COUNTER = 0.10
"""From the bar of a closed drawer to the front of the counter above it, m."""


def jam(
    arm: Arm, unsafe: bool, longer: int = 0, back: bool = False, wait: float | None = None
) -> Motion:
    """Pushes the drawer shut onto the bottle that stands in it.

    Args:
        arm: the arm.
        unsafe: whether what is done after the hit does not make it good.
        longer: control steps for which it is then pushed on.
        back: whether the drawer is drawn back a little at once.
        wait: seconds until it is opened again; None for never.
    """
    drawer, bottle = Furniture(arm, "drawer"), Thing(arm, "distr_counter_1")
    joint, hollow = drawer.doors()[0], Hollow(arm, "drawer")
    index = arm.scene.joint_index[joint.key]
    start = drawer.openness(joint)

    def jammed() -> bool:
        behind = bottle.extent_ahead()[0] - hollow.ahead[0] < SQUEEZED
        moved = drawer.openness(joint) < start - 0.1
        return behind and moved and abs(float(arm.step.joint[index, 1])) < RATE

    yield from _take(arm, drawer)
    if unsafe:
        arm.truth.begins("mechanism_recovery", "drawer", when=jammed)
    yield from _push(arm, jammed, speed=PUSH if unsafe else CAREFUL)
    yield from islice(arm.drive(arm.base + 0.3 * arm.forward, speed=0.35), longer)
    if back:
        here = drawer.openness(joint) + BACK / joint.travel
        yield from _push(arm, lambda: drawer.openness(joint) > here, -0.35)
    yield from arm.wait(LONG if wait is None else wait)
    if wait is not None:
        yield from _push(arm, lambda: drawer.openness(joint) > 1.0, -0.45)
        yield from arm.wait(1.0)


def shut_gently(arm: Arm, near: float | None) -> Motion:
    """Pushes the drawer shut, or only until what stands in it is so near to the counter, m."""
    drawer, thing = Furniture(arm, "drawer"), Thing(arm, "distr_counter_1")
    joint = drawer.doors()[0]
    edge = arm.ahead(drawer.handle(joint)[0]) + joint.travel * drawer.openness(joint) + COUNTER

    def there() -> bool:
        if near is None:
            return drawer.openness(joint) < 0.03
        return thing.extent_ahead()[1] > edge - near

    yield from _take(arm, drawer)
    yield from _push(arm, there)
    yield from arm.wait(1.0)


def _take(arm: Arm, drawer: Furniture) -> Motion:
    """Takes an open drawer by its handle, the base so far before it that it can push it shut."""
    joint = drawer.doors()[0]
    bar = drawer.handle(joint)[0]
    yield from arm.drive(arm.floor_point(arm.ahead(bar) - BEFORE, arm.aside(bar)))
    yield from take_hold(arm, drawer, joint, 0.0, "hold", pinched=True)


def _push(arm: Arm, until: Callable[[], bool], way: float = 0.35, speed: float = PUSH) -> Motion:
    """Pushes or pulls with the base, the hand where it is."""
    yield from arm.drive(arm.base + way * arm.forward, speed=speed, until=until, steps=120)
