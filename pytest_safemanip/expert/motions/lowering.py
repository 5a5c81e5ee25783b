"""Lowering: what is held is set down where the hand is, and the empty hand draws back from it."""

from __future__ import annotations

import math

from pytest_safemanip.expert.motions.approaching import draw_back
from pytest_safemanip.expert.motions.attitudes import ASKEW
from pytest_safemanip.expert.motions.poses import Reach
from pytest_safemanip.expert.motions.travelling import check_bent
from pytest_safemanip.expert.robot.arm import Arm, Motion, raised
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.contacts import carriers, palm_meets
from pytest_safemanip.expert.world.things import Thing

DEEP = 0.3
"""How far it is lowered at most, m."""
LAGS, STRIDE = 10, 0.0125
"""Control steps by which the hand comes after what it is told, and how far it goes down in one at
its top speed, m: a quarter of what it is told, for it yields to its load."""
SPEED = 0.12
"""Share of the hand's top speed at which it is lowered."""
FASTEST, CREEPING, CREPT = 0.2, 15, 0.3
"""Up to which share of its top speed a hand is lowered faster that creeps: that in so many steps
comes down by less than this share of what it should. An arm that reaches far out does so.
"""
PRECISELY = 0.004
"""How far beside its way down the hand may be, m."""
OFF = 0.35
"""How far the base draws back at least from what is let go, m."""


def set_down(
    arm: Arm,
    thing: Thing,
    depth: float = DEEP,
    speed: float = SPEED,
    above: Array | None = None,
    hand: Array | None = None,
) -> Motion:
    """Lower a held thing until it stands on something, or the palm does.

    Args:
        arm: the arm.
        thing: the thing.
        depth: how far at most, m.
        speed: share of the hand's top speed.
        above: where the hand is first (3,); None for where it is.
        hand: its orientation (3, 3); None for the present one.
    """
    yield from arm.move(
        arm.position if above is None else above,
        hand,
        tolerance=PRECISELY,
        turn_tolerance=0.3 if hand is None else ASKEW,
        steps=25,
        required=False,
        exact=True,
    )
    yield from _lower(arm, thing, raised(arm.position, -depth), speed)


def _lower(arm: Arm, thing: Thing, low: Array, speed: float) -> Motion:
    """Lower a held thing until it stands, to a point (3,) at most; faster if the hand creeps."""
    stride, heights = STRIDE * speed, list[float]()

    def stands() -> bool:
        return bool(carriers(arm, thing)) or palm_meets(arm, thing)

    def creeps() -> bool:
        late = heights[LAGS:][-CREEPING:]
        down = late[0] - late[-1] if len(late) == CREEPING else math.inf
        return down < CREPT * CREEPING * stride

    def ends() -> bool:
        heights.append(float(arm.position[2]))
        return stands() or (speed < FASTEST and creeps())

    yield from arm.move(
        low,
        arm.rotation,
        speed=speed,
        steps=LAGS + round(1.2 * float(arm.position[2] - low[2]) / stride),
        until=ends,
        required=False,
    )
    if speed < FASTEST and creeps() and not stands():
        yield from _lower(arm, thing, low, 2.0 * speed)


def withdraw(arm: Arm, reach: Reach) -> Motion:
    """Draw an empty hand off what it let go, and back, as high as if it had not been lowered.

    Raises:
        SkillFailed: if the base does not get there, or if the arm is straight, and is used again.
    """
    lowered = max(0.0, float((reach.pose.point - arm.position)[2]))
    out = raised(reach.leave, lowered)
    yield from arm.move(arm.position + out, tolerance=0.02, speed=0.5, steps=50, required=False)
    yield from draw_back(arm, reach, least=OFF)
    if arm.upcoming:
        check_bent(arm)
