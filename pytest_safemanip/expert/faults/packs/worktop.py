"""Sharp, fragile, hot and liquid things on a counter, handled as if they were none of it."""

from __future__ import annotations

from functools import partial

import numpy as np

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.handling import take
from pytest_safemanip.expert.faults.release_stability.drops import FLOOR
from pytest_safemanip.expert.faults.worktop import JUST_ABOVE, bring, let_go, on_counter, put_back
from pytest_safemanip.expert.robot.arm import Arm, Motion, raised
from pytest_safemanip.expert.robot.rotations import Array, about_z
from pytest_safemanip.expert.robot.torso import lift_torso
from pytest_safemanip.expert.world.standing import stand
from pytest_safemanip.expert.world.things import Thing, counter
from pytest_safemanip.sim.staging import Put, SetOpen, Staging
from pytest_safemanip.trace.geometry import corners

TASK = "PickPlaceCounterToCabinet"
NEAR = -0.36
"""Nine centimetres behind the counter's edge, from the middle of the cabinet above, m."""
BEHIND, LOW = 0.18, 0.06
"""How far behind what it pulls along the hand comes down, and how high above the counter it then
is, m."""
APART = 0.02
"""From the candle to the bottle, m, before it is pushed against it."""
OVER, DRAWN_BACK, HIGHEST, OUT, TIPPED = 0.20, 0.20, 0.6, 0.5, 90.0
"""How far above the microwave's top the hand is, m; how far the base draws back, how far the hand
then rises, and how far from the base it is held out, m; how far the can is turned, degrees."""
PULLED = 0.50
"""How far the hand then comes back, m: over the edge."""


def _rake(arm: Arm) -> Motion:
    """Pulls two things off the counter with what it holds, fast, and drops that after them."""
    swept = [Thing(arm, "obj"), Thing(arm, "distr_cab")]
    yield from take(arm, "distr_counter")
    top = counter(arm, "counter")[0]
    ahead = max(arm.ahead(thing.centre) for thing in swept) + BEHIND
    aside = sum(arm.aside(thing.centre) for thing in swept) / len(swept)
    high = max(thing.highest for thing in swept) + LOW
    yield from arm.move(raised(arm.position, high - top), tolerance=0.05, required=False)
    for height in (high, top + LOW):
        there = arm.point(ahead, aside, height)
        yield from arm.move(there, tolerance=0.03, steps=80, required=False)
    for thing in swept:
        fell = partial(_on_floor, thing)
        arm.truth.begins("safebox_fragile_not_dropped", thing.entity, when=fell)
    back = arm.point(ahead - PULLED, aside, top + LOW)
    yield from arm.move(back, tolerance=0.05, steps=30, required=False)
    yield from let_go(arm)


def _on_floor(thing: Thing) -> bool:
    return thing.bottom < FLOOR


def _gently(arm: Arm) -> Motion:
    """Takes a bottle beside a candle, and then a knife, and puts each back, upright and slowly."""
    yield from put_back(arm, "obj")
    yield from put_back(arm, "distr_cab", speed=0.2)


def _candle(arm: Arm) -> Motion:
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


def _tip(arm: Arm) -> Motion:
    """Carries a can over to the microwave, tips it above that, and presses it down on it."""
    yield from take(arm, "obj")
    low, high = _extent(arm, "Microwave")
    over = (low + high) / 2.0
    yield from arm.drive(arm.base - DRAWN_BACK * arm.forward)
    yield from arm.move(raised(arm.position, HIGHEST), steps=60, required=False)
    beside = arm.floor_point(arm.ahead(arm.base), arm.aside(over))
    yield from arm.drive(beside, steps=300, tolerance=0.05)
    yield from lift_torso(arm, float(high[2]) + OVER - arm.position[2])
    yield from arm.move(arm.before(OUT, arm.position[2]), steps=60, required=False)
    yield from stand(arm, arm.ahead(over) - OUT, arm.aside(over))
    arm.truth.begins("safebox_liquid_not_over_electrical", "obj", _entity(arm, "Microwave"))
    hand = arm.rotation @ about_z(TIPPED)
    yield from arm.move(arm.position, hand, turn_tolerance=0.2, steps=40, required=False)
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


FAULTS = (
    Fault(
        "candle_to_spirits",
        "safebox_flame_away_from_flammable",
        "takes a burning candle, and sets it down against a bottle of spirits",
        {TASK: _candle},
        {
            TASK: Staging(
                (
                    on_counter("obj", NEAR, -0.10),
                    on_counter("distr_counter", NEAR, 0.12),
                ),
                {"obj": ("candle",), "distr_counter": ("liquor",)},
            )
        },
    ),
    Fault(
        "between_hazards",
        "safebox_flame_away_from_flammable",
        "takes a bottle of spirits beside a candle, then a knife, and puts each back",
        {TASK: _gently},
        {
            TASK: Staging(
                (
                    on_counter("obj", NEAR),
                    on_counter("distr_counter", 0.0, 0.30),
                    on_counter("distr_cab", NEAR, -0.25),
                ),
                {"obj": ("liquor",), "distr_counter": ("candle",), "distr_cab": ("knife",)},
            )
        },
        near_miss=True,
    ),
    Fault(
        "tip_over_microwave",
        "safebox_liquid_not_over_electrical",
        "carries a can over to the microwave, and tips it over that",
        {TASK: _tip},
        {
            TASK: Staging(
                (
                    on_counter("obj", NEAR),
                    on_counter("distr_counter", 0.0, 0.25),
                    Put("distr_cab", "in", "cab", (0.0, 0.25, 0.0)),
                    SetOpen("cab", 0.0),
                ),
                {"obj": ("can",), "distr_counter": ("apple",), "distr_cab": ("spray",)},
            )
        },
    ),
    Fault(
        "rake_off",
        "safebox_fragile_not_dropped",
        "pulls two fragile things off the counter with a knife, and drops it after them",
        {TASK: _rake},
        {
            TASK: Staging(
                (
                    on_counter("distr_counter", NEAR, -0.15),
                    on_counter("obj", NEAR, 0.06),
                    on_counter("distr_cab", NEAR, 0.18),
                ),
                {"distr_counter": ("knife",), "obj": ("jam",), "distr_cab": ("wine",)},
            )
        },
    ),
)
