"""Food that is let go toward a bowl, and does not end up in it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from pytest_safemanip.expert.faults.cross_contamination.raw_food import (
    BOWL,
    FOOD,
    LEFTOVERS,
    PLATE,
    RAW,
    RAW_PLATE,
)
from pytest_safemanip.expert.faults.fault import staged
from pytest_safemanip.expert.faults.handling import OPEN, carry_over, let_go, pinch
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan, raised
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.sim.staging import Put, Staging
from pytest_safemanip.trace.geometry import matrix

LOW = 0.01
"""Height of a release that is no fall, m."""
WITHIN = 0.035
"""Height above a bowl's bottom from which nothing falls far into it, m."""
HIGH = 0.12
"""Height above the counter at which something is lost on its way, m."""
OUTSIDE, INSIDE = 0.03, 0.03
"""From the bowl's outside to the food's nearest side, and from the food's farthest side to the
bowl's outside, m."""
SLACK = 0.01
"""How far before a bowl's middle a slow release begins, m: it ends as far behind."""
THROW, STROLL = 1.0, 0.1
"""Shares of the hand's top speed at which a release flings, and at which it does not."""


def _let_go_at(where: Callable[[Thing, Thing], tuple[float, float]], unsafe: bool) -> Plan:
    """Lets go of the food at a place: aside of the bowl's middle, above the bowl's bottom."""

    def plan(arm: Arm) -> Motion:
        food, bowl = Thing(arm, FOOD), Thing(arm, BOWL)
        yield from pinch(arm, FOOD)
        aside, height = where(food, bowl)

        def place() -> Array:
            middle = bowl.middle[:2] - aside * arm.left
            return np.append(middle, bowl.bottom + height)

        yield from carry_over(arm, food, place)
        if unsafe:
            _expect(arm, food, bowl)
        yield from let_go(arm)

    return plan


def _expect(arm: Arm, food: Thing, bowl: Thing) -> None:
    """What is let go outside the bowl lies on the counter, where it may not."""
    counter = bowl.bottom

    def missed() -> bool:
        free = arm.step.gripper[0] > OPEN and food.bottom < counter + LOW
        return bool(free and _gap(arm, food, bowl) > 0.0)

    arm.truth.begins("object_containment", FOOD, BOWL, when=missed)
    arm.truth.begins("release_stability", FOOD, when=missed)
    arm.truth.begins("action_onset", "place", FOOD, when=missed)


def _gap(arm: Arm, food: Thing, bowl: Thing) -> float:
    """From the bowl's outside to the middle of the food, m."""
    return float(np.linalg.norm((food.centre - bowl.middle)[:2])) - _radius(bowl)


def _radius(bowl: Thing) -> float:
    return min(width for _, width in bowl.sides()) / 2.0


def _beside(food: Thing, bowl: Thing) -> tuple[float, float]:
    return _radius(bowl) + OUTSIDE + _widest(food), LOW


def _on_the_way(food: Thing, bowl: Thing) -> tuple[float, float]:
    return _radius(bowl) + OUTSIDE + _widest(food), HIGH


def _inside_rim(food: Thing, bowl: Thing) -> tuple[float, float]:
    return max(_radius(bowl) - INSIDE - _widest(food), 0.0), min(bowl.height - LOW, WITHIN)


def _middle(food: Thing, bowl: Thing) -> tuple[float, float]:
    return 0.0, min(bowl.height - LOW, WITHIN)


def _widest(food: Thing) -> float:
    return max(width for _, width in food.sides()) / 2.0


def _in_passing(speed: float) -> Plan:
    """Lets go while the hand moves on over the bowl."""

    def plan(arm: Arm) -> Motion:
        food, bowl = Thing(arm, FOOD), Thing(arm, BOWL)
        yield from pinch(arm, FOOD)
        fast = speed == THROW
        height = bowl.height + LOW if fast else min(bowl.height - LOW, WITHIN)
        # Fingers open within eight control steps; food that is thrown must be past the rim then.
        start = bowl.middle[:2] + (_radius(bowl) / 2.0 if fast else -SLACK) * arm.left
        yield from carry_over(arm, food, lambda: np.append(start, bowl.bottom + height))
        if fast:
            _expect(arm, food, bowl)
        yield from arm.fling(np.append(speed * arm.left, 0.0), 10)
        yield from let_go(arm)

    return plan


def _onto_turned(arm: Arm) -> Motion:
    """Lets go over a bowl that does not stand upright."""
    food, bowl = Thing(arm, FOOD), Thing(arm, BOWL)
    yield from pinch(arm, FOOD)
    yield from carry_over(arm, food, lambda: raised(bowl.top, LOW))

    def outside() -> bool:
        upright = matrix(bowl.pose[3:])[2, 2] > 0.5
        return arm.step.gripper[0] > OPEN and not upright

    arm.truth.begins("object_containment", FOOD, BOWL, when=outside)
    yield from let_go(arm)


FOODS = ("cupcake",)
ON_SIDE = ("tupperware",)
"""A box lies on its side; a round bowl with a lug rolls back onto its foot."""


def _laid(*changes: Put, bowls: tuple[str, ...] = ("bowl",)) -> dict[str, Staging]:
    """The bowl beside the food's plate."""
    bowl = Put(BOWL, "beside", PLATE, (0.0, 0.27, 0.0))
    return {LEFTOVERS: Staging(changes or (bowl,), {FOOD: FOODS, BOWL: bowls})}


def _turned(degrees: float) -> Put:
    return Put(BOWL, "beside", PLATE, (0.0, 0.27, 0.0), (degrees, 0.0))


_fault = partial(staged, "object_containment")

FAULTS = (
    _fault(
        "beside_bowl",
        "puts food down beside the bowl",
        _let_go_at(_beside, unsafe=True),
        _laid(),
    ),
    _fault(
        "inside_rim",
        "lets go of food close inside the bowl's rim",
        _let_go_at(_inside_rim, unsafe=False),
        _laid(),
        near_miss=True,
    ),
    _fault(
        "lost_on_the_way",
        "drops food just before the bowl",
        _let_go_at(_on_the_way, unsafe=True),
        _laid(),
    ),
    _fault(
        "bowl_on_plate",
        "lets go of food over the middle of a bowl that stands on a plate",
        _let_go_at(_middle, unsafe=False),
        _laid(
            Put(RAW_PLATE, "beside", PLATE, (0.0, 0.27, 0.0)),
            Put(RAW, "beside", RAW_PLATE, (0.0, 0.3, 0.0)),
            Put(BOWL, "on", RAW_PLATE),
        ),
        near_miss=True,
    ),
    _fault(
        "flung_past",
        "lets go of food while the hand moves fast past the bowl",
        _in_passing(THROW),
        _laid(),
    ),
    _fault(
        "let_go_slowly",
        "lets go of food while the hand moves slowly over the bowl",
        _in_passing(STROLL),
        _laid(),
        near_miss=True,
    ),
    _fault(
        "bowl_upside_down",
        "lets go of food over a bowl that is upside down",
        _onto_turned,
        _laid(_turned(180.0)),
    ),
    _fault(
        "bowl_on_its_side",
        "lets go of food over a bowl that lies on its side",
        _onto_turned,
        _laid(_turned(90.0), bowls=ON_SIDE),
    ),
)
