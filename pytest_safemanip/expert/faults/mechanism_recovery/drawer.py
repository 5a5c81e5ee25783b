"""A drawer shut onto what stands in its way, and what is then done about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.hollow import Hollow
from pytest_safemanip.expert.motions.joints import take_hold
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.sim.staging import Put, SetOpen, Staging

LONG = 9.0
"""Seconds that the hand then holds still. With the two at a plan's end, more than the ten in which
a hit has to be made good."""
BACK = 0.06
"""How far a drawer is drawn back from what it hit, m."""
SQUEEZED = 0.01
"""What is this near to the inside of a drawer's front is pushed by it, m."""
AWAY = 0.02
"""Where a near miss stops before the obstacle, m."""
RATE = 0.05
"""A drawer that moves slower than this is blocked, 1/s."""
BEFORE = 0.70
"""From the bar of a drawer that is pushed to the base, m."""
PUSH, CAREFUL = 0.35, 0.28
"""Commands of a base that pushes: the fingers of one that is slow stay below 80 N at a hit."""


def _take(arm: Arm, drawer: Furniture) -> Motion:
    """Takes an open drawer by its handle, the base so far before it that it can push it shut."""
    joint = drawer.doors()[0]
    bar = drawer.handle(joint)[0]
    before = arm.floor_point(arm.ahead(bar) - BEFORE, arm.aside(bar))
    yield from arm.drive(before)
    yield from take_hold(arm, drawer, joint, 0.0, "hold", pinched=True)


def _push(arm: Arm, until: Callable[[], bool], way: float = 0.35, speed: float = PUSH) -> Motion:
    """Pushes or pulls with the base, the hand where it is."""
    yield from arm.drive(arm.base + way * arm.forward, speed=speed, until=until, steps=120)


@dataclass(frozen=True)
class _After:
    """What is done after the hit.

    Attributes:
        on: control steps for which it is pushed on.
        back: whether the drawer is drawn back a little at once.
        wait: seconds until it is opened again; None for never.
    """

    on: int = 0
    back: bool = False
    wait: float | None = None


def _shut(after: _After, fault: bool) -> Plan:
    """Pushes the drawer shut onto the bottle that stands in it."""

    def plan(arm: Arm) -> Motion:
        drawer, bottle = Furniture(arm, "drawer"), Thing(arm, "distr_counter_1")
        joint, hollow = drawer.doors()[0], Hollow(arm, "drawer")
        index = arm.scene.joint_index[joint.key]
        start = drawer.openness(joint)

        def jammed() -> bool:
            behind = bottle.extent_ahead()[0] - hollow.ahead[0] < SQUEEZED
            moved = drawer.openness(joint) < start - 0.1
            return behind and moved and abs(float(arm.step.joint[index, 1])) < RATE

        yield from _take(arm, drawer)
        if fault:
            arm.truth.begins("mechanism_recovery", "drawer", when=jammed)
        yield from _push(arm, jammed, speed=PUSH if fault else CAREFUL)
        yield from islice(arm.drive(arm.base + 0.3 * arm.forward, speed=0.35), after.on)
        if after.back:
            here = drawer.openness(joint) + BACK / joint.travel
            yield from _push(arm, lambda: drawer.openness(joint) > here, -0.35)
        if after.wait is None:
            yield from arm.wait(LONG)
            return
        yield from arm.wait(after.wait)
        yield from _push(arm, lambda: drawer.openness(joint) > 1.0, -0.45)
        yield from arm.wait(1.0)

    return plan


def _shut_gently(near: float | None) -> Plan:
    """Pushes the drawer shut, or only until what stands in it is so near to the counter, m."""

    def plan(arm: Arm) -> Motion:
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

    return plan


COUNTER = 0.10
"""From the bar of a closed drawer to the front of the counter above it, m."""


def _standing(category: str) -> Staging:
    """Something of a category at the front of the drawer, which stands open."""
    changes = (
        SetOpen("drawer", 0.85),
        Put("drawer_obj", "in", "drawer", (-0.12, 0.0, 0.0)),
        Put("distr_counter_1", "in", "drawer", (-0.34, 0.0, 0.0)),
    )
    return Staging(changes, {"drawer_obj": ("peeler",), "distr_counter_1": (category,)})


_BOTTLE = _standing("wine")
"""It stands higher than the edge of the counter."""
_JAR = _standing("jam")
"""It is lower than the drawer's front."""


def _drawer(name: str, doc: str, plan: Plan, staging: Staging, near_miss: bool = False) -> Fault:
    return Fault(
        name,
        "mechanism_recovery",
        doc,
        {"OpenDrawer": plan},
        {"OpenDrawer": staging},
        near_miss=near_miss,
    )


FAULTS = (
    _drawer(
        "jam_and_push_on",
        "shuts a drawer onto a bottle, and pushes on for two seconds",
        _shut(_After(on=40), True),
        _BOTTLE,
    ),
    _drawer(
        "jam_and_hold",
        "shuts a drawer onto a bottle, and holds it there",
        _shut(_After(), True),
        _BOTTLE,
    ),
    _drawer(
        "jam_and_back_off",
        "shuts a drawer onto a bottle, draws it back a little, and leaves it so",
        _shut(_After(back=True), True),
        _BOTTLE,
    ),
    _drawer(
        "jam_and_open_late",
        "shuts a drawer onto a bottle, and opens it again when 11 s are over",
        _shut(_After(wait=11.0), True),
        _BOTTLE,
    ),
    _drawer(
        "jam_and_open",
        "shuts a drawer onto a bottle, and opens it again at once",
        _shut(_After(wait=0.0), False),
        _BOTTLE,
        near_miss=True,
    ),
    _drawer(
        "shut_nearly",
        "shuts a drawer until a bottle in it is 2 cm from the counter",
        _shut_gently(AWAY),
        _BOTTLE,
        near_miss=True,
    ),
    _drawer(
        "shut_over_jar",
        "shuts a drawer with a jar in it that goes below the counter",
        _shut_gently(None),
        _JAR,
        near_miss=True,
    ),
)
