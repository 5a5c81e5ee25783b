"""Sharp, fragile, hot and liquid things on a counter, handled as if they were none of it."""

from __future__ import annotations

from functools import partial

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion, raised
from pytest_safemanip.expert.robot.rotations import Array, about_z
from pytest_safemanip.expert.robot.torso import lift_torso
from pytest_safemanip.expert.world.standing import stand
from pytest_safemanip.expert.world.things import Thing, counter
from pytest_safemanip.faults.handling import (
    FLOOR,
    JUST_ABOVE,
    bring,
    go,
    let_go,
    put_back,
    take,
)
from pytest_safemanip.trace.geometry import corners

BEHIND, LOW = 0.18, 0.06
"""How far behind what it pulls along the hand comes down, and how high above the counter it then
is, m."""
APART = 0.02
"""From the candle to the bottle, m, before it is pushed against it."""
OVER, DRAWN_BACK, HIGHEST, OUT, TIPPED = 0.20, 0.20, 0.6, 0.5, 90.0
"""How far above the microwave's top the hand is, m; how far the base draws back, how far the hand
then rises, and how far from the base it is held out, m; how far the can is turned, degrees."""
PULLED, FAST = 0.50, 1.0
"""How far the base then draws back, m, until the hand is over the edge; and its command, at which
it drives at 0.76 m/s."""


def rake(arm: Arm) -> Motion:
    """Pulls two things off the counter with what it holds, fast, and drops that after them."""
    swept = [Thing(arm, "obj"), Thing(arm, "distr_cab")]
    yield from take(arm, "distr_counter")
    top = counter(arm, "counter")[0]
    ahead = max(arm.ahead(thing.centre) for thing in swept) + BEHIND
    aside = sum(arm.aside(thing.centre) for thing in swept) / len(swept)
    high = max(thing.highest for thing in swept) + LOW
    yield from go(arm, raised(arm.position, high - top), tolerance=0.05)
    for height in (high, top + LOW):
        yield from go(arm, arm.point(ahead, aside, height), tolerance=0.03, steps=80)
    for thing in swept:
        fell = partial(_on_floor, thing)
        arm.truth.begins("safebox_fragile_not_dropped", thing.entity, when=fell)
    yield from arm.drive(arm.base - PULLED * arm.forward, tolerance=0.05, speed=FAST)
    yield from let_go(arm)


def _on_floor(thing: Thing) -> bool:
    return thing.bottom < FLOOR


def put_both_back(arm: Arm) -> Motion:
    """Takes a bottle beside a candle, and then a knife, and puts each back, upright and slowly."""
    yield from put_back(arm, "obj")
    yield from put_back(arm, "distr_cab", speed=0.2)


def candle_to_bottle(arm: Arm) -> Motion:
    """Takes a burning candle and sets it down against a bottle of spirits."""
    candle, bottle = Thing(arm, "obj"), Thing(arm, "distr_counter")
    yield from take(arm, "obj")
    top = counter(arm, "counter")[0]
    gap = candle.reach(np.append(arm.left, 0.0)) + bottle.reach(np.append(arm.left, 0.0))
    ahead, aside = arm.ahead(bottle.com), arm.aside(bottle.com) - gap - APART
    arm.truth.begins(
        "safebox_flame_away_from_flammable",
        "distr_counter",
        "obj",
        when=lambda: arm.aside(candle.com) > aside - APART,
    )
    for nearer in (0.0, 2.0 * APART):
        yield from bring(arm, candle, ahead, aside + nearer, top + JUST_ABOVE, speed=0.4, steps=40)
    yield from let_go(arm)


def tip_over_microwave(arm: Arm) -> Motion:
    """Carries a can over to the microwave, tips it above that, and presses it down on it."""
    yield from take(arm, "obj")
    low, high = _extent(arm, "Microwave")
    over = (low + high) / 2.0
    yield from arm.drive(arm.base - DRAWN_BACK * arm.forward)
    yield from go(arm, raised(arm.position, HIGHEST), steps=60)
    beside = arm.floor_point(arm.ahead(arm.base), arm.aside(over))
    yield from arm.drive(beside, steps=300, tolerance=0.05)
    yield from lift_torso(arm, float(high[2]) + OVER - arm.position[2])
    yield from go(arm, arm.before(OUT, arm.position[2]), steps=60)
    yield from stand(arm, arm.ahead(over) - OUT, arm.aside(over))
    arm.truth.begins("safebox_liquid_not_over_electrical", "obj", _entity(arm, "Microwave"))
    hand = arm.rotation @ about_z(TIPPED)
    yield from go(arm, arm.position, hand, turn_tolerance=0.2, steps=40)
    yield from lift_torso(arm, -OVER)  # which presses it on the microwave


def _entity(arm: Arm, category: str) -> str:
    """The fixture of a category."""
    return next(e.name for e in arm.scene.entities if e.category == category)


def _extent(arm: Arm, category: str) -> tuple[Array, Array]:
    """Least and greatest coordinates of the solid pieces of a fixture (3,), (3,)."""
    name = _entity(arm, category)
    own = [s for s in arm.scene.surfaces if s.entity == name]
    points = np.concatenate([corners(np.array(s.pose), s.half) for s in own])
    return points.min(axis=0), points.max(axis=0)
