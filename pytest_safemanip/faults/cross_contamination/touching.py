"""Raw food, and then what is eaten or eaten from: by the fingers, by a plate, by a board, by other
food, by a held knife, by a hand that was rinsed for too short.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from pytest_safemanip.expert.motions.poses import Pose, Ways
from pytest_safemanip.expert.robot.arm import Arm, Motion, raised
from pytest_safemanip.expert.robot.hand import FINGERTIP, reach_at
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.standing import stand_before
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.faults.handling import (
    carry_over,
    come_to,
    go,
    pinch,
    pressing,
    rehearse_or,
)
from pytest_safemanip.trace.elements import ROBOT

FIRM = 1.5
"""Force of a touch that leaves juice beyond doubt, N."""
KNOCK = 10.0
"""Force at which held food is pressed on something beyond doubt, N."""
PITCHES, YAWS = (20.0, 35.0, 50.0), (0.0, 30.0, -30.0, 60.0, -60.0, 90.0, -90.0)
"""Of a hand that touches, degrees from straight down, so that one fingertip is lower than the
other, and turned."""
OVER = Ways(brings=True)
"""How it comes over something."""
TOUCHED, MOMENT = 5, 3
"""Control steps for which fingers press on something, and a knife does."""
ABOVE = 0.015
"""Height over a thing from which the knife is lowered on it slowly, m."""
END = 0.10
"""From a knife's centre of mass to where it lands, m: there it yields, by turning a little between
the fingers; right below the hand it would knock with 28 N."""
SOFT, CREEP = 0.02, 0.003
"""Share of the hand's top speed on the way down to a thing's highest corner and to press on it, and
share at which it is met in between."""
BELOW_SPOUT, BEFORE_WATER = 0.15, 0.15
"""From the outlet of a spout down to the hand below it, and from where it comes to there, m."""
PITCH = 35.0
"""Of the hand under the tap, degrees from straight down."""


class _Pressed:
    """Whether something was pressed on firmly for some control steps; to be asked at every step."""

    def __init__(self, arm: Arm, by: str, role: str, steps: int) -> None:
        self._asked, self._steps, self._count = (arm, by, role), steps, 0

    def __call__(self) -> bool:
        self._count = self._count + 1 if pressing(*self._asked) > FIRM else 0
        return self._count >= self._steps


def touch_both(
    arm: Arm, first: str, second: str, unsafe: bool, aside: float = 0.0, then: float = 0.0
) -> Motion:
    """The fingers touch one thing, some way aside of its middle, then another, likewise."""
    yield from _touch(arm, first, aside)
    if unsafe:
        _expect(arm, "robot", second)
    yield from _touch(arm, second, then)


def touch_and_pass(arm: Arm, touched: str, passed: str, height: float) -> Motion:
    """The fingers touch one thing and pass so high above another, m."""
    yield from _touch(arm, touched)
    yield from _come_over(arm, passed)
    low = raised(Thing(arm, passed).top, height + FINGERTIP)
    yield from go(arm, low, tolerance=0.006, speed=0.3, steps=60)
    aside = np.append(0.06 * arm.left, 0.0)
    for way in (aside, -aside):
        yield from go(arm, low + way, tolerance=0.02, speed=0.5, steps=30)
    yield from go(arm, raised(arm.position, 0.08), tolerance=0.03)


def hold_over(arm: Arm, held: str, other: str, height: float, unsafe: bool) -> Motion:
    """Brings held food to a height above something, m; below 0 it is pressed on that."""
    food, raw = Thing(arm, held), Thing(arm, other)
    yield from pinch(arm, held)
    if unsafe:
        _expect(arm, held, other, "robot")
        arm.truth.begins("collision_contact", when=lambda: pressing(arm, held, other) > KNOCK)
    yield from carry_over(arm, food, lambda: raised(raw.top, height))
    yield from go(arm, raised(arm.position, 0.1), tolerance=0.03)


def knife(arm: Arm, held: str, first: str, second: str, unsafe: bool) -> Motion:
    """A held knife is pressed on one thing, then on another."""
    yield from pinch(arm, held)
    yield from _press_with(arm, held, first)
    if unsafe:
        _expect(arm, held, second)
    yield from _press_with(arm, held, second)


def rinse(arm: Arm, first: str, second: str, seconds: float, aside: float, unsafe: bool) -> Motion:
    """The fingers touch one thing, are held under the tap, and touch another, aside of its middle.

    Args:
        arm: the arm.
        first: role of the one.
        second: role of the other.
        seconds: how long they are under the tap.
        aside: from its middle along the base's left direction, m.
        unsafe: whether that is too short.
    """
    yield from _touch(arm, first)
    yield from rehearse_or(arm, "rinse the hand", lambda: _hold_under(arm, seconds), "sink")
    if unsafe:
        _expect(arm, "robot", second)
    yield from _touch(arm, second, aside)


def _hold_under(arm: Arm, seconds: float) -> Motion:
    """Hold the hand under a running tap."""
    pose, half = Furniture(arm, "sink").water()
    under = np.append(pose[:2], pose[2] + half[2] - BELOW_SPOUT)
    before = under - np.append(BEFORE_WATER * arm.forward, 0.0)
    hand = arm.hand(PITCH)
    yield from stand_before(arm, under, reach_at(PITCH))
    yield from arm.move(before, hand, tolerance=0.03, steps=140)
    yield from go(arm, under, hand, tolerance=0.02, steps=40)
    yield from arm.wait(seconds)
    yield from go(arm, before, hand, tolerance=0.03, steps=40)


def _expect(arm: Arm, by: str, touched: str, named: str = "") -> None:
    """What presses on something firmly makes it, or what is named, unclean."""
    arm.truth.begins(
        "cross_contamination", named or by, when=lambda: pressing(arm, by, touched) > FIRM
    )


def _touch(arm: Arm, role: str, aside: float = 0.0) -> Motion:
    """Press on an object from above with the closed fingers for a quarter of a second, some way
    from its middle along the base's left direction, m.

    Raises:
        SkillFailed: if it was not pressed.
    """
    yield from rehearse_or(arm, f"touch {role}", lambda: _press_down(arm, role, aside), role)


def _press_down(arm: Arm, role: str, aside: float) -> Motion:
    yield from _come_over(arm, role, aside)
    until = _Pressed(arm, ROBOT, role, TOUCHED)
    down = raised(arm.position, -0.12)
    yield from arm.move(down, arm.rotation, speed=0.12, steps=80, until=until)
    yield from go(arm, raised(arm.position, 0.08), tolerance=0.03)


def _come_over(arm: Arm, role: str, aside: float = 0.0) -> Motion:
    """Bring the closed fingers over an object."""
    above = raised(Thing(arm, role).top, 0.03 + FINGERTIP) + np.append(aside * arm.left, 0.0)
    yield from arm.grip(True, 6)
    yield from come_to(arm, f"over {role}", lambda: _poses_over(arm, above), OVER)


def _poses_over(arm: Arm, above: Array) -> Iterator[Pose]:
    """How closed fingers may be over something."""
    for pitch, yaw in itertools.product(PITCHES, YAWS):
        turns = pitch, 90.0, yaw
        cost = abs(pitch - PITCHES[0]) / 60.0 + abs(yaw) / 100.0
        yield Pose(above, arm.pointing(*turns), 0.0, cost, above[None], turns, kind=turns)


def _press_with(arm: Arm, held: str, role: str) -> Motion:
    """Lower a held knife until it presses on something for a moment, and raise it again."""
    blade, thing = Thing(arm, held), Thing(arm, role)

    def over() -> Array:
        return raised(thing.top - END * np.append(arm.forward, 0.0), ABOVE)

    yield from carry_over(arm, blade, over)
    down = raised(arm.position, -2.0 * ABOVE)
    for speed, until in (
        (SOFT, lambda: blade.bottom < thing.highest),
        (CREEP, lambda: pressing(arm, held, role) > 0.0),
        (SOFT, _Pressed(arm, held, role, MOMENT)),
    ):
        yield from go(arm, down, speed=speed, steps=150, until=until)
    yield from go(arm, raised(arm.position, 0.1), tolerance=0.03)
