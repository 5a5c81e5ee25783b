"""Putting a held stick into a vessel: a straw into a glass."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.putting import leave
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.robot.hand import reach_at
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.contacts import carried_by_something
from pytest_safemanip.expert.world.standing import stand_before
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.geometry import matrix

PITCH = 70.0
"""Degrees from straight down, as far as the hand tips over a counter: a stick across it stands as
steeply."""
END_OVER_RIM = 0.03
"""From the rim of a vessel to the end of a stick that is about to go in, m."""
FLOOR = 0.012
"""From the underside of a vessel to how deep the end of a stick goes, m: it drops the rest."""
FINGERS = 0.028
"""From the rim up to the grip point, m: opening fingers stay over the rim, the lower edge of the
pads is 15 mm below the grip point of a tipped hand."""
LEAST_IN = 0.04
"""How far below the rim the end must come for a stick to fall in, and not out, m."""
FAR_RIM = 0.4
"""Where a leaning stick passes a rim, from its middle towards the far side, share of its radius:
its end has as much room behind it."""


def insert(arm: Arm, role: str, vessel_role: str) -> Motion:
    """Tip a held stick up, lower its near end into a vessel, let go, and draw back.

    Raises:
        SkillFailed: if too little of it is below the hand.
    """
    stick, vessel = Thing(arm, role), Thing(arm, vessel_role)
    away = arm.position + np.append(0.10 * arm.forward, 0.02)
    yield from arm.move(away, tolerance=0.03, speed=0.5, steps=40)
    for pitch in (PITCH / 2.0, PITCH):
        yield from arm.move(
            arm.position, arm.hand(pitch), tolerance=0.04, turn_tolerance=0.1, steps=80
        )
    hand, rim = arm.rotation, vessel.top
    if arm.position[2] - stick.bottom < FINGERS + LEAST_IN:
        raise SkillFailed("the stick is held too near its lower end")
    clear = rim[2] + END_OVER_RIM - stick.bottom
    if clear > 0.0:
        yield from arm.move(raised(arm.position, clear), hand, tolerance=0.02, speed=0.6)
    yield from stand_before(arm, rim, reach_at(PITCH), speed=0.5)
    radius = vessel.sides()[0][1] / 2.0
    through = rim + arm.onward(FAR_RIM * radius)

    def into(depth: float) -> Array:
        """Where the hand is when the stick's end is so far below the rim, along the stick."""
        end, up = lower_end(stick)
        return np.asarray(arm.position + through - depth / up[2] * up - end, np.float64)

    yield from arm.move(lambda: into(-END_OVER_RIM), hand, tolerance=0.006, speed=0.4, exact=True)
    deep = rim[2] - vessel.bottom - FLOOR

    def arrived() -> bool:
        low = arm.position[2] < rim[2] + FINGERS or stick.bottom < vessel.bottom + FLOOR
        return low or carried_by_something(arm, stick)

    yield from arm.move(
        lambda: into(deep),
        hand,
        tolerance=0.008,
        speed=0.15,
        steps=80,
        until=arrived,
        required=False,
    )
    yield from arm.grip(False)
    yield from leave(arm)


def lower_end(stick: Thing) -> tuple[Array, Array]:
    """The lower end (3,) of a stick, and the direction from there to the upper one (3,)."""
    axes = matrix(stick.pose[3:])
    half = np.ptp(stick.corners @ axes, axis=0) / 2.0
    long = int(np.argmax(half))
    up = axes[:, long] * math.copysign(1.0, axes[2, long])
    return stick.centre - half[long] * up, up
